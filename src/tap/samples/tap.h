// A tap: the nozzle is pressed onto the bed and pulled back while a load cell measures the force.
// What a method is given, and what every method returns.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "base/measured.h"

namespace trammel::tap {

/// A piece of motion along Z at constant acceleration, as Klipper's trapezoid queue holds it:
/// z(t) = start_z_mm + z_direction (start_velocity_mm_s dt + acceleration_mm_s2 dt^2 / 2).
struct Move {
  double start_time_s = 0;  ///< On the clock of the samples (Klipper: print time).
  double duration_s = 0;    ///< 0 for a halt.
  double start_velocity_mm_s = 0;
  double acceleration_mm_s2 = 0;
  double start_z_mm = 0;
  double z_direction = 0;  ///< -1 down, +1 up, 0 at rest.
};

/// A tap as recorded. Nothing is assumed of what it holds: samples may be missing, repeated or not
/// finite, moves absent. Both signs of force occur; methods find the sign of the press.
struct TapView {
  std::span<const double> time_s;   ///< As long as force_g, on one clock with the moves.
  std::span<const double> force_g;  ///< gf
  std::span<const Move> moves;      ///< In order of time.
};

enum class Method : std::uint8_t {
  kContact,  ///< One continuous model of force against z around the break (contact.h).
  kTwoLine,  ///< The decomposition into straight lines, as published (two_line.h).
};

/// "contact" or "two-line".
[[nodiscard]] std::string_view ToString(Method method);

/// Why a tap is refused, cannot be told, or deserves a word (finding.h lists and explains them).
enum class FindingCode : std::uint8_t;

/// A code with its figure and the limit that it was held against, both in the code's unit.
struct Finding {
  FindingCode code{};
  double figure = 0;
  double limit = 0;
};

/// What a corner of the force curve is, in the order of time.
enum class Corner : std::uint8_t {
  kApproachStart,
  kCollision,
  kPressEnd,
  kDwellEnd,
  kDecompressionSplit,  ///< Where two lines through a curved decompression cross.
  kBreak,
  kPullBackEnd,
};

struct Point {
  Corner corner{};
  double time_s = 0;
  double z_mm = 0;
  double force_g = 0;
};

/// Force around the break as fitted: a sloped baseline, and below break_z_mm a press that is added
/// to it. Only for drawing and checking; a method that fits none leaves `fitted` false.
struct FittedForce {
  bool fitted = false;
  double from_z_mm = 0;  ///< The stretch that was fitted.
  double to_z_mm = 0;
  double break_z_mm = 0;
  double baseline_g = 0;            ///< At the break.
  double baseline_slope_g_mm = 0;   ///<
  std::array<double, 4> press_g{};  ///< Force = sum of press_g[i] (depth / 1 mm)^(i + 1).
};

/// What one method says of one tap. Fixed in size, so that it costs no allocation.
struct TapAnalysis {
  static constexpr std::size_t kMaxPoints = 8;
  static constexpr std::size_t kMaxNotices = 16;

  Verdict verdict = Verdict::kRefused;
  Finding reason;  ///< Why, where the verdict is not good.
  Method method = Method::kContact;
  Quantity contact_mm;  ///< Height at which the nozzle lets go; NaN unless the verdict is good.
  double contact_time_s = 0;  ///< When it does, on the samples' clock; NaN likewise.
  double quality = 0;  ///< 0 … 100; below 40 is bad. Given for refused taps too, where it can be.
  double noise_g = 0;  ///< Standard deviation of one sample about the fit.
  double latency_s = 0;  ///< By which forces were taken to be read late: as stated, or estimated,
  double latency_uncertainty_s = 0;  ///< and its standard uncertainty.
  std::array<Point, kMaxPoints> points{};
  std::size_t point_count = 0;
  std::array<Finding, kMaxNotices> notices{};
  std::size_t notice_count = 0;
  FittedForce force;

  /// Adds a notice; one beyond kMaxNotices is dropped.
  void Notice(const Finding& finding) {
    if (notice_count < kMaxNotices) {
      notices[notice_count++] = finding;
    }
  }
  [[nodiscard]] std::span<const Point> Points() const { return {points.data(), point_count}; }
  [[nodiscard]] std::span<const Finding> Notices() const { return {notices.data(), notice_count}; }
};

}  // namespace trammel::tap
