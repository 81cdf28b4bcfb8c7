// A tap: the nozzle is pressed onto the bed and pulled back while a load cell measures the force.
// What a method is given, and what every method returns.
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

struct TapOptions {
  Method method = Method::kContact;
  /// By which a sample's time is after its force acted; below 0 where a host dates samples too
  /// early. NaN where it is not known: the contact method then estimates it from the approach, the
  /// two-line method takes 0.
  double latency_s = __builtin_nan("");
  double latency_uncertainty_s = 0;  ///< Standard uncertainty of a stated latency; >= 0.
  /// Of the nozzle when tapped, degC; NaN where it is not known. Hot plastic oozes.
  double nozzle_temperature_c = __builtin_nan("");
  /// At which the firmware stops the approach, gf; NaN where it is not known. Checked only.
  double trigger_force_g = __builtin_nan("");
  /// Of the decompression of a clean nozzle at 25 gf = 0.1 s, a factor of the published score; NaN
  /// leaves it out.
  double decompression_angle_rad = __builtin_nan("");
};

/// What a file or a printer gave. Nothing is assumed of it but equal lengths.
struct Recording {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

  std::string name;  ///< For people: the file, and which of its taps.
  std::vector<double> time_s;
  std::vector<double> force_g;  ///< As long as time_s; NaN where a sample has no number.
  std::vector<double> z_mm;     ///< As long as time_s, or empty.
  std::vector<Move> moves;
  double x_mm = kUnknown;  ///< Where on the bed.
  double y_mm = kUnknown;
  double nozzle_temperature_c = kUnknown;
  std::optional<double> firmware_z_mm;  ///< What the printer made of the tap itself.
  std::vector<std::string> notices;     ///< Of the reader, as that moves come from z.

  [[nodiscard]] TapView View() const { return {time_s, force_g, moves}; }
};

}  // namespace trammel::tap
