// The virtual machine's time over the host's.
#pragma once

#include <deque>
#include <mutex>

namespace trammel::sim {

/// A line with bends that never goes back. Thread-safe; all times in seconds.
class MachineClock {
 public:
  /// @param start_s  host time at which the machine's is 0.
  /// @param rate     machine seconds per second of the host, > 0.
  MachineClock(double start_s, double rate) : bends_{{start_s, 0, rate}}, latest_s_(start_s) {}

  /// Machine time at a host time. What was told once stays so, for the last hundred changes of the
  /// rate.
  [[nodiscard]] double At(double host_s);

  /// Changes the rate, > 0, from the latest host time that At() was asked for.
  void SetRate(double rate);

 private:
  struct Bend {
    double host_s = 0;
    double machine_s = 0;
    double rate = 1;  ///< from here on
  };
  [[nodiscard]] double TimeAt(double host_s) const;

  std::mutex mutex_;
  std::deque<Bend> bends_;  ///< never empty
  double latest_s_;
};

}  // namespace trammel::sim
