#include "sim/photo/photo_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iterator>
#include <numbers>
#include <string>

namespace trammel::sim {

namespace {

constexpr NamedChoice<PhotoFilament> kFilaments[] = {
    {"natural", PhotoFilament::kNatural}, {"black", PhotoFilament::kBlack},
    {"white", PhotoFilament::kWhite},     {"orange", PhotoFilament::kOrange},
    {"blue", PhotoFilament::kBlue},       {"grey", PhotoFilament::kGrey}};
constexpr NamedChoice<PhotoPlate> kPlates[] = {
    {"gold", PhotoPlate::kGold},   {"dark", PhotoPlate::kDark},
    {"light", PhotoPlate::kLight}, {"smooth-gold", PhotoPlate::kSmoothGold},
    {"glass", PhotoPlate::kGlass}, {"magnetic", PhotoPlate::kMagnetic}};
constexpr std::string_view kMatte = "matte-";
constexpr std::string_view kOn = "-on-";

template <class Value, std::size_t count>
std::string NameOf(const NamedChoice<Value> (&table)[count], Value value) {
  for (const auto& entry : table) {
    if (entry.value == value) return std::string(entry.name);
  }
  return "";
}

}  // namespace

Result<PhotoScene> ParsePhotoScene(std::string_view name) {
  PhotoScene scene;
  std::string_view rest = name;
  if (rest.substr(0, kMatte.size()) == kMatte) {
    scene.matte = true;
    rest.remove_prefix(kMatte.size());
  }
  const std::size_t on = rest.find(kOn);
  if (on == std::string_view::npos) {
    return Fail(
        fmt::format("there is no photo scene \"{}\"; it must be FILAMENT-on-PLATE, for "
                    "example natural-on-gold or matte-white-on-magnetic",
                    name.substr(0, 60)));
  }
  scene.filament = TRY(ChoiceOf(kFilaments, "filament", rest.substr(0, on)));
  scene.plate = TRY(ChoiceOf(kPlates, "plate", rest.substr(on + kOn.size())));
  return scene;
}

std::string ToString(const PhotoScene& scene) {
  return std::string(scene.matte ? kMatte : "") + NameOf(kFilaments, scene.filament) +
         std::string(kOn) + NameOf(kPlates, scene.plate);
}

void ReachIn(double depth, PhotoTraits& traits) {
  constexpr double kFingerPitch = 0.09;
  traits.fingers.clear();
  if (depth <= 0) return;
  const double edge = -0.5 * traits.width_px / traits.height_px;
  for (int finger = -1; finger <= 1; ++finger) {
    traits.fingers.push_back(
        {edge + depth, kFingerPitch * finger, std::numbers::pi, depth + 0.1, 0.042});
  }
}

PhotoTraits DrawPhotoTraits(const PhotoScene& scene, Random& random) {
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
  const bool light_plate = scene.plate == PhotoPlate::kLight;
  // Camera's own lamps: a bright patch of glints, and a faint coloured one.
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

PhotoScene DrawPhotoScene(Random& random) {
  // Pairs whose brightness or colour differs; black on black and the like are for a refusal's test.
  static constexpr PhotoScene kSeen[] = {{PhotoFilament::kNatural, PhotoPlate::kGold},
                                         {PhotoFilament::kNatural, PhotoPlate::kDark},
                                         {PhotoFilament::kNatural, PhotoPlate::kMagnetic},
                                         {PhotoFilament::kWhite, PhotoPlate::kGold},
                                         {PhotoFilament::kWhite, PhotoPlate::kDark},
                                         {PhotoFilament::kWhite, PhotoPlate::kMagnetic},
                                         {PhotoFilament::kWhite, PhotoPlate::kGlass},
                                         {PhotoFilament::kBlack, PhotoPlate::kGold},
                                         {PhotoFilament::kBlack, PhotoPlate::kSmoothGold},
                                         {PhotoFilament::kBlack, PhotoPlate::kLight},
                                         {PhotoFilament::kBlack, PhotoPlate::kGlass},
                                         {PhotoFilament::kOrange, PhotoPlate::kDark},
                                         {PhotoFilament::kOrange, PhotoPlate::kMagnetic},
                                         {PhotoFilament::kOrange, PhotoPlate::kGlass},
                                         {PhotoFilament::kBlue, PhotoPlate::kGold},
                                         {PhotoFilament::kBlue, PhotoPlate::kSmoothGold},
                                         {PhotoFilament::kBlue, PhotoPlate::kLight},
                                         {PhotoFilament::kGrey, PhotoPlate::kMagnetic},
                                         {PhotoFilament::kGrey, PhotoPlate::kLight}};
  PhotoScene scene = kSeen[random.Below(std::size(kSeen))];
  scene.matte = random.Uniform() < 0.4;
  return scene;
}

PhotoTraits DrawPhonePhoto(const PhotoScene& scene, int width_px, int height_px,
                           const PhotoDistortion& distortion, Random& random) {
  constexpr double kDegree = std::numbers::pi / 180;
  PhotoTraits traits;
  traits.scene = scene;
  traits.width_px = width_px;
  traits.height_px = height_px;
  const bool cropped = random.Uniform() < distortion.crop_odds;
  traits.fill = cropped ? random.Uniform(1.0, 1.15) : random.Uniform(0.7, 0.92);
  const double play = cropped ? 0.06 : (1 - traits.fill) / 2.5;
  traits.offset_x = random.Uniform(-play, play);
  traits.offset_y = random.Uniform(-play, play);
  traits.tilt_rad = random.Uniform(0, distortion.most_tilt_rad);
  traits.tilt_towards_rad = random.Uniform(-180, 180) * kDegree;
  traits.roll_rad = random.Uniform(-distortion.most_roll_rad, distortion.most_roll_rad);
  // A phone's main camera sees 65 to 75 degrees over the diagonal; at "2x" half of that.
  const double diagonal = std::hypot(width_px, height_px) / height_px;
  traits.focal_heights = diagonal * random.Uniform(0.65, 1.3);
  traits.distortion = random.Uniform(-0.03, 0.02);
  traits.light_azimuth_rad = random.Uniform(-180, 180) * kDegree;
  traits.light_elevation_rad = random.Uniform(35, 75) * kDegree;
  traits.unevenness = random.Uniform(0, 0.4);
  traits.unevenness_azimuth_rad = random.Uniform(-180, 180) * kDegree;
  traits.vignetting = random.Uniform(0, 0.3);
  traits.exposure = random.Uniform(0.85, 1.2);
  const auto lamps = static_cast<int>(random.Below(3));
  for (int i = 0; i < lamps; ++i) {
    const double warm = random.Uniform(0.6, 1);
    traits.reflections.push_back({random.Uniform(-0.6, 0.6),
                                  random.Uniform(-0.5, 0.5),
                                  random.Uniform(0.08, 0.3),
                                  random.Uniform(0.02, 0.25),
                                  random.Uniform(0.05, 0.6),
                                  {warm, 0.5 + warm / 2, 1}});
  }
  if (random.Uniform() < distortion.shadow_odds) {
    traits.shadow = random.Uniform(0.15, 0.5);
    traits.shadow_offset = random.Uniform(-0.3, 0.4);
    traits.shadow_azimuth_rad = random.Uniform(-180, 180) * kDegree;
    traits.shadow_softness = random.Uniform(0.01, 0.2);
  }
  if (random.Uniform() < distortion.hand_odds) {
    // Fingers reach in from one side, side by side, as far as the print's edge or a little over it.
    const double side = random.Uniform() < 0.5 ? -1 : 1;
    const double wide = static_cast<double>(width_px) / height_px;
    const double base_y = random.Uniform(-0.35, 0.35);
    for (int finger = 0; finger < 3; ++finger) {
      traits.fingers.push_back({side * (wide / 2 - random.Uniform(0.06, 0.16)),
                                base_y + 0.09 * (finger - 1),
                                (side < 0 ? std::numbers::pi : 0) + random.Uniform(-0.2, 0.2), 0.6,
                                random.Uniform(0.035, 0.045)});
    }
  }
  const double scale = distortion.sharpness;
  traits.blur_sigma_px = scale * random.Uniform(0.5, 1.4);
  traits.sharpening = random.Uniform(0, 0.9);
  traits.noise = scale * random.Uniform(1, 4);
  traits.jpeg_quality = 80 + static_cast<int>(random.Below(16));
  traits.mirrored = random.Uniform() < distortion.mirror_odds;
  return traits;
}

namespace {

Vector3 Cross(const Vector3& a, const Vector3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

double Dot(const Vector3& a, const Vector3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Vector3 Combine(const Vector3& a, double s, const Vector3& b, double t) {
  return {s * a.x + t * b.x, s * a.y + t * b.y, s * a.z + t * b.z};
}

Vector3 Normalised(const Vector3& a) {
  const double length = std::sqrt(Dot(a, a));
  return {a.x / length, a.y / length, a.z / length};
}

}  // namespace

PhotoCamera::PhotoCamera(const PhotoTraits& traits, const BedRegion& subject)
    : focal_px_(traits.focal_heights * traits.height_px), distortion_(traits.distortion) {
  axis_x_px_ = (traits.width_px - 1) / 2.0;
  axis_y_px_ = (traits.height_px - 1) / 2.0;
  centre_x_px_ = axis_x_px_ + traits.offset_x * traits.height_px;
  centre_y_px_ = axis_y_px_ + traits.offset_y * traits.height_px;

  const Vector3 away{std::sin(traits.tilt_rad) * std::cos(traits.tilt_towards_rad),
                     std::sin(traits.tilt_rad) * std::sin(traits.tilt_towards_rad),
                     std::cos(traits.tilt_rad)};
  forward_ = {-away.x, -away.y, -away.z};
  // Bed +x points right in the picture, apart from the roll.
  const Vector3 level = Normalised(Cross({0, 1, 0}, away));
  const Vector3 up = Cross(away, level);
  const double c = std::cos(traits.roll_rad);
  const double s = std::sin(traits.roll_rad);
  right_ = Combine(level, c, up, -s);
  down_ = Combine(level, -s, up, -c);

  const Vector3 middle{(subject.min_x_mm + subject.max_x_mm) / 2,
                       (subject.min_y_mm + subject.max_y_mm) / 2, 0};
  // The extent in the picture falls with the distance; bisection avoids a formula for the tilt.
  double near = 1;
  double far = 1e5;
  for (int i = 0; i < 80; ++i) {
    const double distance = std::sqrt(near * far);
    position_ = Combine(middle, 1, away, distance);
    double share = 0;
    bool behind = false;
    for (const double x : {subject.min_x_mm, subject.max_x_mm}) {
      for (const double y : {subject.min_y_mm, subject.max_y_mm}) {
        const Vector3 corner{x, y, 0};
        behind |= Dot(Combine(corner, 1, position_, -1), forward_) <= 0;
        const ImagePoint seen = ProjectStraight(corner);
        share = std::max({share, 2 * std::abs(seen.x_px - centre_x_px_) / traits.width_px,
                          2 * std::abs(seen.y_px - centre_y_px_) / traits.height_px});
      }
    }
    (behind || share > traits.fill ? near : far) = distance;
  }
}

ImagePoint PhotoCamera::ProjectStraight(const Vector3& point) const {
  const Vector3 from = Combine(point, 1, position_, -1);
  const double depth = Dot(from, forward_);
  return {centre_x_px_ + focal_px_ * Dot(from, right_) / depth,
          centre_y_px_ + focal_px_ * Dot(from, down_) / depth};
}

Vector3 PhotoCamera::Ray(double x_px, double y_px) const {
  const double x = (x_px - axis_x_px_) / focal_px_;
  const double y = (y_px - axis_y_px_) / focal_px_;
  const double stretch = 1 + distortion_ * (x * x + y * y);
  const double straight_x = x * stretch + (axis_x_px_ - centre_x_px_) / focal_px_;
  const double straight_y = y * stretch + (axis_y_px_ - centre_y_px_) / focal_px_;
  Vector3 ray = Combine(forward_, 1, Combine(right_, straight_x, down_, straight_y), 1);
  const double fall = std::max(-ray.z, 0.02);
  return {ray.x / fall, ray.y / fall, -1};
}

ImagePoint PhotoCamera::Project(const Vector3& point) const {
  const ImagePoint straight = ProjectStraight(point);
  const double x = (straight.x_px - axis_x_px_) / focal_px_;
  const double y = (straight.y_px - axis_y_px_) / focal_px_;
  double stretch = 1;
  for (int i = 0; i < 50; ++i) {
    stretch = 1 + distortion_ * (x * x + y * y) / (stretch * stretch);
  }
  return {axis_x_px_ + focal_px_ * x / stretch, axis_y_px_ + focal_px_ * y / stretch};
}

}  // namespace trammel::sim
