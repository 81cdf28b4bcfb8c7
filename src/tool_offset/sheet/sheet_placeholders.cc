#include "tool_offset/sheet/sheet_placeholders.h"

#include <algorithm>

#include "base/check.h"
#include "gcode/number.h"
#include "gcode/tool_commands.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::tool_offset {

std::size_t ReferencePlace(const SheetSettings& settings) {
  const auto found =
      std::find(settings.tools.begin(), settings.tools.end(), settings.reference_tool);
  TRAMMEL_CHECK(found != settings.tools.end(), "reference_tool = {}", settings.reference_tool);
  return static_cast<std::size_t>(found - settings.tools.begin());
}

std::vector<gcode::Placeholder> SheetPlaceholders(const SheetPlan& plan) {
  const SheetSettings& settings = plan.settings;
  const BedBounds bounds = SheetBounds(settings, plan.width_mm, plan.height_mm);
  const settings::Drawing drawing{
      settings.layer_height_mm, settings.line_width_mm, settings.acceleration_mm_s2,
      bounds.min_x_mm,          bounds.min_y_mm,        bounds.max_x_mm,
      bounds.max_y_mm};
  return settings::Placeholders(settings.printer, OnPaper(settings), drawing);
}

std::vector<gcode::Placeholder> ToolPlaceholders(const SheetPlan& plan, std::size_t place,
                                                 std::size_t previous) {
  const std::vector<int>& tools = plan.settings.tools;
  std::vector<gcode::Placeholder> known = SheetPlaceholders(plan);
  known.push_back({"tool", std::to_string(tools.at(place))});
  known.push_back({"extruder", gcode::KlipperExtruder(tools.at(place))});
  known.push_back({"previous_tool", std::to_string(tools.at(previous))});
  const bool told = !FindTemperatureProblem(plan.settings);
  known.push_back({"tool_temperature_c",
                   gcode::FormatNumber(told ? ToolTemperature_c(plan.settings, place) : 0, 4)});
  return known;
}

}  // namespace trammel::tool_offset
