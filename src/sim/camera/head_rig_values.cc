// A head's values by name, drawn, and as truth.
#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>

#include "sim/camera/head_rig.h"

namespace trammel::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

struct RigField {
  const char* name;
  double least;
  double most;
  void (*set)(double value, MountedRig& rig);
};

constexpr RigField kFields[] = {
    {"offset-x-mm", -200, 200, [](double v, MountedRig& r) { r.mount.offset_x_mm = v; }},
    {"offset-y-mm", -200, 200, [](double v, MountedRig& r) { r.mount.offset_y_mm = v; }},
    {"focus-height-mm", 1, 100, [](double v, MountedRig& r) { r.mount.focus_height_mm = v; }},
    {"scale", 0.5, 2, [](double v, MountedRig& r) { r.rig.scale = v; }},
    {"camera-turn-deg", -180, 180,
     [](double v, MountedRig& r) { r.rig.camera_turn_rad = v * kDegree; }},
    {"laser-turn-deg", -2.5, 2.5,
     [](double v, MountedRig& r) { r.rig.laser_turn_rad = v * kDegree; }},
    {"laser-angle-deg", 25, 65,
     [](double v, MountedRig& r) {
       r.rig.laser_angle_rad = v * kDegree - LaserTraits{}.laser_angle_rad;
     }},
    {"laser-brightness", 0, 20, [](double v, MountedRig& r) { r.rig.laser_brightness = v; }},
    {"room-brightness", 0, 20, [](double v, MountedRig& r) { r.rig.room_brightness = v; }},
    {"flip-x", 0, 1, [](double v, MountedRig& r) { r.rig.flip_x = v >= 0.5; }},
    {"flip-y", 0, 1, [](double v, MountedRig& r) { r.rig.flip_y = v >= 0.5; }},
    {"mount-play-mm", 0, 2, [](double v, MountedRig& r) { r.rig.mount_play_mm = v; }},
    {"backlash-x-mm", 0, 2, [](double v, MountedRig& r) { r.rig.backlash_mm[0] = v; }},
    {"backlash-y-mm", 0, 2, [](double v, MountedRig& r) { r.rig.backlash_mm[1] = v; }},
    {"backlash-z-mm", 0, 2, [](double v, MountedRig& r) { r.rig.backlash_mm[2] = v; }},
};

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

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

std::string HeadRigNames() {
  std::string names;
  for (const RigField& field : kFields)
    names += (names.empty() ? "" : ", ") + std::string(field.name);
  return names;
}

Result<void> SetHeadRig(std::string_view name, double value, MountedRig& rig) {
  for (const RigField& field : kFields) {
    if (name != field.name) continue;
    if (!(value >= field.least && value <= field.most)) {
      return Fail(fmt::format("{} = {}: must be {} ... {}", name, value, field.least, field.most));
    }
    field.set(value, rig);
    return {};
  }
  return Fail(fmt::format("{}: must be one of {}", name.substr(0, 40), HeadRigNames()));
}

Result<void> WriteRigTruth(const std::filesystem::path& path, const MountedRig& rig,
                           const HeadEye& eye, std::uint64_t seed) {
  const LaserTraits traits = MountEye(eye, rig.rig).dark;
  const double offset_x_mm = rig.mount.offset_x_mm + traits.position_error_mm;
  const PictureMap map = MapOf(rig.rig);
  const auto spot = map.Picture({traits.stripe_column_px, traits.line_row_px});
  const double axis_x_mm =
      offset_x_mm - (traits.stripe_column_px - kSensorWidthPx / 2.0) / traits.px_per_mm;
  const double axis_y_mm =
      rig.mount.offset_y_mm + (traits.line_row_px - kSensorHeightPx / 2.0) / traits.px_per_mm;
  const std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "wxe"));
  if (!file) {
    return Fail(
        fmt::format("{}: the head's truth cannot be written there: {}; choose a new file "
                    "in a folder that is there",
                    path.string(), std::strerror(errno)));
  }
  std::string text = fmt::format(
      "{{\"format\": 1, \"seed\": {},\n \"offset_x_mm\": {:.5f}, \"offset_y_mm\": {:.5f}, "
      "\"focus_height_mm\": {:.5f},\n \"axis_offset_x_mm\": {:.5f}, \"axis_offset_y_mm\": "
      "{:.5f},\n \"px_per_mm\": {:.5f}, \"distance_mm\": {:.5f},\n \"spot_column_px\": {:.4f}, "
      "\"spot_row_px\": {:.4f},\n",
      seed, offset_x_mm, rig.mount.offset_y_mm, rig.mount.focus_height_mm, axis_x_mm, axis_y_mm,
      traits.px_per_mm, traits.distance_mm, spot.x_px, spot.y_px);
  text += fmt::format(
      " \"camera_turn_deg\": {:.5f}, \"laser_turn_deg\": {:.5f}, \"laser_angle_deg\": {:.5f},\n "
      "\"flip_x\": {}, \"flip_y\": {}, \"laser_brightness\": {:.4f}, \"room_brightness\": "
      "{:.4f},\n \"plate_peak\": {:.4f}, \"filament_peak\": {:.4f}, \"mount_play_mm\": {:.4f}, "
      "\"backlash_mm\": [{:.4f}, {:.4f}, {:.4f}]}}\n",
      rig.rig.camera_turn_rad / kDegree, traits.stripe_tilt_rad / kDegree,
      traits.laser_angle_rad / kDegree, rig.rig.flip_x, rig.rig.flip_y, rig.rig.laser_brightness,
      rig.rig.room_brightness, traits.plate.peak, traits.filament.peak, rig.rig.mount_play_mm,
      rig.rig.backlash_mm[0], rig.rig.backlash_mm[1], rig.rig.backlash_mm[2]);
  if (std::fwrite(text.data(), 1, text.size(), file.get()) != text.size()) {
    return Fail(
        fmt::format("{}: the head's truth was not written whole: {}; make room and start "
                    "again with a new file",
                    path.string(), std::strerror(errno)));
  }
  return {};
}

}  // namespace trammel::sim
