#include "app/shop/sim_sheet_traits.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace trammel::app {
namespace {

struct Setting {
  std::string_view name;
  double number = 0;
};

constexpr std::array<std::string_view, 27> kSheetNames = {
    "backlash-x-um",  "backlash-y-um",     "leg-placement-um",
    "leg-width-um",   "roughness-um",      "roughness-mm",
    "coupling-um",    "motor-um",          "pulley-um",
    "start-bulge-um", "end-bulge-um",      "wrinkle-um",
    "dirt",           "broken-share",      "string-share",
    "bead-height",    "filament-diameter", "paper",
    "width-factor",   "opacity",           "missing-share",
    "hairs",          "fold-um",           "fold-deg",
    "fold-x-mm",      "fold-y-mm",         "fold-darkness"};
constexpr std::array<std::string_view, 21> kScannerNames = {
    "rotation-deg", "shift-x-mm",    "shift-y-mm",   "scale-x",    "scale-y",   "skew",
    "bar-um",       "shadow",        "shadow-mm",    "blur-um",    "noise",     "texture",
    "gamma",        "lamp-falloff",  "cast-red",     "cast-green", "cast-blue", "crop-top-mm",
    "crop-left-mm", "perspective-x", "perspective-y"};

std::string Names() {
  return fmt::format("{}, {}", fmt::join(kSheetNames, ", "), fmt::join(kScannerNames, ", "));
}

Result<Setting> Parse(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string_view number = equals == std::string_view::npos ? "" : text.substr(equals + 1);
  Setting setting{text.substr(0, equals), 0};
  const auto [end, fault] =
      std::from_chars(number.data(), number.data() + number.size(), setting.number);
  if (fault != std::errc() || end != number.data() + number.size() ||
      !std::isfinite(setting.number)) {
    return Fail(fmt::format("--set {}: must be NAME=NUMBER", text.substr(0, 60)));
  }
  const auto in = [&](const auto& names) {
    return std::find(names.begin(), names.end(), setting.name) != names.end();
  };
  if (!in(kSheetNames) && !in(kScannerNames)) {
    return Fail(fmt::format("--set {}: there is no such name; choose one of {}", text.substr(0, 60),
                            Names()));
  }
  return setting;
}

void SetWrinkle(double amplitude_mm, sim::SheetPaper& paper) {
  const double share = 1 / std::sqrt(std::max<std::size_t>(1, paper.wrinkle.size()));
  for (sim::WrinkleWave& wave : paper.wrinkle) {
    wave.amplitude_mm = {amplitude_mm * share, amplitude_mm * share};
  }
}

/// Sets a property of the paper's one fold.
void SetFold(std::string_view name, double number, sim::SheetPaper& paper) {
  constexpr double kDegree = 3.14159265358979323846 / 180;
  if (paper.folds.empty()) paper.folds.emplace_back();
  sim::PaperFold& fold = paper.folds.front();
  if (name == "fold-um") fold.taken_up_mm = number / 1000;
  if (name == "fold-deg") fold.direction_rad = number * kDegree;
  if (name == "fold-x-mm") fold.through.x_mm = number;
  if (name == "fold-y-mm") fold.through.y_mm = number;
  if (name == "fold-darkness") fold.darkness = number;
}

}  // namespace

std::string SheetTraitNames() { return Names(); }

Result<void> SetSheetTrait(std::string_view text, sim::SheetMachine& machine,
                           sim::SheetPaper& paper) {
  const auto setting = TRY(Parse(text));
  const std::string_view name = setting.name;
  const double number = setting.number;
  const double mm = number / 1000;  // of what is given in um
  if (name == "backlash-x-um") machine.backlash_mm[0] = mm;
  if (name == "backlash-y-um") machine.backlash_mm[1] = mm;
  if (name == "leg-placement-um") machine.leg_placement_mm = mm;
  if (name == "leg-width-um") machine.leg_width_mm = mm;
  if (name == "roughness-um") machine.edge_roughness_mm = mm;
  if (name == "roughness-mm") machine.edge_correlation_mm = number;
  if (name == "coupling-um") machine.coupling_mm = mm;
  for (sim::PeriodicError& error : machine.motor) {
    if (name == "motor-um") error.amplitude_mm = mm;
  }
  for (sim::PeriodicError& error : machine.pulley) {
    if (name == "pulley-um") error.amplitude_mm = mm;
  }
  if (name == "start-bulge-um") machine.start_bulge_mm = mm;
  if (name == "end-bulge-um") machine.end_bulge_mm = mm;
  if (name == "bead-height") machine.bead_height_mm = number;
  if (name == "filament-diameter") machine.filament_diameter_mm = number;
  for (sim::SheetTool& tool : machine.tools) {
    if (name == "broken-share") tool.broken_share = number;
    if (name == "string-share") tool.string_share = number;
    if (name == "width-factor") tool.width_factor = number;
    if (name == "opacity") tool.opacity = number;
    if (name == "missing-share") tool.missing_share = number;
  }
  if (name == "wrinkle-um") SetWrinkle(mm, paper);
  if (name == "dirt") paper.dirt_count = static_cast<int>(std::clamp(number, -1.0, 1e6));
  if (name == "hairs") paper.hair_count = static_cast<int>(std::clamp(number, -1.0, 1e6));
  if (name.starts_with("fold-")) SetFold(name, number, paper);
  if (name == "paper") paper.reflectance = {number, number, number};
  return {};
}

Result<void> SetScannerTrait(std::string_view text, sim::ScannerTraits& scanner) {
  const auto setting = TRY(Parse(text));
  constexpr double kDegree = 3.14159265358979323846 / 180;
  const std::pair<std::string_view, double*> fields[] = {{"shift-x-mm", &scanner.shift_x_mm},
                                                         {"shift-y-mm", &scanner.shift_y_mm},
                                                         {"scale-x", &scanner.scale_x},
                                                         {"scale-y", &scanner.scale_y},
                                                         {"skew", &scanner.skew},
                                                         {"shadow", &scanner.shadow_strength},
                                                         {"shadow-mm", &scanner.shadow_mm},
                                                         {"noise", &scanner.noise},
                                                         {"texture", &scanner.texture},
                                                         {"gamma", &scanner.gamma},
                                                         {"lamp-falloff", &scanner.lamp_falloff},
                                                         {"cast-red", &scanner.cast[0]},
                                                         {"cast-green", &scanner.cast[1]},
                                                         {"cast-blue", &scanner.cast[2]},
                                                         {"crop-top-mm", &scanner.crop_top_mm},
                                                         {"crop-left-mm", &scanner.crop_left_mm},
                                                         {"perspective-x", &scanner.perspective_x},
                                                         {"perspective-y", &scanner.perspective_y}};
  for (const auto& [name, field] : fields) {
    if (name == setting.name) *field = setting.number;
  }
  if (setting.name == "rotation-deg") scanner.rotation_rad = setting.number * kDegree;
  if (setting.name == "blur-um") scanner.blur_mm = setting.number / 1000;
  if (setting.name == "bar-um") {
    for (sim::PeriodicError& error : scanner.bar) error.amplitude_mm = setting.number / 1000;
  }
  return {};
}

}  // namespace trammel::app
