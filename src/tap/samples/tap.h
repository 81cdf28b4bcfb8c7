// Tap: the nozzle is pressed onto the bed and pulled back while a load cell measures the force.
// Input and output of every method.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/measured.h"

namespace trammel::tap {

/// Piece of motion along Z at constant acceleration, as in Klipper's trapezoid queue: z(t) =
/// start_z_mm + z_direction (start_velocity_mm_s dt + acceleration_mm_s2 dt^2 / 2).
struct Move {
  double start_time_s = 0;  ///< clock of the samples (Klipper: print time)
  double duration_s = 0;    ///< 0 for a halt.
  double start_velocity_mm_s = 0;
  double acceleration_mm_s2 = 0;
  double start_z_mm = 0;
  double z_direction = 0;  ///< -1 down, +1 up, 0 at rest.
};

/// Recorded tap. Any content is possible: samples may be missing, repeated or not finite, moves
/// absent. Both signs of force occur; methods find the sign of the press.
struct TapView {
  std::span<const double> time_s;   ///< same length as force_g, same clock as moves
  std::span<const double> force_g;  ///< gf
  std::span<const Move> moves;      ///< sorted by time
};

enum class Method : std::uint8_t {
  kContact,  ///< One continuous model of force against z around the break (contact.h).
  kTwoLine,  ///< The decomposition into straight lines, as published (two_line.h).
};

/// "contact" or "two-line".
[[nodiscard]] std::string_view ToString(Method method);

/// Reasons to refuse a tap, to find no value, or to add a notice (finding.h has their texts).
enum class FindingCode : std::uint8_t;

/// Code with its figure and its limit, both in the code's unit.
struct Finding {
  FindingCode code{};
  double figure = 0;
  double limit = 0;
};

/// Corners of the force curve, in the order of time.
enum class Corner : std::uint8_t {
  kApproachStart,
  kCollision,
  kPressEnd,
  kDwellEnd,
  kDecompressionSplit,  ///< intersection of two lines through a curved decompression
  kBreak,
  kPullBackEnd,
};

struct Point {
  Corner corner{};
  double time_s = 0;
  double z_mm = 0;
  double force_g = 0;
};

/// Fitted force around the break: a sloped baseline, and below break_z_mm a press in addition. Only
/// for drawing and checks; false `fitted`: the method fits none.
struct FittedForce {
  bool fitted = false;
  double from_z_mm = 0;  ///< The stretch that was fitted.
  double to_z_mm = 0;
  double break_z_mm = 0;
  double baseline_g = 0;            ///< at the break
  double baseline_slope_g_mm = 0;   ///<
  std::array<double, 4> press_g{};  ///< Force = sum of press_g[i] (depth / 1 mm)^(i + 1).
};

/// Result of one method for one tap. Fixed in size, so that it costs no allocation.
struct TapAnalysis {
  static constexpr std::size_t kMaxPoints = 8;
  static constexpr std::size_t kMaxNotices = 16;

  Verdict verdict = Verdict::kRefused;
  Finding reason;  ///< if the verdict is not good
  Method method = Method::kContact;
  Quantity contact_mm;  ///< Height at which the nozzle lets go; NaN unless the verdict is good.
  double contact_time_s = 0;  ///< contact time, samples' clock; NaN likewise
  double quality = 0;  ///< 0 … 100; below 40 is bad. Given for refused taps too, where it can be.
  double noise_g = 0;  ///< Standard deviation of one sample about the fit.
  double latency_s = 0;              ///< assumed delay of the forces: as stated, or estimated,
  double latency_uncertainty_s = 0;  ///< and its standard uncertainty.
  std::array<Point, kMaxPoints> points{};
  std::size_t point_count = 0;
  std::array<Finding, kMaxNotices> notices{};
  std::size_t notice_count = 0;
  FittedForce force;

  /// Adds a notice; drops those beyond kMaxNotices.
  void Notice(const Finding& finding) {
    if (notice_count < kMaxNotices) {
      notices[notice_count++] = finding;
    }
  }
  [[nodiscard]] std::span<const Point> Points() const { return {points.data(), point_count}; }
  [[nodiscard]] std::span<const Finding> Notices() const { return {notices.data(), notice_count}; }
};

struct TapOptions {
  Method method = Method::kContact;
  /// Delay of a sample's time after its force acted; below 0 if a host dates samples too early. NaN
  /// if unknown: the contact method then estimates it from the approach, the two-line method takes
  /// 0.
  double latency_s = __builtin_nan("");
  double latency_uncertainty_s = 0;  ///< Standard uncertainty of a stated latency; >= 0.
  /// Nozzle temperature when tapped, degC; NaN if unknown. Hot plastic oozes.
  double nozzle_temperature_c = __builtin_nan("");
  /// Force at which the firmware stops the approach, gf; NaN if unknown. Checked only.
  double trigger_force_g = __builtin_nan("");
  /// Angle of a clean nozzle's decompression at 25 gf = 0.1 s, a factor of the published score; NaN
  /// omits it.
  double decompression_angle_rad = __builtin_nan("");
};

/// Data from a file or a printer. Only equal lengths are assumed.
struct Recording {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  std::string name;  ///< for users: the file and the tap's index
  std::vector<double> time_s;
  std::vector<double> force_g;  ///< same length as time_s; NaN for a missing value
  std::vector<double> z_mm;     ///< same length as time_s, or empty
  std::vector<Move> moves;
  double x_mm = kUnknown;  ///< on the bed
  double y_mm = kUnknown;
  double nozzle_temperature_c = kUnknown;
  std::optional<double> firmware_z_mm;  ///< printer's own result for the tap
  std::vector<std::string> notices;     ///< of the reader, for example: moves derived from z

  [[nodiscard]] TapView View() const { return {time_s, force_g, moves}; }
};

}  // namespace trammel::tap
