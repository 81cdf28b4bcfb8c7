#include "tool_offset/commands/sheet_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "app/printer_session.h"
#include "app/secrets.h"
#include "app/stated_settings.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_settings.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::app {
namespace {

using tool_offset::SheetGcode;
using tool_offset::SheetPlan;
using tool_offset::SheetSettings;

/// Returns a common tool change by its name.
Result<std::string> ToolChange(const std::string& name) {
  const std::string activate = "ACTIVATE_EXTRUDER EXTRUDER={extruder}";
  if (name == "t") return std::string("T{tool}");
  if (name == "activate-extruder") return activate;
  if (name == "idex") return "SET_DUAL_CARRIAGE CARRIAGE={tool}\n" + activate;
  return Fail(
      fmt::format("--tool-change {}: must be t, activate-extruder or idex; any other G-code "
                  "is tool_change_gcode in [{}]",
                  name, tool_offset::kSheetSection));
}

/// Applies the command line's shortcuts over the file's settings.
Result<void> Override(const SheetOptions& options, files::Config& config) {
  std::vector<std::string> assignments = options.set;
  if (!options.dialect.empty()) assignments.push_back("dialect=" + options.dialect);
  for (const std::string& assignment : assignments) {
    TRY(files::OverrideConfig(assignment, config, tool_offset::kSheetSection));
  }
  TakeMaterial(options.material, config);
  SheetSettings& sheet = config.sheet;
  if (!options.tool_change.empty()) {
    auto gcode = TRY(ToolChange(options.tool_change));
    sheet.tool_change_gcode = std::move(gcode);
  }
  if (options.tool && options.self_test) {
    return Fail(
        "--tool and --self-test: a self-test draws with the reference tool alone; leave "
        "one of them out");
  }
  if (options.for_photo) sheet.for_photo = true;
  if (options.tool) sheet.tools = {sheet.reference_tool, *options.tool};
  if (options.self_test) {
    sheet.self_test = true;
    sheet.tools = {sheet.reference_tool};
  }
  return {};
}

}  // namespace

Result<SheetConfig> ConfigureSheet(const SheetOptions& options) {
  auto text = TRY(FindConfig(options.config));
  auto config = TRY(files::ParseConfig(text.text, text.file));
  TRY(Override(options, config));
  SheetSettings sheet = files::SheetOf(config);
  return SheetConfig{std::move(config), std::move(text), std::move(sheet)};
}

Result<void> CheckSheet(const SheetConfig& config) {
  auto problem = FindProblem(config.sheet);
  if (!problem) problem = FindTemperatureProblem(config.sheet);
  if (!problem) return {};
  return tl::unexpected(
      files::LocateProblem(*problem, config.config, config.text.text, config.text.file));
}

void PrintSheetPlan(const SheetSettings& asked, const SheetPlan& plan, const SheetGcode& gcode) {
  const auto minutes = static_cast<int>(gcode.time_s / 60);
  fmt::print("sheet      {}: {:.1f} x {:.1f} mm, turned by {:.4g} degrees\n", plan.sheet_id,
             plan.width_mm, plan.height_mm, plan.settings.tilt_deg);
  if (plan.settings.teeth < asked.teeth) {
    fmt::print("teeth      {} instead of {}, so that it fits {} paper\n", plan.settings.teeth,
               asked.teeth, plan.settings.paper);
  }
  fmt::print("heated to  {}, once the paper is taped down on the cold bed\n",
             DescribeTemperatures(plan.settings));
  fmt::print("afterwards {}\n", DescribeAfterwards(plan.settings));
  fmt::print("structures {}, tool changes {}\n", plan.structures.size(), gcode.tool_changes);
  fmt::print("filament   {:.1f} mm\n", gcode.filament_mm);
  fmt::print("time       {} min {:.0f} s without heating and tool changes\n", minutes,
             gcode.time_s - 60 * minutes);
  const tool_offset::BedBounds bounds =
      tool_offset::SheetBounds(plan.settings, plan.width_mm, plan.height_mm);
  fmt::print(
      "bounds     X {:.2f} ... {:.2f} mm, Y {:.2f} ... {:.2f} mm: paper of at least {:.0f} x "
      "{:.0f} mm\n",
      bounds.min_x_mm, bounds.max_x_mm, bounds.min_y_mm, bounds.max_y_mm,
      std::ceil(bounds.max_x_mm - bounds.min_x_mm), std::ceil(bounds.max_y_mm - bounds.min_y_mm));
  if (const auto paper = tool_offset::PaperAround(plan)) {
    fmt::print("paper      {}, its middle at X {:.0f}, Y {:.0f} mm, its edges along the bed's\n",
               paper->name, (paper->bounds.min_x_mm + paper->bounds.max_x_mm) / 2,
               (paper->bounds.min_y_mm + paper->bounds.max_y_mm) / 2);
  }
  for (const std::string& warning : FindWarnings(plan.settings)) {
    fmt::print(stderr, "warning: {}\n", warning);
  }
}

void AddSheetOptions(CLI::App& command, SheetOptions& options) {
  command.add_option("--config", options.config,
                     "settings; left out: trammel.toml of this folder, if there is one");
  command.add_option("--set", options.set, "one setting: key=value; may be repeated");
  AddMaterialOption(command, options.material);
  command.add_flag("--for-photo", options.for_photo,
                   "arrange the sheet for a photo by a phone, where there is no scanner");
  command.add_option("--tool-change", options.tool_change,
                     "how tools are changed: t (T0, T1, ...), activate-extruder or idex (Klipper)");
}

namespace {

using procedure::PrinterTools;

/// Selects the requested tools, or all; the first requested one is the reference, else that of the
/// settings.
Result<void> ChooseTools(const std::vector<int>& tools, const PrinterTools& found,
                         SheetConfig& config) {
  tool_offset::SheetSettings& sheet = config.sheet;
  const bool named = !tools.empty() || config.config.options.contains(
                                           fmt::format("{}.tools", tool_offset::kSheetSection));
  if (!tools.empty()) sheet.tools = tools;
  if (!found.can_be_set() && !named) {
    return Fail(
        fmt::format("{}. Name the tools to print, as in --tools 0,1", WhyNotSet(found.keeper)),
        ErrorKind::kMachine);
  }
  if (!named) {
    sheet.tools.clear();
    for (const procedure::PrinterTool& tool : found.tools) sheet.tools.push_back(tool.number);
  }
  const auto has = [&sheet](int tool) {
    return std::find(sheet.tools.begin(), sheet.tools.end(), tool) != sheet.tools.end();
  };
  if (!has(sheet.reference_tool)) sheet.reference_tool = sheet.tools.front();
  return {};
}

/// Adopts the printer's statements for missing settings; less acceleration makes no sheet worse.
Result<void> TakeForSheet(const procedure::Session& session, SheetConfig& config) {
  const auto facts = TRY(TakeStatedBy(session, StatedFor::kPrinter, config.config));
  tool_offset::SheetSettings& sheet = config.sheet;
  const settings::PrinterSettings& stated = config.config.pattern;  // pattern's printer part
  sheet.printer = stated;
  sheet.filament.filament_diameter_mm = config.config.pattern.filament_diameter_mm;
  constexpr double kMin_mm_s2 = 100;  // setting's minimum
  const bool named =
      config.config.IsSet(fmt::format("{}.acceleration", tool_offset::kSheetSection));
  const double max_mm_s2 = facts ? facts->max_accel_mm_s2 : 0;
  if (named || max_mm_s2 < kMin_mm_s2 || max_mm_s2 >= sheet.acceleration_mm_s2) return {};
  sheet.acceleration_mm_s2 = max_mm_s2;
  session.Report(
      fmt::format("acceleration of {:g} mm/s2, the most that the printer allows", max_mm_s2));
  return {};
}

}  // namespace

Result<SheetConfig> ConfigureForPrinter(const SheetOptions& options, const std::string& printer) {
  auto config = ConfigureSheet(options);
  if (!config) return config;
  if (!printer.empty()) config->config.scan.address = printer;
  TRY(SettleApiKey(config->config.scan));
  if (config->sheet.printer.dialect != gcode::Dialect::kKlipper) {
    return Fail(
        fmt::format("dialect {}: trammel offset start prints through Moonraker, on Klipper; "
                    "trammel offset pattern writes files for other firmwares",
                    ToString(config->sheet.printer.dialect)));
  }
  return config;
}

Result<void> FitToPrinter(const SheetOptions& options, const std::vector<int>& tools,
                          const procedure::Session& session, const PrinterTools& found,
                          SheetConfig& config) {
  TRY(ChooseTools(tools, found, config));
  TRY(TakeForSheet(session, config));
  tool_offset::SheetSettings& sheet = config.sheet;
  const bool usual = sheet.tool_change_gcode == tool_offset::SheetSettings().tool_change_gcode;
  if (!usual || !options.tool_change.empty()) return {};
  auto gcode = TRY(UsualToolChange(session, found));
  sheet.tool_change_gcode = std::move(gcode);
  return {};
}

}  // namespace trammel::app
