#include "sim/camera/head_rig.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "files/new_file.h"

namespace trammel::sim {

namespace {

constexpr double kMiddleColumn = kSensorWidthPx / 2.0;
constexpr double kMiddleRow = kSensorHeightPx / 2.0;
constexpr double kReversalMm = 0.02;  // less is the noise of a move's interpolation
constexpr int kMarginPx = 3;          // for cubic interpolation

LaserTraits MountTraits(const LaserTraits& drawn, const HeadRig& rig) {
  LaserTraits traits = drawn;
  if (rig.scale != 1) {
    traits.px_per_mm *= rig.scale;
    traits.stripe_column_px = kMiddleColumn + (drawn.stripe_column_px - kMiddleColumn) * rig.scale;
    traits.line_row_px = kMiddleRow + (drawn.line_row_px - kMiddleRow) * rig.scale;
    traits.stripe_sigma_px *= rig.scale;
  }
  traits.laser_angle_rad += rig.laser_angle_rad;
  traits.stripe_tilt_rad += rig.laser_turn_rad;
  for (Sheen* sheen : {&traits.plate, &traits.filament}) {
    sheen->peak *= rig.laser_brightness;
    sheen->glow *= rig.laser_brightness;
    if (rig.scale != 1) {
      sheen->glow_sigma_px = std::clamp(sheen->glow_sigma_px * rig.scale, 4.0, 20.0);
      sheen->glow_shift_px *= rig.scale;
    }
    for (double& level : sheen->ambient_bgr) level *= rig.room_brightness;
  }
  return traits;
}

// Applies a backlash of b: a follower remains in place until it is b / 2 behind.
double Follow(double follower, double leader, double slack) {
  return std::clamp(follower, leader - slack / 2, leader + slack / 2);
}

}  // namespace

HeadOptics MountOptics(const HeadOptics& optics, const HeadRig& rig) {
  return {optics.condition, MountTraits(optics.dark, rig), MountTraits(optics.lit, rig)};
}

PictureMap::Place PictureMap::Upright(Place picture) const {
  const double u = picture.x_px - kMiddleColumn;
  const double v = picture.y_px - kMiddleRow;
  return {kMiddleColumn + xx * u + xy * v, kMiddleRow + yx * u + yy * v};
}

PictureMap::Place PictureMap::Picture(Place upright) const {
  const double u = upright.x_px - kMiddleColumn;
  const double v = upright.y_px - kMiddleRow;
  // Rotated and mirrored: the inverse is the transpose.
  return {kMiddleColumn + xx * u + yx * v, kMiddleRow + xy * u + yy * v};
}

PictureMap MapOf(const HeadRig& rig) {
  if (rig.camera_turn_rad == 0 && !rig.flip_x && !rig.flip_y) return {};
  const double c = std::cos(rig.camera_turn_rad);
  const double s = std::sin(rig.camera_turn_rad);
  const double along_u = rig.flip_x ? -1 : 1;
  const double along_v = rig.flip_y ? -1 : 1;
  return {c * along_u, s * along_v, -s * along_u, c * along_v};
}

SensorWindow UprightWindow(const PictureMap& map, const SensorWindow& picture) {
  double lo_x = 1e9;
  double lo_y = 1e9;
  double hi_x = -1e9;
  double hi_y = -1e9;
  for (const double x : {0, picture.width - 1}) {
    for (const double y : {0, picture.height - 1}) {
      const auto place = map.Upright({picture.x + x, picture.y + y});
      lo_x = std::min(lo_x, place.x_px);
      hi_x = std::max(hi_x, place.x_px);
      lo_y = std::min(lo_y, place.y_px);
      hi_y = std::max(hi_y, place.y_px);
    }
  }
  const int x = static_cast<int>(std::floor(lo_x)) - kMarginPx;
  const int y = static_cast<int>(std::floor(lo_y)) - kMarginPx;
  return {x, y, static_cast<int>(std::ceil(hi_x)) + kMarginPx + 1 - x,
          static_cast<int>(std::ceil(hi_y)) + kMarginPx + 1 - y};
}

void TurnPicture(const PictureMap& map, const SensorWindow& upright, const Frame& from,
                 const SensorWindow& picture, Frame& to) {
  if (to.width != picture.width || to.height != picture.height) {
    to = Frame(picture.width, picture.height);
  }
  const auto zero = map.Upright({static_cast<double>(picture.x), static_cast<double>(picture.y)});
  const cv::Matx23d matrix(map.xx, map.xy, zero.x_px - upright.x, map.yx, map.yy,
                           zero.y_px - upright.y);
  // cv::Mat has no view of constant pixels; the source is only read.
  const cv::Mat source(from.height, from.width, CV_8UC3,
                       const_cast<std::uint8_t*>(from.bgr.data()));
  cv::Mat target(to.height, to.width, CV_8UC3, to.bgr.data());
  cv::warpAffine(source, target, matrix, target.size(), cv::INTER_CUBIC | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  to.time_s = from.time_s;
}

RigMotion::RigMotion(const HeadRig& rig, const Random& random) : rig_(rig), random_(random) {}

bool RigMotion::Reverses(Axis& axis, double place_mm) {
  const double on = place_mm - axis.extreme_mm;
  if (axis.direction == 0) {
    if (std::abs(on) <= kReversalMm) return false;
    axis = {place_mm, on > 0 ? 1 : -1};
    return false;
  }
  if (on * axis.direction >= 0) {
    axis.extreme_mm = place_mm;
    return false;
  }
  if (std::abs(on) <= kReversalMm) return false;
  axis = {place_mm, -axis.direction};
  return true;
}

void RigMotion::Settle(MachineView& machine) {
  const std::array<double, 3> told = {machine.x_mm, machine.y_mm, machine.z_mm};
  if (!started_) {
    started_ = true;
    head_mm_ = told;
    for (std::size_t i = 0; i < 3; ++i) axes_[i].extreme_mm = told[i];
  }
  bool reverses = false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (rig_.backlash_mm[i] > 0) head_mm_[i] = Follow(head_mm_[i], told[i], rig_.backlash_mm[i]);
    reverses = Reverses(axes_[i], told[i]) || reverses;
  }
  if (rig_.backlash_mm[0] > 0) machine.x_mm = head_mm_[0];
  if (rig_.backlash_mm[1] > 0) machine.y_mm = head_mm_[1];
  if (rig_.backlash_mm[2] > 0) machine.z_mm = head_mm_[2];
  if (rig_.mount_backlash_mm <= 0) return;
  if (reverses) {
    const double radius = rig_.mount_backlash_mm * std::sqrt(random_.Uniform());
    const double angle = random_.Uniform(0, 2 * std::numbers::pi);
    shift_x_mm_ = radius * std::cos(angle);
    shift_y_mm_ = radius * std::sin(angle);
  }
  machine.x_mm += shift_x_mm_;
  machine.y_mm += shift_y_mm_;
}

std::shared_ptr<const Bed> RigMotion::Lay(const std::shared_ptr<const Bed>& bed) {
  if (bed == nullptr || (rig_.backlash_mm[0] <= 0 && rig_.backlash_mm[1] <= 0)) return bed;
  if (bed == told_) return laid_;
  auto laid = std::make_shared<Bed>(*bed);
  bool started = false;
  double x = 0;
  double y = 0;
  for (Strand& strand : laid->strands) {
    for (BeadSample& sample : strand.samples) {
      if (!started) {
        x = sample.x_mm;
        y = sample.y_mm;
        started = true;
      }
      x = Follow(x, sample.x_mm, rig_.backlash_mm[0]);
      y = Follow(y, sample.y_mm, rig_.backlash_mm[1]);
      sample.x_mm = x;
      sample.y_mm = y;
    }
  }
  told_ = bed;
  laid_ = std::move(laid);
  return laid_;
}

namespace {

constexpr double kDegree = std::numbers::pi / 180;

}  // namespace

MountedRig DrawHeadRig(Random random) {
  MountedRig drawn;
  drawn.mount.offset_x_mm += random.Uniform(-4, 4);
  drawn.mount.offset_y_mm += random.Uniform(-4, 4);
  drawn.mount.focus_height_mm += random.Uniform(-1, 1);
  drawn.rig.scale = random.Uniform(0.9, 1.1);
  drawn.rig.camera_turn_rad = random.Uniform(-3, 3) * kDegree;
  drawn.rig.laser_turn_rad = random.Uniform(-1, 1) * kDegree;
  drawn.rig.laser_angle_rad = random.Uniform(-3, 3) * kDegree;
  drawn.rig.laser_brightness = random.Uniform(0.8, 1.2);
  return drawn;
}

Result<void> WriteRigTruth(const std::filesystem::path& path, const MountedRig& rig,
                           const HeadOptics& optics, std::uint64_t seed) {
  const LaserTraits traits = MountOptics(optics, rig.rig).dark;
  const double offset_x_mm = rig.mount.offset_x_mm + traits.position_error_mm;
  const PictureMap map = MapOf(rig.rig);
  const auto spot = map.Picture({traits.stripe_column_px, traits.line_row_px});
  const double axis_x_mm =
      offset_x_mm - (traits.stripe_column_px - kSensorWidthPx / 2.0) / traits.px_per_mm;
  const double axis_y_mm =
      rig.mount.offset_y_mm + (traits.line_row_px - kSensorHeightPx / 2.0) / traits.px_per_mm;
  const nlohmann::ordered_json truth = {{"format", 1},
                                        {"seed", seed},
                                        {"offset_x_mm", offset_x_mm},
                                        {"offset_y_mm", rig.mount.offset_y_mm},
                                        {"focus_height_mm", rig.mount.focus_height_mm},
                                        {"axis_offset_x_mm", axis_x_mm},
                                        {"axis_offset_y_mm", axis_y_mm},
                                        {"px_per_mm", traits.px_per_mm},
                                        {"distance_mm", traits.distance_mm},
                                        {"spot_column_px", spot.x_px},
                                        {"spot_row_px", spot.y_px},
                                        {"camera_turn_deg", rig.rig.camera_turn_rad / kDegree},
                                        {"laser_turn_deg", traits.stripe_tilt_rad / kDegree},
                                        {"laser_angle_deg", traits.laser_angle_rad / kDegree},
                                        {"flip_x", rig.rig.flip_x},
                                        {"flip_y", rig.rig.flip_y},
                                        {"laser_brightness", rig.rig.laser_brightness},
                                        {"room_brightness", rig.rig.room_brightness},
                                        {"plate_peak", traits.plate.peak},
                                        {"filament_peak", traits.filament.peak},
                                        {"mount_play_mm", rig.rig.mount_backlash_mm},
                                        {"backlash_mm", rig.rig.backlash_mm}};
  return files::WriteWholeFile(
      path, truth.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n",
      files::IfThere::kRefuse);
}

}  // namespace trammel::sim
