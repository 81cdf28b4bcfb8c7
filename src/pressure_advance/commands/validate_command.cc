// trammel pa validate: prints lines without and with a pressure advance, and compares them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/output_files.h"
#include "app/printer_session.h"
#include "app/stated_settings.h"
#include "base/json_text.h"
#include "base/measured_json.h"
#include "document/interval_text.h"
#include "files/new_file.h"
#include "pressure_advance/commands/apply_command.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/laser_recording.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/response/improvement.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::ComparedGroup;
using pressure_advance::Improvement;
using Json = nlohmann::ordered_json;

struct ValidateArguments {
  PrinterOptions printer;
  std::string value;
  std::string out;
  bool dry_run = false;
  bool json = false;
};

// Sets half of the lines without pressure advance, half with the value, in one pattern.
Result<void> SetForComparison(double value_s, pressure_advance::PatternConfig& pattern) {
  constexpr int kLines = 10;         // five of either group, as in the paper
  constexpr double kMin_s = 0.0001;  // differs from 0 with the decimals of the G-code
  if (!(value_s >= kMin_s && value_s <= 10)) {
    return Fail(
        fmt::format("a pressure advance of {} s cannot be compared with none: it must lie "
                    "within {} ... 10 s",
                    value_s, kMin_s));
  }
  pattern.pressure_advances_s.clear();
  pattern.line_count = kLines;
  pattern.validated_pressure_advance_s = value_s;
  pattern.columns = pattern.rows = 1;
  return Validate(pattern);
}

Json GroupJson(const ComparedGroup& group) {
  return {{"pressure_advance_s", group.pressure_advance_s},
          {"lines", group.lines},
          {"used", group.used}};
}

std::string ToJson(const Improvement& improvement) {
  constexpr int kFormat = 2;
  const Json object = {{"format", kFormat},
                       {"control", GroupJson(improvement.control)},
                       {"calibrated", GroupJson(improvement.calibrated)},
                       {"improvement", MeasuredJson(improvement.deviation)},
                       {"surplus_left", MeasuredJson(improvement.surplus_left)}};
  return JsonText(object);
}

std::string Percent(const Measured& measured) {
  if (!measured.good()) {
    return fmt::format("{}: {}", VerdictText(measured.verdict()), measured.reason());
  }
  return report::WithInterval(measured.quantity(), {.unit = "%", .scale = 100, .min_decimals = 1});
}

// Compares the lines of a recording and writes validation.json into it.
Result<int> Compare(const fs::path& folder, bool json) {
  const auto measured = TRY(MeasureRecording(folder));
  const Improvement improvement =
      CompareWithControl(measured.profiles, measured.deviation.score_px, measured.scan.motion);
  const std::string text = ToJson(improvement);
  TRY(files::WriteWholeFile(folder / "validation.json", text, files::IfThere::kReplace));
  if (json) {
    std::fputs(text.c_str(), stdout);
  } else {
    const ComparedGroup& control = improvement.control;
    const ComparedGroup& calibrated = improvement.calibrated;
    fmt::print("validation        {} of {} lines without pressure advance, {} of {} at {:.4f} s\n",
               control.used, control.lines, calibrated.used, calibrated.lines,
               calibrated.pressure_advance_s);
    fmt::print("  improvement     {}\n", Percent(improvement.deviation));
    fmt::print("  surplus left    {}\n", Percent(improvement.surplus_left));
    fmt::print("  recording       {}\n", folder.string());
  }
  return improvement.deviation.good() ? kExitGood : kExitNotTrusted;
}

Result<int> RunValidate(const ValidateArguments& arguments) {
  const Interrupt interrupt;
  auto config = TRY(LoadSettings(arguments.printer));
  const auto value = TRY(ValueFrom(arguments.value));
  TRY(SetForComparison(value.value_s, config.pattern));
  TRY(settings::ValidateTemperatures(config.pattern));
  if (arguments.dry_run) {
    TRY(PrintDryRun(config.pattern, config.scan));
    return kExitGood;
  }
  const auto printer = TRY(Connect(config.scan, interrupt.token()));
  const procedure::Session session{*printer, interrupt.token(), ShowProgress};
  TRY(FitPattern(session, config));
  const auto folder = TRY(NewFolder::Make(arguments.out));
  const CalibrationRun run = CalibrateInto(session, RequestFor(config, folder.path()));
  if (!run.done) return tl::unexpected(run.done.error());
  auto code = Compare(folder.path(), arguments.json);
  CutRecordings({folder.path()}, interrupt.token());
  return code;
}

}  // namespace

void AddValidateCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "validate", "print lines without and with a pressure advance, and say what it improves");
  const auto arguments = std::make_shared<ValidateArguments>();
  command->add_option("value", arguments->value, "seconds, or a calibration's recording")
      ->required();
  AddPrinterOptions(*command, arguments->printer);
  AddCameraOption(*command, arguments->printer);
  AddMaterialOption(*command, arguments->printer.material);
  command->add_option("-o,--out", arguments->out, "new folder for everything that is recorded");
  command->add_flag("--dry-run", arguments->dry_run, "print the G-code and the sweeps, do nothing");
  command->add_flag("--json", arguments->json, "print the result as one JSON object");
  command->callback([arguments, &exit_code] { exit_code = CodeOf(RunValidate(*arguments)); });
}

}  // namespace trammel::app
