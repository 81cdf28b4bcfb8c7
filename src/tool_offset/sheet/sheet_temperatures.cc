#include "tool_offset/sheet/sheet_temperatures.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/check.h"
#include "gcode/dialect.h"
#include "settings/material.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_settings.h"

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

settings::FilamentSettings OnPaper(const SheetSettings& settings) {
  settings::FilamentSettings filament = settings.filament;
  if (!settings.nozzle_temperatures_c.empty()) {
    filament.nozzle_temperature_c = settings.nozzle_temperatures_c.at(ReferencePlace(settings));
  }
  if (settings.bed_temperature_c) {
    filament.bed_temperature_c = settings.bed_temperature_c;
  } else if (const auto bed_c = BedTemperature_c(settings.filament)) {
    filament.bed_temperature_c = std::min(*bed_c, kWarmestPaper_c);
  }
  return filament;
}

std::optional<settings::SettingProblem> FindTemperatureProblem(const SheetSettings& settings) {
  return settings::FindTemperatureProblem(OnPaper(settings));
}

double ToolTemperature_c(const SheetSettings& settings, std::size_t place) {
  return settings.nozzle_temperatures_c.empty()
             ? settings::TemperaturesOf(OnPaper(settings)).nozzle_c
             : settings.nozzle_temperatures_c.at(place);
}

double ToolIdleTemperature_c(const SheetSettings& settings, std::size_t place) {
  settings::FilamentSettings filament = OnPaper(settings);
  filament.nozzle_temperature_c = ToolTemperature_c(settings, place);
  return settings::TemperaturesOf(filament).idle_nozzle_c;
}

std::string DescribeTemperatures(const SheetSettings& settings) {
  const double bed_c = settings::TemperaturesOf(OnPaper(settings)).bed_c;
  const settings::Material* material = settings::FindMaterial(settings.filament.material);
  std::string text = material ? fmt::format("{}: ", material->name) : "";
  if (settings.nozzle_temperatures_c.empty()) {
    text += fmt::format("nozzle {:.4g}", ToolTemperature_c(settings, 0));
  } else {
    text += "nozzles";
    for (std::size_t place = 0; place < settings.tools.size(); ++place) {
      text += fmt::format("{} T{} {:.4g}", place == 0 ? "" : ",", settings.tools[place],
                          ToolTemperature_c(settings, place));
    }
  }
  text += fmt::format(", bed {:.4g} degC", bed_c);
  const auto usual_c = settings::BedTemperature_c(settings.filament);
  if (!settings.bed_temperature_c && usual_c && *usual_c > bed_c) {
    text += fmt::format(" (its {:.4g} would be too warm for paper)", *usual_c);
  }
  return text;
}

}  // namespace trammel::tool_offset
