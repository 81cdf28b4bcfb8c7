#include "app/serve_command.h"

#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "base/bounded_json.h"
#include "base/json_text.h"
#include "panel/panel.h"
#include "service/serve.h"
#include "session/run_journal.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

struct ServeArguments {
  std::vector<std::string> configs;
  std::vector<std::string> addresses;
  std::vector<std::string> set;
  std::string camera;
  std::string material;
  std::string out = "recordings";
  bool answer_taps = false;
  std::string panel;                     // [ADDRESS:]PORT; empty: no panel
  std::vector<std::string> panel_names;  // under which browsers may open it
  std::string ask;          // a method: asked of a service that runs, in place of serving
  std::string with = "{}";  // method's arguments
};

// Returns one printer for each --config and --printer, paired in their order if there are several
// of both.
Result<std::vector<service::PrinterPlace>> PlacesOf(const ServeArguments& arguments) {
  const std::size_t configs = arguments.configs.size();
  const std::size_t addresses = arguments.addresses.size();
  if (configs > 1 && addresses > 1 && configs != addresses) {
    return Fail(
        fmt::format("--config was given {} times and --printer {} times: give each printer "
                    "its own, in the same order, or one --config for all",
                    configs, addresses));
  }
  std::vector<service::PrinterPlace> places(std::max({configs, addresses, std::size_t{1}}));
  for (std::size_t i = 0; i < places.size(); ++i) {
    service::PrinterPlace& place = places[i];
    if (configs > 0) place.config = arguments.configs[configs == 1 ? 0 : i];
    if (addresses > 0) place.address = arguments.addresses[addresses == 1 ? 0 : i];
    place.set = arguments.set;
    place.camera = arguments.camera;
    place.material = arguments.material;
  }
  return places;
}

Result<fs::path> OwnProgram() {
  std::error_code error;
  fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) return program;
  return Fail("/proc/self/exe cannot be read, so no job could be started: " + error.message());
}

Result<service::ServedPrinter> ServedAt(const service::PrinterPlace& place,
                                        const ServeArguments& arguments,
                                        const service::Offerings& offered) {
  const auto config = TRY(LoadSettings(OptionsAt(place)));
  const auto state = TRY(files::StateFolder());
  const auto program = TRY(OwnProgram());
  service::ServedPrinter served;
  served.settings = config.scan;
  served.server = {place,
                   config.scan.address,
                   program.string(),
                   std::string(ProgramVersion()),
                   fs::absolute(arguments.out),
                   state,
                   offered.jobs,
                   UtcNow,
                   [](const std::string& line) { fmt::print(stderr, "{}\n", line); }};
  served.server.answers_taps = arguments.answer_taps;
  if (arguments.answer_taps) served.attendants = offered.attendants;
  served.connect = [settings = config.scan](const std::stop_token& stop) {
    return ConnectAsService(settings, stop);
  };
  return served;
}

// Prints the service's answer to a request through Moonraker, as front ends make it.
Result<int> AskService(const ServeArguments& arguments, const service::PrinterPlace& place,
                       const std::stop_token& stop) {
  constexpr double kPatience_s = 10;
  const auto config = TRY(LoadSettings(OptionsAt(place)));
  const auto with = TRY(ParseBoundedJson(arguments.with, "--with"));
  const auto printer = TRY(Connect(config.scan, stop));
  const auto answer = TRY(printer->CallServer(
      "server.extensions.request",
      {{"agent", kServiceAgent}, {"method", arguments.ask}, {"arguments", with}},
      {kPatience_s, stop}));
  fmt::print("{}", JsonText(answer));
  return kExitGood;
}

// Parses "7130" or "0.0.0.0:7130" or "[::]:7130".
Result<panel::HttpServerOptions> PlaceOfPanel(const ServeArguments& arguments) {
  panel::HttpServerOptions options;
  const std::string& text = arguments.panel;
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos) options.address = text.substr(0, colon);
  if (options.address.starts_with('[') && options.address.ends_with(']')) {
    options.address = options.address.substr(1, options.address.size() - 2);
  }
  const char* const begin = text.data() + (colon == std::string::npos ? 0 : colon + 1);
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), options.port);
  if (error != std::errc() || end != text.data() + text.size()) {
    return Fail(
        fmt::format("--panel {}: give a port, or an address and a port, such as 7130 or "
                    "0.0.0.0:7130",
                    text));
  }
  options.guard.names = arguments.panel_names;
  return options;
}

Result<std::unique_ptr<panel::Panel>> OpenPanel(const ServeArguments& arguments,
                                                const service::JobServerOptions& server,
                                                bool surveys) {
  if (arguments.panel.empty()) return std::unique_ptr<panel::Panel>();
  const auto place = TRY(PlaceOfPanel(arguments));
  auto opened = TRY(panel::Panel::Open(
      {place, {server.program, server.recordings, server.utc_now, server.log}, surveys}));
  const bool six = place.address.find(':') != std::string::npos;
  server.log(fmt::format("panel at http://{}{}{}:{}/", six ? "[" : "", place.address,
                         six ? "]" : "", opened->port()));
  return opened;
}

// Returns the memory of large blocks at once: a service waits for days, and no picture is measured
// in it.
void ReturnMemory() {
  constexpr int kLarge = 128 << 10;  // glibc's defaults, which RunProgram raises for pictures
  mallopt(M_MMAP_THRESHOLD, kLarge);
  mallopt(M_TRIM_THRESHOLD, kLarge);
}

Result<int> RunServe(const ServeArguments& arguments, const service::Offerings& offered) {
  ReturnMemory();
  const Interrupt interrupt;
  const auto places = TRY(PlacesOf(arguments));
  if (!arguments.ask.empty()) return AskService(arguments, places.front(), interrupt.token());
  std::vector<service::ServedPrinter> printers;
  const auto in_use = std::make_shared<service::FoldersInUse>();
  for (const service::PrinterPlace& place : places) {
    auto served = TRY(ServedAt(place, arguments, offered));
    served.server.in_use = in_use;
    printers.push_back(std::move(served));
  }
  const auto panel = TRY(OpenPanel(arguments, printers.front().server, offered.surveys));
  service::Beside beside;
  if (panel) beside = [&panel](auto servers, const auto& stop) { panel->Run(servers, stop); };
  const auto was_working = TRY(service::Serve(printers, interrupt.token(), beside));
  return was_working ? kExitInterrupted : kExitGood;
}

}  // namespace

PrinterOptions OptionsAt(const service::PrinterPlace& place) {
  return {place.config, place.set, place.address, place.camera, place.material};
}

Result<void> CheckTemperatureArgument(const std::string& text) {
  constexpr std::size_t kLongest = 6;
  const bool plain = !text.empty() && text.size() <= kLongest &&
                     text.find_first_not_of("0123456789.") == std::string::npos;
  if (plain) return {};
  return Fail("TEMP must be the nozzle's temperature in degC, such as 240 or 235.5");
}

void AddServeOptions(CLI::App& command, int& exit_code, Offers offers) {
  const auto arguments = std::make_shared<ServeArguments>();
  command.add_option("--config", arguments->configs,
                     "settings; left out: trammel.toml of this folder, if there is one; one for "
                     "each printer, or one for all");
  command.add_option("--set", arguments->set, "one setting: key=value; may be repeated");
  command.add_option("--printer", arguments->addresses,
                     "Moonraker's address: host, host:port, URL or unix:PATH; may be repeated");
  command.add_option("--camera", arguments->camera, "as for pa calibrate");
  AddMaterialOption(command, arguments->material);
  command.add_option("-o,--out", arguments->out, "folder in which each run gets its own")
      ->capture_default_str();
  command.add_flag("--answer-taps", arguments->answer_taps,
                   "run trammel tap watch --answer beside it, for TRAMMEL_TAP: a process more");
  command.add_option("--panel", arguments->panel,
                     "a page for browsers at this PORT of this computer; 0.0.0.0:PORT also for "
                     "others of its network");
  command
      .add_option("--panel-name", arguments->panel_names,
                  "a name, besides this computer's own, under which browsers open the page; may "
                  "be repeated")
      ->needs("--panel");
  command.add_option("--ask", arguments->ask,
                     "ask the service of the printer: status, start, stop, result, history or "
                     "dismiss; prints its answer as JSON");
  command.add_option("--with", arguments->with, "the arguments of --ask, a JSON object")
      ->needs("--ask")
      ->capture_default_str();
  command.callback([arguments, offers = std::move(offers), &exit_code] {
    exit_code = CodeOf(RunServe(*arguments, offers()));
  });
}

}  // namespace trammel::app
