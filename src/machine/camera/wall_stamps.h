// Stamps of this machine's wall clock, carried over to its monotonic clock.
#pragma once

#include <optional>

namespace trammel::machine {

/// A library that stamps with the wall clock leaves it to its user that this clock can be set. The
/// two clocks are compared at each frame; where the wall clock was set in between, frames that were
/// stamped before cannot be told from those stamped after, and get no time for a while.
class WallStamps {
 public:
  /// @param wall_s      the stamp, s since 1970.
  /// @param wall_now_s  the wall clock now.
  /// @param host_now_s  the monotonic clock now; must not decrease from call to call.
  /// @returns the stamp on the monotonic clock, as exact as the two readings lie together; absent
  ///          for two seconds after the wall clock was set, and for a stamp that is missing (0) or
  ///          lies in the future.
  [[nodiscard]] std::optional<double> OnHostClock(double wall_s, double wall_now_s,
                                                  double host_now_s);

 private:
  std::optional<double> offset_s_;  ///< wall clock minus monotonic clock
  double compared_s_ = 0;
  std::optional<double> set_s_;  ///< when the wall clock was last seen to have been set
};

}  // namespace trammel::machine
