// What a print is heated to: by the filament's material, or by temperatures that the settings give.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "settings/printer.h"

namespace trammel::settings {

/// One of the materials that `material` in [filament] may name.
struct Material {
  std::string_view name;
  double nozzle_temperature_c = 0;
  double bed_temperature_c = 0;
  double density_g_cm3 = 0;
};

/// All of them. Temperatures of a first layer: PLA, PETG and ASA as in a public generic slicer
/// profile, ABS as in the paper, TPU, PC and PA our choice within what is usual.
[[nodiscard]] std::span<const Material> Materials();

/// The material of that name, in capitals or not; nullptr where there is none.
[[nodiscard]] const Material* FindMaterial(std::string_view name);

/// The one material that a filament's name has among its words: petg of "PETG Jet" and "petg_jet",
/// pa of "PA12-CF". nullptr: none, or several.
[[nodiscard]] const Material* MaterialInName(std::string_view filament);

/// Every material with its temperatures: "pla: nozzle 215, bed 60 °C; petg: …".
[[nodiscard]] std::string DescribeMaterials();

/// What a print is heated to.
struct PrintTemperatures {
  double nozzle_c = 0;
  double bed_c = 0;
  double idle_nozzle_c = 0;  ///< while the bed heats, and while a scan is waited for
};

/// Each as the settings give it, else as the material has it; absent where neither does.
[[nodiscard]] std::optional<double> NozzleTemperature_c(const FilamentSettings& filament);
[[nodiscard]] std::optional<double> BedTemperature_c(const FilamentSettings& filament);
[[nodiscard]] std::optional<double> Density_g_cm3(const FilamentSettings& filament);

/// As the settings give it, else this much below the nozzle's temperature: it does not ooze there.
inline constexpr double kIdleBelow_c = 60;
[[nodiscard]] std::optional<double> IdleNozzleTemperature_c(const FilamentSettings& filament);

/// A material that is named and that there is not, with those that there are.
[[nodiscard]] std::optional<SettingProblem> FindMaterialProblem(const FilamentSettings& filament);

/// A temperature that nothing tells: what to name, and what each material would be heated to.
[[nodiscard]] std::optional<SettingProblem> FindTemperatureProblem(
    const FilamentSettings& filament);

/// FindTemperatureProblem as an error.
[[nodiscard]] Result<void> ValidateTemperatures(const FilamentSettings& filament);

/// REQUIRES no FindTemperatureProblem.
[[nodiscard]] PrintTemperatures TemperaturesOf(const FilamentSettings& filament);

/// What heats behind a start G-code that does not name both temperatures by their placeholders: it
/// would print at nobody knows what. Empty where it does. REQUIRES as TemperaturesOf.
[[nodiscard]] std::vector<std::string> HeatBehind(std::string_view start_gcode,
                                                  const FilamentSettings& filament);

/// For people: "pla: nozzle 215, bed 60 degC", "nozzle 210 (set), bed 60 degC (pla)" … REQUIRES as
/// TemperaturesOf.
[[nodiscard]] std::string DescribeTemperatures(const FilamentSettings& filament);

}  // namespace trammel::settings
