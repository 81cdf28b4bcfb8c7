#include "tool_offset/sheet/sheet_pitch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "base/check.h"

namespace trammel::tool_offset {
namespace {

constexpr std::array<double, 6> kPeriods_mm{2, 0.8, 0.64, 0.4, 0.32, 0.2};

/// Of one motor: how far it moves per mm along the measured direction, and how far the measured
/// point moves per mm of the motor.
struct Motor {
  double travel = 0;
  double share = 0;
};

std::array<Motor, 4> Motors(double tilt_deg) {
  const double tilt_rad = std::abs(tilt_deg) * std::numbers::pi / 180;
  const double x = std::cos(tilt_rad);
  const double y = std::sin(tilt_rad);
  // CoreXY: each belt moves by x ± y, and half of its error goes into either axis.
  return {{{x, x}, {y, y}, {x + y, (x + y) / 2}, {std::abs(x - y), std::abs(x - y) / 2}}};
}

/// How far apart a motor's error puts the means of both combs, per amplitude.
double CombDifference(double step_cycles, int teeth) {
  using std::numbers::pi;
  std::complex<double> sum = 0;
  for (int tooth = 0; tooth < teeth; ++tooth) sum += std::polar(1.0, 2 * pi * tooth * step_cycles);
  return std::abs(sum) / teeth * std::abs(1.0 - std::polar(1.0, pi * step_cycles));
}

}  // namespace

double MotorErrorShare(double pitch_mm, int teeth, double tilt_deg) {
  TRAMMEL_CHECK(teeth > 0, "teeth = {}", teeth);
  double worst = 0;
  for (const Motor& motor : Motors(tilt_deg)) {
    for (const double period_mm : kPeriods_mm) {
      worst =
          std::max(worst, motor.share * CombDifference(pitch_mm * motor.travel / period_mm, teeth));
    }
  }
  return worst;
}

double NearestGoodPitch_mm(double pitch_mm, int teeth, double tilt_deg) {
  constexpr int kSteps = 100;
  const long long nearest = std::llround(pitch_mm * 100);
  double best_mm = pitch_mm;
  double best_share = MotorErrorShare(pitch_mm, teeth, tilt_deg);
  for (int step = 0; step <= kSteps && best_share >= kGoodMotorErrorShare; ++step) {
    for (const int sign : {1, -1}) {
      const double candidate_mm = static_cast<double>(nearest + sign * step) / 100;
      if (candidate_mm < 2) continue;
      const double share = MotorErrorShare(candidate_mm, teeth, tilt_deg);
      if (share >= best_share) continue;
      best_share = share;
      best_mm = candidate_mm;
    }
  }
  return best_mm;
}

}  // namespace trammel::tool_offset
