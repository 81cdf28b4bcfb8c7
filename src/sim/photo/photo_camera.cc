#include "sim/photo/photo_camera.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <string>

#include "sim/print/named_number.h"

namespace trammel::sim {

namespace {

constexpr NamedChoice<PhotoScene> kScenes[] = {{"natural-on-gold", PhotoScene::kNaturalOnGold},
                                               {"natural-on-dark", PhotoScene::kNaturalOnDark},
                                               {"black-on-light", PhotoScene::kBlackOnLight}};

}  // namespace

Result<PhotoScene> ParsePhotoScene(std::string_view name) {
  return ChoiceOf(kScenes, "photo scene", name);
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
