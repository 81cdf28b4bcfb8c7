// How the head moves along a line of three speeds, and what its drive is asked for.
#pragma once

#include <array>
#include <vector>

#include "pressure_advance/profile/line_motion.h"

namespace trammel::pressure_advance {

/// The head's way over time along a line: slow, fast, slow, by ramps of constant acceleration.
class HeadMotion {
 public:
  /// REQUIRES a slow, a fast and a slow segment, a length and an acceleration.
  explicit HeadMotion(const LineMotion& motion);

  [[nodiscard]] double slow_mm_s() const { return slow_mm_s_; }
  [[nodiscard]] double fast_mm_s() const { return fast_mm_s_; }
  /// Ends of the cells of time that a model steps through, s: short about changes of speed, from
  /// before the first on until after the line's end.
  [[nodiscard]] const std::vector<double>& times_s() const { return times_s_; }
  /// At these times, from the line's start.
  [[nodiscard]] const std::vector<double>& positions_mm() const { return positions_mm_; }

  /// What a drive follows at these times.
  struct Drive {
    std::vector<double> position_mm;
    std::vector<double> speed_mm_s;
  };
  /// Averages the way by a triangle, as Klipper does where advance is on.
  /// @param width_s  of the triangle's base; >= 0
  [[nodiscard]] Drive Averaged(double width_s) const;

 private:
  // A stretch of constant acceleration: the second integral of the way as a polynomial of the time
  // since its beginning, lowest power first.
  struct Phase {
    double begin_s = 0;
    std::array<double, 5> twice_integrated{};
  };
  struct Way {
    double twice_integrated = 0, integrated = 0, mm = 0, mm_s = 0;
  };
  [[nodiscard]] Way At(double time_s) const;
  void Continue(double from_s, double speed_mm_s, double acceleration_mm_s2);
  void DivideTime(double end_s);

  double slow_mm_s_ = 0, fast_mm_s_ = 0;
  std::vector<Phase> phases_;
  std::vector<double> times_s_, positions_mm_;
};

}  // namespace trammel::pressure_advance
