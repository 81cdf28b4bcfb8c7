#include "sim/photo/photo_traits.h"

#include <fmt/format.h>

#include <numbers>
#include <string>

namespace trammel::sim {
namespace {

constexpr std::array kScenes = {PhotoScene::kNaturalOnGold, PhotoScene::kNaturalOnDark,
                                PhotoScene::kBlackOnLight};

}  // namespace

std::string_view ToString(PhotoScene scene) {
  switch (scene) {
    case PhotoScene::kNaturalOnGold:
      return "natural-on-gold";
    case PhotoScene::kNaturalOnDark:
      return "natural-on-dark";
    case PhotoScene::kBlackOnLight:
      return "black-on-light";
  }
  return "natural-on-gold";
}

Result<PhotoScene> ParsePhotoScene(std::string_view name) {
  std::string known;
  for (const PhotoScene scene : kScenes) {
    if (ToString(scene) == name) return scene;
    known += (known.empty() ? "" : ", ") + std::string(ToString(scene));
  }
  return Fail(
      fmt::format("there is no photo scene \"{}\"; choose one of {}", name.substr(0, 60), known));
}

PhotoTraits DrawPhotoTraits(PhotoScene scene, Random& random) {
  constexpr double kDegree = std::numbers::pi / 180;
  PhotoTraits traits;
  traits.scene = scene;
  traits.fill = random.Uniform(0.62, 0.82);
  traits.tilt_rad = random.Uniform(2, 18) * kDegree;
  traits.tilt_towards_rad = random.Uniform(-180, 180) * kDegree;
  traits.roll_rad = random.Uniform(-6, 6) * kDegree;
  traits.offset_x = random.Uniform(-0.03, 0.03);
  traits.offset_y = random.Uniform(-0.04, 0.04);
  traits.focal_heights = random.Uniform(0.75, 1.1);
  traits.distortion = random.Uniform(-0.05, 0.03);
  traits.light_azimuth_rad = random.Uniform(30, 150) * kDegree;
  traits.light_elevation_rad = random.Uniform(30, 60) * kDegree;
  traits.unevenness = random.Uniform(0.2, 0.5);
  traits.unevenness_azimuth_rad = random.Uniform(-180, 180) * kDegree;
  traits.vignetting = random.Uniform(0.1, 0.4);
  traits.exposure = random.Uniform(0.9, 1.15);
  const bool light_plate = scene == PhotoScene::kBlackOnLight;
  // The camera's own lamps: a bright patch of glints, and a faint coloured one.
  traits.reflections.push_back({random.Uniform(-0.15, 0.15),
                                random.Uniform(-0.50, -0.30),
                                random.Uniform(0.12, 0.22),
                                random.Uniform(0.02, 0.10),
                                light_plate ? 0.1 : random.Uniform(0.5, 0.9),
                                {0.95, 1, 0.95}});
  if (!light_plate) {
    traits.reflections.push_back({random.Uniform(-0.08, 0.08),
                                  random.Uniform(-0.18, 0.05),
                                  random.Uniform(0.05, 0.08),
                                  random.Uniform(0.05, 0.30),
                                  random.Uniform(0.1, 0.3),
                                  {0.12, 0.06, 1}});
  }
  traits.blur_sigma_px = random.Uniform(0.7, 1.3);
  traits.sharpening = random.Uniform(0.3, 0.9);
  traits.noise = random.Uniform(1.5, 4);
  traits.jpeg_quality = 84 + static_cast<int>(random.Below(12));
  return traits;
}

}  // namespace trammel::sim
