// Temperatures of a print: by the filament's material, or from the settings.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "settings/printer.h"

namespace trammel::settings {

/// Material that `material` in [filament] may name.
struct Material {
  std::string_view name;
  double nozzle_temperature_c = 0;
  double bed_temperature_c = 0;
  double density_g_cm3 = 0;
};

/// Returns all materials. Temperatures of a first layer: PLA, PETG and ASA as in a public generic
/// slicer profile, ABS as in the paper, TPU, PC and PA our choice within the usual range.
[[nodiscard]] std::span<const Material> Materials();

/// Finds the material of that name, ignoring case; nullptr if there is none.
[[nodiscard]] const Material* FindMaterial(std::string_view name);

/// Finds the one material among the words of a filament's name: petg of "PETG Jet" and "petg_jet",
/// pa of "PA12-CF". nullptr: none, or several.
[[nodiscard]] const Material* MaterialInName(std::string_view filament);

/// Returns every material with its temperatures: "pla: nozzle 215, bed 60 °C; petg: …".
[[nodiscard]] std::string DescribeMaterials();

/// Temperatures of a print.
struct PrintTemperatures {
  double nozzle_c = 0;
  double bed_c = 0;
  double idle_nozzle_c = 0;  ///< while the bed heats, and while a scan is waited for
};

/// Returns the settings' temperature, else the material's; absent if neither has one.
[[nodiscard]] std::optional<double> NozzleTemperature_c(const FilamentSettings& filament);
[[nodiscard]] std::optional<double> BedTemperature_c(const FilamentSettings& filament);
[[nodiscard]] std::optional<double> Density_g_cm3(const FilamentSettings& filament);

/// Default of the idle temperature, this much below the nozzle's: it does not ooze there.
inline constexpr double kIdleBelow_c = 60;
[[nodiscard]] std::optional<double> IdleNozzleTemperature_c(const FilamentSettings& filament);

/// Returns a problem if the material is unknown, with the known ones.
[[nodiscard]] std::optional<SettingProblem> FindMaterialProblem(const FilamentSettings& filament);

/// Returns a problem if a temperature is undefined: the missing settings, and each material's
/// temperatures.
[[nodiscard]] std::optional<SettingProblem> FindTemperatureProblem(
    const FilamentSettings& filament);

/// Returns FindTemperatureProblem as an error.
[[nodiscard]] Result<void> ValidateTemperatures(const FilamentSettings& filament);

/// REQUIRES no FindTemperatureProblem.
[[nodiscard]] PrintTemperatures TemperaturesOf(const FilamentSettings& filament);

/// Returns the heating lines after a start G-code without both temperatures' placeholders: it would
/// print at unknown ones. Empty if it has both. REQUIRES as TemperaturesOf.
[[nodiscard]] std::vector<std::string> HeatBehind(std::string_view start_gcode,
                                                  const FilamentSettings& filament);

/// Describes the temperatures: "pla: nozzle 215, bed 60 degC", "nozzle 210 (set), bed 60 degC
/// (pla)" … REQUIRES as TemperaturesOf.
[[nodiscard]] std::string DescribeTemperatures(const FilamentSettings& filament);

}  // namespace trammel::settings
