#include "setup_scene.h"

#include <cmath>
#include <numbers>

#include "sim/camera/camera_view.h"
#include "sim/print/printer.h"

namespace trammel::test {

constexpr double kDegree = std::numbers::pi / 180;

ShopOptions SetupHall(std::uint64_t seed, const sim::MountedRig& rig,
                      const sim::Condition& condition) {
  ShopOptions options;
  options.seed = seed;
  options.camera.condition = condition;
  options.camera.view.frame_width_px = 1280;
  options.camera.view.frame_height_px = 720;
  options.camera.frames_per_s = 20;
  options.camera.view.mount = rig.mount;
  options.camera.view.rig = rig.rig;
  return options;
}

SetupTruth TruthOf(std::uint64_t seed, const sim::MountedRig& rig,
                   const sim::Condition& condition) {
  const sim::HeadOptics drawn = sim::DrawHeadOptics(condition, sim::LaserRandom(seed, condition));
  const sim::LaserTraits traits = sim::MountOptics(drawn, rig.rig).dark;
  const auto spot = sim::MapOf(rig.rig).Picture({traits.stripe_column_px, traits.line_row_px});
  SetupTruth truth;
  truth.offset_x_mm = rig.mount.offset_x_mm + traits.position_error_mm;
  truth.offset_y_mm = rig.mount.offset_y_mm;
  truth.spot_column_px = spot.x_px;
  truth.spot_row_px = spot.y_px;
  truth.focus_height_mm = rig.mount.focus_height_mm;
  truth.px_per_mm = traits.px_per_mm;
  truth.distance_mm = traits.distance_mm;
  truth.rotation_deg = rig.rig.camera_turn_rad / kDegree;
  truth.laser_turn_deg = traits.stripe_tilt_rad / kDegree;
  truth.laser_sheet_deg = traits.laser_angle_rad / kDegree;
  return truth;
}

std::vector<std::string> SetupArguments(const MachineShop& shop,
                                        const std::vector<std::string>& more) {
  std::vector<std::string> words = {"pa",        "setup", "--printer", shop.address(),
                                    "--clear-z", "11,25", "--out",     "set"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::vector<SetupError> SetupErrors(const nlohmann::json& answer, const SetupTruth& truth) {
  // Offset from the nominal spot to the measured one, on the plate.
  const double right =
      (answer["spot_px"][0].get<double>() - truth.spot_column_px) / truth.px_per_mm;
  const double up = -(answer["spot_px"][1].get<double>() - truth.spot_row_px) / truth.px_per_mm;
  const double c = std::cos(truth.rotation_deg * kDegree);
  const double s = std::sin(truth.rotation_deg * kDegree);
  const double rise_mm = answer["seen_at_height_mm"].get<double>() - truth.focus_height_mm;
  const double px_per_mm = truth.px_per_mm * truth.distance_mm / (truth.distance_mm + rise_mm);
  const auto compare = [&](const char* key, double true_value, double scale = 1) {
    const auto& value = answer["values"][key];
    SetupError error;
    error.name = key;
    error.error = (value["value"].get<double>() - true_value) * scale;
    error.standard_uncertainty = value["standard_uncertainty"].get<double>() * scale;
    error.covered = value["interval95"][0].get<double>() <= true_value &&
                    true_value <= value["interval95"][1].get<double>();
    return error;
  };
  return {compare("offset_x_mm", truth.offset_x_mm + right * c - up * s),
          compare("offset_y_mm", truth.offset_y_mm + right * s + up * c),
          compare("focus_height_mm", truth.focus_height_mm),
          compare("px_per_mm", px_per_mm, 1 / px_per_mm),
          compare("rotation_deg", truth.rotation_deg),
          compare("laser_turn_deg", truth.laser_turn_deg),
          compare("laser_sheet_deg", truth.laser_sheet_deg)};
}

}  // namespace trammel::test
