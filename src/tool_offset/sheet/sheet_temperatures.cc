#include "tool_offset/sheet/sheet_temperatures.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/check.h"
#include "settings/material.h"
#include "tool_offset/sheet/sheet_fields.h"
#include "tool_offset/sheet/sheet_placeholders.h"

namespace trammel::tool_offset {

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
