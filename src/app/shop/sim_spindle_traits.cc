#include "app/shop/sim_spindle_traits.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>
#include <vector>

namespace trammel::app {
namespace {

std::vector<std::pair<std::string_view, double*>> Numbers(sim::SpindleSetup& setup,
                                                          sim::SpindlePicture& picture) {
  sim::SpindleMachine& machine = setup.machine;
  sim::SpindlePart& part = setup.part;
  sim::SpindleLight& light = picture.light;
  sim::SpindleEye& eye = picture.eye;
  return {{"sigma-px", &setup.sigma_px},
          {"repeatability-mm", &machine.repeatability_mm},
          {"scale-x", machine.scale.data()},
          {"scale-y", &machine.scale[1]},
          {"scale-z", &machine.scale[2]},
          {"square-xy-rad", &machine.square_xy_rad},
          {"square-xz-rad", &machine.square_xz_rad},
          {"square-yz-rad", &machine.square_yz_rad},
          {"angle-rad", &setup.spread.angle_rad},
          {"eccentricity-mm", &setup.spread.eccentricity_mm},
          {"tilt-rad", &setup.spread.tilt_rad},
          {"misplaced-mm", &part.misplaced_mm},
          {"misplaced-rad", &part.misplaced_rad},
          {"temperature-c", &part.temperature_c},
          {"expansion-per-k", &part.expansion_per_k},
          {"out-of-machine-mm", &part.out_of_machine_mm},
          {"out-of-machine-scale", &part.out_of_machine_scale},
          {"white", &light.white},
          {"dark", &light.dark},
          {"surface", &light.surface},
          {"hidden", &light.hidden},
          {"vignetting", &light.vignetting},
          {"gradient", &light.gradient},
          {"gradient-rad", &light.gradient_rad},
          {"blur-px", &eye.blur_px},
          {"motion-px", &eye.motion_px},
          {"motion-rad", &eye.motion_rad},
          {"read-noise", &eye.read_noise},
          {"shot-noise", &eye.shot_noise}};
}

}  // namespace

std::string SpindleTraitNames() {
  sim::SpindleSetup setup;
  sim::SpindlePicture picture;
  std::string names;
  for (const auto& [name, number] : Numbers(setup, picture)) {
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  return names;
}

Result<void> SetSpindleTrait(std::string_view text, sim::SpindleSetup& setup,
                             sim::SpindlePicture& picture) {
  const std::size_t equals = text.find('=');
  const std::string_view digits = equals == std::string_view::npos ? "" : text.substr(equals + 1);
  double value = 0;
  const auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (fault != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value)) {
    return Fail(fmt::format("--set {}: must be NAME=NUMBER", text.substr(0, 60)));
  }
  for (const auto& [name, number] : Numbers(setup, picture)) {
    if (name != text.substr(0, equals)) continue;
    *number = value;
    return {};
  }
  return Fail(fmt::format("--set {}: there is no such name; choose one of {}", text.substr(0, 60),
                          SpindleTraitNames()));
}

}  // namespace trammel::app
