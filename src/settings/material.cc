#include "settings/material.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "base/check.h"
#include "gcode/dialect.h"

namespace trammel::settings {
namespace {

constexpr std::string_view kFilament = "filament";

constexpr auto kMaterials = std::to_array<Material>({
    {"pla", 215, 60, 1.24},
    {"petg", 235, 85, 1.27},
    {"abs", 255, 110, 1.04},
    {"asa", 255, 100, 1.07},
    {"tpu", 230, 50, 1.21},
    {"pc", 275, 110, 1.20},
    {"pa", 260, 90, 1.14},
});

bool SameLetters(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

/// Formats a temperature with its source: the settings or the material.
std::string Described(const std::optional<double>& set, double temperature_c) {
  return fmt::format("{:.4g}{}", temperature_c, set ? " (set)" : "");
}

}  // namespace

std::span<const Material> Materials() { return kMaterials; }

const Material* FindMaterial(std::string_view name) {
  const auto found = std::find_if(kMaterials.begin(), kMaterials.end(),
                                  [&](const Material& m) { return SameLetters(m.name, name); });
  return found == kMaterials.end() ? nullptr : &*found;
}

const Material* MaterialInName(std::string_view filament) {
  const Material* found = nullptr;
  std::string word;
  for (std::size_t i = 0; i <= filament.size(); ++i) {
    const unsigned char c = i < filament.size() ? static_cast<unsigned char>(filament[i]) : ' ';
    if (std::isalpha(c) != 0) {
      word += static_cast<char>(c);
      continue;
    }
    const Material* const named = FindMaterial(word);
    word.clear();
    if (named == nullptr) continue;
    if (found != nullptr && found != named) return nullptr;
    found = named;
  }
  return found;
}

std::string DescribeMaterials() {
  std::string text;
  for (const Material& material : kMaterials) {
    text += fmt::format("{}{}: nozzle {:.4g}, bed {:.4g} °C", text.empty() ? "" : "; ",
                        material.name, material.nozzle_temperature_c, material.bed_temperature_c);
  }
  return text;
}

std::optional<double> NozzleTemperature_c(const FilamentSettings& filament) {
  if (filament.nozzle_temperature_c) return filament.nozzle_temperature_c;
  const Material* material = FindMaterial(filament.material);
  return material ? std::optional(material->nozzle_temperature_c) : std::nullopt;
}

std::optional<double> BedTemperature_c(const FilamentSettings& filament) {
  if (filament.bed_temperature_c) return filament.bed_temperature_c;
  const Material* material = FindMaterial(filament.material);
  return material ? std::optional(material->bed_temperature_c) : std::nullopt;
}

std::optional<double> Density_g_cm3(const FilamentSettings& filament) {
  if (filament.filament_density_g_cm3) return filament.filament_density_g_cm3;
  const Material* material = FindMaterial(filament.material);
  return material ? std::optional(material->density_g_cm3) : std::nullopt;
}

std::optional<double> IdleNozzleTemperature_c(const FilamentSettings& filament) {
  if (filament.idle_nozzle_temperature_c) return filament.idle_nozzle_temperature_c;
  const auto nozzle_c = NozzleTemperature_c(filament);
  return nozzle_c ? std::optional(std::max(0.0, *nozzle_c - kIdleBelow_c)) : std::nullopt;
}

std::optional<SettingProblem> FindMaterialProblem(const FilamentSettings& filament) {
  if (filament.material.empty() || FindMaterial(filament.material) != nullptr) return std::nullopt;
  return SettingProblem{
      std::string(kFilament), "material",
      fmt::format("\"{}\" is not known; known are {}; for any other set nozzle_temperature and "
                  "bed_temperature and leave material out",
                  filament.material.substr(0, 40), DescribeMaterials())};
}

std::optional<SettingProblem> FindTemperatureProblem(const FilamentSettings& filament) {
  if (auto problem = FindMaterialProblem(filament)) return problem;
  const bool nozzle = NozzleTemperature_c(filament).has_value();
  const bool bed = BedTemperature_c(filament).has_value();
  if (nozzle && bed) return std::nullopt;
  const char* missing = nozzle ? "bed_temperature" : bed ? "nozzle_temperature" : "material";
  return SettingProblem{
      std::string(kFilament), missing,
      fmt::format("{}, and nothing is heated on a guess. Name the material with --material NAME or "
                  "in [filament] ({}), or set both nozzle_temperature and bed_temperature there",
                  nozzle ? "the bed's temperature is not given"
                  : bed  ? "the nozzle's temperature is not given"
                         : "no material is named",
                  DescribeMaterials())};
}

Result<void> ValidateTemperatures(const FilamentSettings& filament) {
  const auto problem = FindTemperatureProblem(filament);
  if (!problem) return {};
  return Fail(fmt::format("[{}] {}: {}", problem->section, problem->key, problem->message));
}

PrintTemperatures TemperaturesOf(const FilamentSettings& filament) {
  const auto problem = FindTemperatureProblem(filament);
  TRAMMEL_CHECK(!problem, "{}", problem->message);
  return {*NozzleTemperature_c(filament), *BedTemperature_c(filament),
          *IdleNozzleTemperature_c(filament)};
}

std::vector<std::string> HeatBehind(std::string_view start_gcode,
                                    const FilamentSettings& filament) {
  const PrintTemperatures temperatures = TemperaturesOf(filament);
  std::vector<std::string> lines;
  const auto heat = [&](std::string_view name, const char* set, const char* wait, double target_c) {
    if (start_gcode.find(name) != std::string_view::npos) return;
    lines.push_back(fmt::format("; start_gcode does not name {}", name));
    lines.push_back(
        fmt::format("{} S{}", target_c > 0 ? wait : set, gcode::FormatNumber(target_c, 4)));
  };
  heat("{bed_temperature_c}", "M140", "M190", temperatures.bed_c);
  heat("{nozzle_temperature_c}", "M104", "M109", temperatures.nozzle_c);
  return lines;
}

std::string DescribeTemperatures(const FilamentSettings& filament) {
  const PrintTemperatures temperatures = TemperaturesOf(filament);
  const Material* material = FindMaterial(filament.material);
  return fmt::format(
      "{}nozzle {}, bed {} degC", material ? fmt::format("{}: ", material->name) : "",
      Described(material ? filament.nozzle_temperature_c : std::nullopt, temperatures.nozzle_c),
      Described(material ? filament.bed_temperature_c : std::nullopt, temperatures.bed_c));
}

}  // namespace trammel::settings
