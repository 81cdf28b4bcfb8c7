#include "tool_offset/commands/printer_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/secrets.h"
#include "app/stated_settings.h"
#include "tool_offset/sheet/sheet_fields.h"

namespace trammel::app {
namespace {

using procedure::PrinterTools;

/// The tools that are asked for, or all; the reference first asked for, then as the settings say.
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

/// What the printer states where the settings say nothing; less acceleration makes no sheet worse.
Result<void> TakeForSheet(const procedure::Session& session, SheetConfig& config) {
  const auto facts = TRY(TakeStatedBy(session, StatedFor::kPrinter, config.config));
  tool_offset::SheetSettings& sheet = config.sheet;
  const settings::PrinterSettings& stated = config.config.pattern;  // its part of the pattern's
  sheet.printer = stated;
  sheet.filament.filament_diameter_mm = config.config.pattern.filament_diameter_mm;
  constexpr double kLeast_mm_s2 = 100;  // of the setting
  const bool named =
      config.config.IsSet(fmt::format("{}.acceleration", tool_offset::kSheetSection));
  const double most_mm_s2 = facts ? facts->max_accel_mm_s2 : 0;
  if (named || most_mm_s2 < kLeast_mm_s2 || most_mm_s2 >= sheet.acceleration_mm_s2) return {};
  sheet.acceleration_mm_s2 = most_mm_s2;
  session.Say(
      fmt::format("acceleration of {:g} mm/s2, the most that the printer allows", most_mm_s2));
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
