// trammel pa apply
#include "app/apply_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "app/analysis_run.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "app/printer_session.h"
#include "procedure/calibrate.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

struct ApplyArguments {
  PrinterOptions printer;
  std::string value;
};

Result<double> Answer(const fs::path& folder) {
  const auto run = AnalyseRecording(folder, pressure_advance::Method::kResponse);
  if (!run) return tl::unexpected(run.error());
  const Measured& measured = run->analysis.pressure_advance;
  if (measured.good()) return measured.quantity().value;
  return Fail(fmt::format("{}: it gives no value, because the verdict is {}: {}", folder.string(),
                          ToString(measured.verdict()), measured.reason()),
              ErrorKind::kMeasurement);
}

Result<double> ParseValue(const std::string& text) {
  const auto values = ParsePressureAdvances(text);
  if (!values) return Fail(values.error().message);
  if (values->size() == 1) return values->front();
  return Fail(fmt::format("{}: must be one pressure advance in s, or a recording's folder", text));
}

int RunApply(const ApplyArguments& arguments) {
  const Interrupt interrupt;
  const auto config = LoadSettings(arguments.printer);
  if (!config) return Report(config.error());
  const Result<double> value = ValueFrom(arguments.value);
  if (!value) return Report(value.error());
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return Report(printer.error());
  const procedure::Session session{**printer, interrupt.token(), TellOnTerminal};
  const auto done = Apply(session, *value, false);
  return done ? static_cast<int>(kExitGood) : Report(done.error());
}

}  // namespace

Result<double> ValueFrom(const std::string& text) {
  std::error_code ignored;
  return fs::is_directory(text, ignored) ? Answer(text) : ParseValue(text);
}

Result<void> Apply(const procedure::Session& session, double pressure_advance_s, bool quiet) {
  auto done = procedure::ApplyPressureAdvance(session, pressure_advance_s);
  if (!done || quiet) return done;
  fmt::print("applied           SET_PRESSURE_ADVANCE ADVANCE={:.4f}, until the next restart\n",
             pressure_advance_s);
  ExplainKeeping(pressure_advance_s);
  return {};
}

void ExplainKeeping(double pressure_advance_s) {
  fmt::print("to keep it        add to [extruder] in printer.cfg:  pressure_advance: {:.4f}\n",
             pressure_advance_s);
}

void AddApplyCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand("apply", "set a pressure advance on the printer");
  const auto arguments = std::make_shared<ApplyArguments>();
  command->add_option("value", arguments->value, "seconds, or a recording's folder")->required();
  AddPrinterOptions(*command, arguments->printer);
  command->callback([arguments, &exit_code] { exit_code = RunApply(*arguments); });
}

}  // namespace trammel::app
