// trammel tap watch: analyses every tap of a printer when it arrives.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "session/session.h"
#include "tap/commands/tap_commands.h"
#include "tap/commands/tap_run.h"
#include "tap/commands/tap_watcher.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

struct WatchArguments {
  TapArguments tap;
  PrinterOptions printer;
  std::string out;
  bool answer = false;
  double answer_within_s = 3;
  std::size_t count = 0;
};

/// Returns the file that taps are appended to, and makes its folder.
Result<fs::path> RecordingOf(const std::string& asked_for) {
  const fs::path file =
      asked_for.empty()
          ? fs::path("recordings") / (RecordingName(measurement::Instrument::kTap) + ".jsonl")
          : fs::path(asked_for);
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) {
    return Fail(fmt::format("--out {}: is a folder; name a file", file.string()));
  }
  std::error_code error;
  if (!file.parent_path().empty()) fs::create_directories(file.parent_path(), error);
  if (error) {
    return Fail(
        fmt::format("--out {}: cannot make the folder: {}", file.string(), error.message()));
  }
  return file;
}

Result<WatchOptions> OptionsOf(const WatchArguments& arguments, const std::string& printer) {
  const auto tap = TRY(TapOptionsOf(arguments.tap));
  if (!(arguments.answer_within_s >= 0.1 && arguments.answer_within_s <= 60)) {
    return Fail(fmt::format("--answer-within {}: must be 0.1 … 60 s", arguments.answer_within_s));
  }
  const auto file = TRY(RecordingOf(arguments.out));
  return WatchOptions{
      tap, file, printer, arguments.answer, arguments.answer_within_s, arguments.count};
}

int RunWatch(const WatchArguments& arguments) {
  const Interrupt interrupt;
  const auto config = LoadSettings(arguments.printer);
  if (!config) return PrintError(config.error());
  const auto options = OptionsOf(arguments, config->scan.address);
  if (!options) return PrintError(options.error());
  machine::TapStreamOptions stream_options;
  stream_options.moonraker.address = config->scan.address;
  stream_options.moonraker.api_key = config->scan.api_key;
  stream_options.moonraker.ca_file = config->scan.ca_file;
  stream_options.moonraker.accept_any_certificate = config->scan.accept_any_certificate;
  stream_options.moonraker.client_name = "trammel-tap";
  if (arguments.answer) stream_options.remote_method = "trammel_tap";
  TapWatcher watcher(*options);
  const auto stream =
      machine::OpenTapStream(stream_options, watcher.Events(),
                             {stream_options.moonraker.connect_time_limit_s, interrupt.token()});
  if (!stream) return PrintError(procedure::NameStopReason(interrupt.token(), stream.error()));
  fmt::print(stderr, "watching for taps at {}{}; recording to {}\n", config->scan.address,
             arguments.answer ? ", answering _TRAMMEL_TAP" : "", options->recording.string());
  return watcher.Serve(**stream, interrupt.token());
}

}  // namespace

void AddTapWatchCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "watch", "show each tap of a printer as it comes, beside the printer's own result");
  const auto arguments = std::make_shared<WatchArguments>();
  AddPrinterOptions(*command, arguments->printer);
  AddTapOptions(*command, arguments->tap);
  command->add_option("-o,--out", arguments->out,
                      "JSON lines that every tap is added to (default recordings/tap-<UTC>.jsonl)");
  command->add_flag("--answer", arguments->answer,
                    "hand the contact back to the macro _TRAMMEL_TAP (klipper/README.md)");
  command
      ->add_option("--answer-within", arguments->answer_within_s,
                   "s after which a macro is told that no tap came")
      ->capture_default_str();
  command->add_option("--count", arguments->count, "end after so many taps");
  command->callback([arguments, &exit_code] { exit_code = RunWatch(*arguments); });
}

}  // namespace trammel::app
