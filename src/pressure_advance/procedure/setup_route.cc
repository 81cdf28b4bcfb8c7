#include "pressure_advance/procedure/setup_route.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "files/new_file.h"
#include "machine/camera/camera.h"
#include "vision/frame_change.h"

namespace trammel::procedure {
namespace {

using pressure_advance::HeadPlace;

constexpr double kMove_s = 120;
constexpr double kFrame_s = 5;
constexpr int kFrames = 4;    // halves the sensor's noise
constexpr int kMaxTries = 8;  // for a picture with motion: on a busy computer it is late

Result<void> Keep(const machine::CapturedFrame& frame, const std::filesystem::path& stem) {
  const std::string_view bytes(reinterpret_cast<const char*>(frame.image.data()),
                               frame.image.size());
  const bool png = bytes.starts_with("\x89PNG");
  return files::WriteWholeFile(stem.string() + (png ? ".png" : ".jpg"), bytes,
                               files::IfThere::kRefuse);
}

}  // namespace

SetupReader::SetupReader(const Session& session, const OpenedCamera& reader,
                         const pressure_advance::PatternConfig& config,
                         const settings::ScanSettings& settings, const ClearHeights& clear,
                         const Reach& reach, std::filesystem::path folder)
    : session_(session),
      recorder_(*reader.recorder),
      config_(config),
      settings_(settings),
      clear_(clear),
      reach_(reach),
      folder_(std::move(folder)) {}

Result<void> SetupReader::Run(const std::string& gcode) {
  if (gcode.empty()) return {};
  TRY(RunNoted(session_, gcode, kMove_s));
  return session_.printer.FinishMoves(session_.Within(kMove_s));
}

// Repeated for each picture: the printer's own limit switches a forgotten laser off.
Result<void> SetupReader::Switch(SetupLight light) {
  if (light == SetupLight::kRoom) return LightRoom();
  TRY(Run(settings_.lights_off_gcode));
  return Run(settings_.laser_on_gcode);
}

Result<void> SetupReader::LightRoom() {
  TRY(Run(settings_.laser_off_gcode));
  return Run(settings_.lights_on_gcode);
}

// Returns the mean of stable frames; absent if there is motion between the first and the last.
Result<std::optional<Frame>> SetupReader::MeanPicture(const std::string& name) {
  vision::StillPicture picture;
  while (true) {
    const auto captured = TRY(recorder_.NextFrame(kFrame_s, session_.stop));
    const auto frame = TRY(machine::DecodeFrame(captured));
    const auto added = picture.Add(frame);
    if (added == vision::StillPicture::Added::kMoved) return std::nullopt;
    if (added == vision::StillPicture::Added::kOtherSize) {
      return Fail("the camera's pictures change their size", ErrorKind::kMachine);
    }
    if (picture.frames() < kFrames) continue;
    TRY(Keep(captured, folder_ / name));
    return picture.Mean();
  }
}

Result<Frame> SetupReader::Look(const HeadPlace& place, SetupLight light, const std::string& name) {
  TRY(CheckPlace(place, clear_, reach_));
  TRY(CheckStillFree(session_));
  TRY(KeepAlive(session_));
  TRY(Run(GcodeTo(place, config_)));
  TRY(Switch(light));
  if (!Pause(settings_.settle_s, session_.stop)) {
    return Fail("stopped while the camera was set up", ErrorKind::kInterrupted);
  }
  TRY(CheckStillHomed(session_));
  for (int i = 0; i < kMaxTries; ++i) {
    auto picture = TRY(MeanPicture(name));
    if (picture) return std::move(*picture);
  }
  return Fail(
      fmt::format("the picture still moves while the head has stood for more than {:.1f} s: the "
                  "camera is late or shakes; lengthen [scan] settle",
                  settings_.settle_s),
      ErrorKind::kMachine);
}

namespace {

using pressure_advance::MarkPlan;
using pressure_advance::MarkReading;
using settings::ScanSettings;

constexpr double kMinSweep_mm = 5;  // over which the stripe's width bends enough to be told
constexpr double kGreatestGrid_mm = 4.5;
constexpr int kGridSide = 4;
// Distance from the mark to the stripe on bare plate, along y: half a picture, half a mark, and the
// offset's possible error.
constexpr double kAway_mm = 15;
constexpr double kTowardsRunIn_mm = 12.5;

bool Within(double value_mm, double low_mm, double high_mm) {
  constexpr double kRounding_mm = 1e-6;
  return value_mm >= low_mm - kRounding_mm && value_mm <= high_mm + kRounding_mm;
}

bool Reaches(const Reach& reach, double x_mm, double y_mm) {
  constexpr double kInside_mm = kApproach_mm - 1e-6;  // less what rounding takes
  return reach.Contains(pressure_advance::BoundsMm{x_mm - kInside_mm, y_mm - kInside_mm,
                                                   x_mm + kInside_mm, y_mm + kInside_mm});
}

}  // namespace

Result<void> CheckClearHeights(const ClearHeights& clear, const ScanSettings& settings,
                               const Reach& reach) {
  if (!(clear.low_mm < clear.high_mm)) {
    return Fail(fmt::format("--clear-z {:.4g},{:.4g}: the lower height comes first", clear.low_mm,
                            clear.high_mm));
  }
  if (!Within(clear.low_mm, std::max(0.0, reach.minimum_mm[2]), reach.maximum_mm[2]) ||
      !Within(clear.high_mm, 0, reach.maximum_mm[2])) {
    return Fail(fmt::format("--clear-z {:.4g},{:.4g}: the nozzle goes from {:.2f} to {:.2f} mm on "
                            "this printer, and never below the plate: name heights within that",
                            clear.low_mm, clear.high_mm, std::max(0.0, reach.minimum_mm[2]),
                            reach.maximum_mm[2]),
                ErrorKind::kSafety);
  }
  const double focus_mm = settings.focus_height_mm;
  if (!Within(focus_mm, clear.low_mm, clear.high_mm)) {
    return Fail(
        fmt::format("--clear-z {:.4g},{:.4g}: leaves out [camera] focus_height, {:.2f} mm, "
                    "about which the focus is looked for: name heights on both sides of "
                    "it, or a better guess (--set focus_height=…)",
                    clear.low_mm, clear.high_mm, focus_mm));
  }
  const double swept_mm = clear.high_mm - clear.low_mm - 2 * kApproach_mm;
  if (swept_mm < kMinSweep_mm) {
    return Fail(fmt::format(
        "--clear-z {:.4g},{:.4g}: leaves {:.2f} mm to look for the focus in, "
        "{:.0f} mm are needed, and {:.2g} mm more at either end",
        clear.low_mm, clear.high_mm, std::max(0.0, swept_mm), kMinSweep_mm, kApproach_mm));
  }
  return {};
}

std::vector<HeadPlace> SweepHeights(const HeadPlace& at, double half_mm, double step_mm,
                                    const ClearHeights& clear) {
  std::vector<double> heights;
  const int steps = static_cast<int>(std::floor(half_mm / step_mm + 1e-9));
  for (int i = -steps; i <= steps; ++i) {
    const double z_mm = at.z_mm + i * step_mm;
    if (Within(z_mm, clear.low_mm + kApproach_mm, clear.high_mm - kApproach_mm)) {
      heights.push_back(z_mm);
    }
  }
  std::vector<HeadPlace> places;
  for (const int from_z : {1, -1}) {
    for (std::size_t i = 0; i < heights.size(); ++i) {
      HeadPlace place = at;
      place.z_mm = heights[from_z > 0 ? i : heights.size() - 1 - i];
      place.from_z = from_z;
      places.push_back(place);
    }
  }
  return places;
}

std::vector<HeadPlace> SearchPlaces(const HeadPlace& expected, double step_mm_x, double step_mm_y) {
  std::vector<std::pair<int, int>> steps;
  constexpr int kRings = 2;
  for (int i = -kRings; i <= kRings; ++i) {
    for (int j = -kRings; j <= kRings; ++j) steps.emplace_back(i, j);
  }
  std::ranges::stable_sort(steps, {}, [](const auto& s) {
    return std::pair{std::max(std::abs(s.first), std::abs(s.second)),
                     std::abs(s.first) + std::abs(s.second)};
  });
  std::vector<HeadPlace> places;
  for (const auto& [i, j] : steps) {
    HeadPlace place = expected;
    place.x_mm += i * step_mm_x;
    place.y_mm += j * step_mm_y;
    place.from_x = place.from_y = 1;
    places.push_back(place);
  }
  return places;
}

HeadPlace BringMark(const HeadPlace& from, const MarkReading& seen, double column_px, double row_px,
                    const MarkMotion& motion) {
  const double columns = column_px - seen.column_px, rows = row_px - seen.row_px;
  const double determinant = motion.determinant();
  HeadPlace place = from;
  place.x_mm += (columns * motion.row_per_y - rows * motion.column_per_y) / determinant;
  place.y_mm += (rows * motion.column_per_x - columns * motion.row_per_x) / determinant;
  return place;
}

double GridHalf_mm(const MarkReading& seen, const pressure_advance::MarkShape& shape,
                   const pressure_advance::PictureSize& picture) {
  constexpr double kClear_px = 10;  // from the picture's edge: the plate near the bead is read, too
  const double px_per_mm = seen.side_px / shape.side_mm;
  // A rotated square extends further along columns and rows, and so does the square of positions.
  const double spread = std::abs(std::cos(seen.turn_rad)) + std::abs(std::sin(seen.turn_rad));
  const double mark_px = 0.5 * (shape.side_mm + 3 * shape.bead_mm) * px_per_mm * spread;
  const double room_px = 0.5 * std::min(picture.width_px, picture.height_px) - mark_px - kClear_px;
  return std::min(kGreatestGrid_mm, room_px / (px_per_mm * spread));
}

std::vector<HeadPlace> GridPlaces(const HeadPlace& middle, double half_mm) {
  std::vector<HeadPlace> places;
  const double step_mm = 2 * half_mm / (kGridSide - 1);
  for (int i = 0; i < kGridSide; ++i) {
    for (int k = 0; k < kGridSide; ++k) {
      const int j = i % 2 == 0 ? k : kGridSide - 1 - k;
      HeadPlace place = middle;
      place.x_mm += i * step_mm - half_mm;
      place.y_mm += j * step_mm - half_mm;
      place.from_x = (i + j) % 2 == 0 ? 1 : -1;
      place.from_y = j / 2 == i / 2 ? 1 : -1;
      places.push_back(place);
    }
  }
  return places;
}

Result<HeadPlace> PlaceBesideMark(const MarkPlan& mark, const ScanSettings& settings,
                                  const Reach& reach) {
  const double away = mark.run_in_y_mm < mark.y_mm ? 1 : -1;
  HeadPlace place;
  place.x_mm = mark.x_mm - settings.camera_offset_x_mm;
  place.z_mm = settings.focus_height_mm;
  for (const double beside_mm : {away * kAway_mm, -away * kTowardsRunIn_mm}) {
    place.y_mm = mark.y_mm + beside_mm - settings.camera_offset_y_mm;
    if (Reaches(reach, place.x_mm, place.y_mm)) return place;
  }
  return Fail(fmt::format("to see bare plate beside the mark at ({:.1f}, {:.1f}) mm the nozzle "
                          "would have to go to ({:.1f}, {:.1f}) mm, and it reaches {}: print "
                          "the mark elsewhere (--mark-at X,Y), or correct [camera] offset_x and "
                          "offset_y",
                          mark.x_mm, mark.y_mm, place.x_mm, place.y_mm, reach.Describe()),
              ErrorKind::kSafety);
}

Result<void> CheckPlace(const HeadPlace& place, const ClearHeights& clear, const Reach& reach) {
  const double approach_mm = place.z_mm - place.from_z * kApproach_mm;
  if (!Within(place.z_mm, clear.low_mm, clear.high_mm) ||
      !Within(approach_mm, clear.low_mm, clear.high_mm)) {
    return Fail(
        fmt::format("the nozzle would have to go to Z = {:.2f} mm, which lies outside of "
                    "the heights that are clear, {:.2f} to {:.2f} mm: name more (--clear-z)",
                    place.z_mm, clear.low_mm, clear.high_mm),
        ErrorKind::kSafety);
  }
  if (Reaches(reach, place.x_mm, place.y_mm)) return {};
  return Fail(fmt::format("the nozzle would have to go to ({:.2f}, {:.2f}) mm, and {:.2g} mm to "
                          "either side of it; it reaches {}: print the mark elsewhere "
                          "(--mark-at X,Y)",
                          place.x_mm, place.y_mm, kApproach_mm, reach.Describe()),
              ErrorKind::kSafety);
}

std::string GcodeTo(const HeadPlace& place, const pressure_advance::PatternConfig& config) {
  const double z_speed = 60 * config.z_speed_mm_s, speed = 60 * config.travel_speed_mm_s;
  std::string gcode = "G90\n";
  if (place.from_z != 0) {
    gcode += fmt::format("G1 Z{:.3f} F{:.0f}\n", place.z_mm - place.from_z * kApproach_mm, z_speed);
  }
  gcode += fmt::format("G1 Z{:.3f} F{:.0f}\n", place.z_mm, z_speed);
  if (place.from_x != 0 || place.from_y != 0) {
    gcode += fmt::format("G1 X{:.3f} Y{:.3f} F{:.0f}\n", place.x_mm - place.from_x * kApproach_mm,
                         place.y_mm - place.from_y * kApproach_mm, speed);
  }
  return gcode + fmt::format("G1 X{:.3f} Y{:.3f} F{:.0f}", place.x_mm, place.y_mm, speed);
}

}  // namespace trammel::procedure
