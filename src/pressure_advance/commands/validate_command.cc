// trammel pa validate: what a pressure advance is worth, on a clean plate or from a recording.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/new_folder.h"
#include "app/printer_session.h"
#include "app/stated_settings.h"
#include "pressure_advance/commands/apply_command.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/commands/validation.h"
#include "pressure_advance/procedure/comparison.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

struct ValidateArguments {
  PrinterOptions printer;
  std::string value;
  std::string recording;
  std::string out;
  bool dry_run = false;
  bool json = false;
  bool keep_full = false;
};

int Evaluate(const ValidateArguments& arguments) {
  const auto improvement = EvaluateComparison(arguments.recording);
  if (!improvement) return PrintError(improvement.error());
  return PrintImprovement(*improvement, arguments.recording, arguments.json);
}

int RunValidate(const ValidateArguments& arguments) {
  if (!arguments.recording.empty()) return Evaluate(arguments);
  if (arguments.value.empty()) {
    const Result<void> missing = Fail(
        "name the pressure advance to validate, in s or as a recording's folder, or a "
        "recorded comparison with --recording");
    return PrintError(missing.error());
  }
  const Interrupt interrupt;
  auto config = LoadSettings(arguments.printer);
  if (!config) return PrintError(config.error());
  const auto value = ValueFrom(arguments.value);
  if (!value) return PrintError(value.error());
  files::Config one = *config;
  auto pattern = procedure::ComparisonPattern(one.pattern, value->value_s);
  if (!pattern) return PrintError(pattern.error());
  config->pattern = std::move(*pattern);
  if (auto valid = Validate(config->pattern); !valid) return PrintError(valid.error());
  if (auto told = settings::ValidateTemperatures(config->pattern); !told) {
    return PrintError(told.error());
  }
  if (arguments.dry_run) {
    const auto done = PrintDryRun(config->pattern, config->scan);
    return done ? static_cast<int>(kExitGood) : PrintError(done.error());
  }
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return PrintError(printer.error());
  const procedure::Session session{**printer, interrupt.token(), TellOnTerminal};
  if (auto fitted = FitPattern(session, one); !fitted) return PrintError(fitted.error());
  pattern = procedure::ComparisonPattern(one.pattern, value->value_s);
  if (!pattern) return PrintError(pattern.error());
  config->pattern = std::move(*pattern);
  const auto folder = NewFolder::Make(arguments.out);
  if (!folder) return PrintError(folder.error());
  auto request = RequestFor(*config, folder->path());
  procedure::RecordingCutter cutter;
  if (!arguments.keep_full) request.cutter = &cutter;
  const auto improvement = RunComparison(session, request);
  if (!improvement) return PrintError(improvement.error());
  const int code = PrintImprovement(*improvement, folder->path(), arguments.json);
  FinishCutting(cutter, interrupt.token());
  return code;
}

}  // namespace

void AddValidateCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "validate", "print lines without and with a pressure advance, and say what it improves");
  const auto arguments = std::make_shared<ValidateArguments>();
  command->add_option("value", arguments->value, "seconds, or a calibration's recording");
  command->add_option("--recording", arguments->recording,
                      "print nothing: compare the lines of this recording again");
  AddPrinterOptions(*command, arguments->printer);
  AddCameraOption(*command, arguments->printer);
  AddMaterialOption(*command, arguments->printer.material);
  command->add_option("-o,--out", arguments->out, "new folder for everything that is recorded");
  command->add_flag("--dry-run", arguments->dry_run, "print the G-code and the sweeps, do nothing");
  command->add_flag("--json", arguments->json, "print the result as one JSON object");
  AddKeepFullOption(*command, arguments->keep_full);
  command->callback([arguments, &exit_code] { exit_code = RunValidate(*arguments); });
}

}  // namespace trammel::app
