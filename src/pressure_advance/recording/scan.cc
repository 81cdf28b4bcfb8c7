#include "pressure_advance/recording/scan.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace trammel::pressure_advance {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

struct Bounds {
  double lo;
  double hi;
  bool above_lo = false;  ///< lo itself is out of bounds
};

/// Records the first fault.
class Checker {
 public:
  void Number(const std::string& key, double value, const Bounds& bounds) {
    if (!std::isfinite(value) || value > bounds.hi || value < bounds.lo ||
        (bounds.above_lo && value == bounds.lo)) {
      AddFault(fmt::format("{} is {}; it must be {}{} … {}", key, value,
                           bounds.above_lo ? "above " : "", bounds.lo, bounds.hi));
    }
  }
  void AddFault(std::string fault) {
    if (fault_.empty()) {
      fault_ = std::move(fault);
    }
  }
  [[nodiscard]] Result<void> result() const {
    if (!fault_.empty()) {
      return Fail(fault_);
    }
    return {};
  }

 private:
  std::string fault_;
};

void CheckCrop(const std::string& key, const std::optional<PixelRect>& crop, Checker& check) {
  if (!crop) return;
  check.Number(key + ".x", crop->x, {0, 1e6});
  check.Number(key + ".y", crop->y, {0, 1e6});
  check.Number(key + ".width", crop->width, {8, 1e6});
  check.Number(key + ".height", crop->height, {8, 1e6});
}

void CheckMotion(const LineMotion& motion, Checker& check) {
  if (!motion.length_mm || !motion.acceleration_mm_s2) {
    check.AddFault("line_length_mm and acceleration_mm_s2 must be known in a scan");
    return;
  }
  check.Number("line_length_mm", *motion.length_mm, {0, 2000, true});
  check.Number("acceleration_mm_s2", *motion.acceleration_mm_s2, {0, 1e6, true});
  if (motion.segments.empty() || motion.segments.size() > 100) {
    check.AddFault(
        fmt::format("segments has {} entries; it must have 1 … 100", motion.segments.size()));
  }
  double sum = 0;
  for (std::size_t i = 0; i < motion.segments.size(); ++i) {
    const Segment& segment = motion.segments[i];
    check.Number(fmt::format("segments[{}].fraction", i), segment.fraction, {0, 1, true});
    check.Number(fmt::format("segments[{}].speed_mm_s", i), segment.speed_mm_s, {0, 2000, true});
    sum += segment.fraction;
  }
  // 1e-3: three fractions written as 0.333 are meant to sum to 1.
  if (!(std::abs(sum - 1) <= 1e-3 + 1e-12)) {
    check.AddFault(fmt::format("the fractions of segments sum to {}; they must sum to 1", sum));
  }
}

void CheckPositions(const ScanLine& line, const std::string& at, Checker& check) {
  const auto& positions = line.frame_positions_mm;
  if (positions.empty()) return;
  const auto& times = line.frame_times_s;
  if (!times.empty() && times.size() != positions.size()) {
    check.AddFault(
        fmt::format("{}frame_positions_mm has {} entries, frame_times_s {}; each has one per "
                    "frame",
                    at, positions.size(), times.size()));
  }
  std::vector<double> numbers;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!positions[i]) continue;
    const std::string key = fmt::format("{}frame_positions_mm[{}]", at, i);
    check.Number(key, *positions[i], {-2000, 2000});
    numbers.push_back(*positions[i]);
    if (numbers.size() < 2) continue;
    const double before = numbers[numbers.size() - 2];
    const bool rises = numbers[1] > numbers[0];
    if (!(rises ? numbers.back() > before : numbers.back() < before)) {
      check.AddFault(fmt::format("{} is {} after {}; the positions must all rise or all fall", key,
                                 numbers.back(), before));
    }
  }
  if (numbers.size() < 2) {
    check.AddFault(fmt::format("{}frame_positions_mm has {} number(s); it must have at least 2", at,
                               numbers.size()));
  }
}

void CheckLine(const ScanLine& line, std::size_t index, Checker& check) {
  const std::string at = fmt::format("lines[{}].", index);
  check.Number(at + "pattern", line.pattern, {0, 9999});
  check.Number(at + "pressure_advance_s", line.pressure_advance_s, {0, 10});
  if (line.video.empty()) {
    check.AddFault(at + "video is empty; it must name a file in the recording's folder");
  }
  const auto print = line.print_direction.value_or(AxisDirection::kPlusX);
  const auto sweep = line.sweep_direction.value_or(print);
  if (AlongX(print) != AlongX(sweep)) {
    check.AddFault(
        at + "sweep_direction is across print_direction; it must be the same or the opposite");
  }
  const auto& times = line.frame_times_s;
  for (std::size_t i = 0; i < times.size(); ++i) {
    check.Number(fmt::format("{}frame_times_s[{}]", at, i), times[i], {-1e12, 1e12});
    if (i > 0 && !(times[i] > times[i - 1])) {
      check.AddFault(fmt::format("{}frame_times_s[{}] is {} after {}; the times must increase", at,
                                 i, times[i], times[i - 1]));
    }
  }
  CheckPositions(line, at, check);
}

}  // namespace

std::optional<HeightScale> HeightScaleOf(const Scan& scan) {
  if (!scan.px_per_mm) return std::nullopt;
  HeightScale scale;
  scale.px_per_mm = *scan.px_per_mm;
  scale.height_mm_per_px = 1 / (*scan.px_per_mm * std::tan(scan.laser_angle_rad));
  if (scan.px_per_mm_sigma && scan.laser_angle_sigma_rad) {
    const double by_scale = *scan.px_per_mm_sigma / *scan.px_per_mm;
    const double by_angle = 2 * *scan.laser_angle_sigma_rad / std::sin(2 * scan.laser_angle_rad);
    scale.height_share = std::hypot(by_scale, by_angle);
    scale.area_share = std::hypot(2 * by_scale, by_angle);
  }
  return scale;
}

Result<void> Validate(const Scan& scan) {
  Checker check;
  if (scan.lines.empty() || scan.lines.size() > 1000) {
    check.AddFault(fmt::format("lines has {} entries; it must have 1 … 1000", scan.lines.size()));
  }
  check.Number("frames_per_s", scan.frames_per_s, {1, 1000});
  check.Number("scan_speed_mm_s", scan.scan_speed_mm_s, {0, 1000, true});
  if (scan.px_per_mm) {
    check.Number("px_per_mm", *scan.px_per_mm, {1, 10000});
  }
  if (scan.px_per_mm_sigma) check.Number("px_per_mm_sigma", *scan.px_per_mm_sigma, {0, 1000, true});
  if (scan.commanded_area_mm2) {
    check.Number("commanded_area_mm2", *scan.commanded_area_mm2, {0, 100, true});
  }
  // The bounds are in degrees; rounding of the conversion must not put 85 outside.
  const auto degrees = [](double angle_rad) { return std::round(angle_rad / kDegree * 1e9) / 1e9; };
  check.Number("laser_angle_deg", degrees(scan.laser_angle_rad), {5, 85});
  if (scan.laser_angle_sigma_rad) {
    check.Number("laser_angle_sigma_deg", degrees(*scan.laser_angle_sigma_rad), {0, 10, true});
  }
  CheckCrop("crop_px", scan.crop, check);
  CheckCrop("found_crop_px", scan.found_crop, check);
  CheckMotion(scan.motion, check);
  check.Number("line_start_mm", scan.line_start_mm, {0, scan.motion.length_mm.value_or(2000)});
  for (std::size_t i = 0; i < scan.lines.size(); ++i) {
    CheckLine(scan.lines[i], i, check);
  }
  return check.result();
}

}  // namespace trammel::pressure_advance
