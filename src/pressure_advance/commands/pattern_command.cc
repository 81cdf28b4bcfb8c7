// trammel pa pattern: writes the G-code of the pattern and its plan, and prints its time and
// filament.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/config/config_file.h"
#include "app/option_values.h"
#include "app/output_files.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/stated_settings.h"
#include "gcode/dialect.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/pattern_options.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::PatternConfig;
using pressure_advance::PatternLayout;
using pressure_advance::PatternSummary;

struct PatternArguments {
  std::string config;
  std::vector<std::string> set;
  std::string out = "pattern.gcode";
  std::string pa;
  std::string dialect;
  std::string material;
  bool photo = false;
  bool force = false;
  bool json = false;
};

/// Applies the command line's options over the file's settings.
Result<void> Override(const PatternArguments& arguments, files::Config& config) {
  if (arguments.photo) SetForPhoto(config.pattern);
  for (const std::string& assignment : arguments.set) {
    TRY(files::OverrideConfig(assignment, config));
  }
  if (!arguments.dialect.empty()) {
    TRY(files::OverrideConfig("dialect=" + arguments.dialect, config));
  }
  if (!arguments.pa.empty()) {
    config.pattern.pressure_advances_s = TRY(ParsePressureAdvances(arguments.pa));
    config.options["pressure_advance_pattern.pressure_advances"] = "--pa";
  }
  TakeMaterial(arguments.material, config);
  return {};
}

Result<files::Config> Configure(const PatternArguments& arguments, const ConfigText& text) {
  Result<files::Config> config = files::ParseConfig(text.text, text.file);
  if (!config) return tl::unexpected(config.error());
  TRY(Override(arguments, *config));
  TRY(files::ValidateConfig(*config, text.text, text.file));
  if (const auto problem = settings::FindTemperatureProblem(config->pattern)) {
    return tl::unexpected(files::LocateProblem(*problem, *config, text.text, text.file));
  }
  return config;
}

void Print(const PatternSummary& summary, const PatternLayout& layout, const PatternConfig& config,
           const MachineTime& time) {
  fmt::print("lines      {} in {} pattern(s)\n", layout.lines.size(), layout.patterns.size());
  fmt::print("heated to  {}\n", settings::DescribeTemperatures(config));
  fmt::print("afterwards {}\n", pressure_advance::DescribeAfterwards(config));
  fmt::print("filament   {:.1f} mm{}\n", summary.filament_mm,
             summary.filament_g ? fmt::format(", {:.2f} g", *summary.filament_g) : "");
  fmt::print("print      {} (without heating)\n", Describe(time.print));
  if (time.scan) {
    fmt::print("scan       {}\n", Describe(*time.scan));
    fmt::print("together   {:.1f} s (pa calibrate, without heating, cooling and homing)\n",
               time.total_s());
  }
  fmt::print("bounds     X {:.2f} ... {:.2f} mm, Y {:.2f} ... {:.2f} mm\n",
             summary.printed.min_x_mm, summary.printed.max_x_mm, summary.printed.min_y_mm,
             summary.printed.max_y_mm);
  fmt::print("peak flow  {:.1f} mm^3/s\n", summary.peak_flow_mm3_s);
}

// Prints the cost of the pattern as one JSON object.
void PrintJson(const PatternSummary& summary, const MachineTime& time) {
  const pressure_advance::BoundsMm& at = summary.printed;
  nlohmann::ordered_json json = {{"x_mm", {at.min_x_mm, at.max_x_mm}},
                                 {"y_mm", {at.min_y_mm, at.max_y_mm}},
                                 {"filament_mm", summary.filament_mm},
                                 {"peak_flow_mm3_s", summary.peak_flow_mm3_s},
                                 {"print_s",
                                  {{"lines", time.print.lines_s},
                                   {"frame", time.print.frame_s},
                                   {"between", time.print.between_s},
                                   {"to_and_fro", time.print.to_and_fro_s},
                                   {"total", time.print.total_s()}}}};
  if (time.scan) {
    json["scan_s"] = {{"sweeps", time.scan->sweeping_s},
                      {"turns", time.scan->turning_s},
                      {"standing", time.scan->standing_s},
                      {"travels", time.scan->travelling_s},
                      {"total", time.scan->total_s()}};
    json["total_s"] = time.total_s();
  }
  fmt::print("{}\n", json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

Result<void> RunPattern(const PatternArguments& arguments) {
  const ConfigText text = TRY(FindConfig(arguments.config));
  files::Config settings = TRY(Configure(arguments, text));
  const PatternConfig& config = settings.pattern;
  const fs::path gcode_path = arguments.out;
  if (!gcode_path.has_filename()) {
    return Fail(fmt::format("--out {}: must end in a file name", arguments.out));
  }
  fs::path plan_path = gcode_path;
  plan_path.replace_extension(".plan.json");
  TRY(RefuseToOverwrite({gcode_path, plan_path}, arguments.force));
  const PatternLayout layout = LayOut(config);
  const auto plan = MakePlan(layout, config, gcode_path.filename().string());
  TRY(WriteOutputs({{gcode_path, WriteGcode(layout, config)}, {plan_path, files::FormatPlan(plan)}},
                   arguments.force));
  const PatternSummary summary = Summarise(layout, config);
  const MachineTime time =
      arguments.photo ? MachineTime{summary.time, {}} : MachineTimeOf(config, settings.scan);
  if (arguments.json) {
    PrintJson(summary, time);
    return {};
  }
  fmt::print("settings   {}\n", text.file);
  fmt::print("G-code     {}\nplan       {}\n", gcode_path.string(), plan_path.string());
  Print(summary, layout, config, time);
  const std::string plan_option = " --plan " + ShellQuoted(plan_path.string());
  const bool scanned = !arguments.photo && config.dialect == gcode::Dialect::kKlipper;
  PrintWrapped("next",
               scanned
                   ? "print it, then trammel pa scan" + plan_option
                   : "print it, take a photo from straight above, then trammel pa analyze PHOTO" +
                         plan_option,
               11);
  if (const auto words = gcode::WordsOf(config.dialect); !words.transfer.empty()) {
    PrintWrapped("to print", std::string(words.transfer), 11);
  }
  return {};
}

}  // namespace

void AddPatternCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "pattern", "write the G-code of lines at rising pressure advance, and where they lie");
  auto arguments = std::make_shared<PatternArguments>();
  command->add_option("--config", arguments->config,
                      "settings; left out: trammel.toml of this folder, if there is one");
  command->add_option("--set", arguments->set, "one setting: key=value; may be repeated");
  command->add_option("-o,--out", arguments->out, "G-code file; its plan is written beside it")
      ->capture_default_str();
  command->add_option("--pa", arguments->pa,
                      "pressure advance in s: START:END:COUNT, START:END:STEP or a,b,c");
  command->add_option("--dialect", arguments->dialect, gcode::DialectNames());
  command->add_flag(
      "--photo", arguments->photo,
      "a pattern for a photo: 21 lines from 0 to 0.1 s (--pa for others), with a mark");
  AddMaterialOption(*command, arguments->material);
  command->add_flag("--force", arguments->force, "overwrite files");
  command->add_flag("--json", arguments->json, "print what it costs as one JSON object");
  command->callback([arguments, &exit_code] { exit_code = CodeOf(RunPattern(*arguments)); });
}

}  // namespace trammel::app
