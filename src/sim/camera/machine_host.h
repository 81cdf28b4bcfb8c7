// The virtual machine in the host's time, for the server and the camera at once.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "base/result.h"
#include "sim/camera/head_rig.h"
#include "sim/klipper/config.h"
#include "sim/klipper/machine.h"
#include "sim/klipper/motion_queue.h"

namespace trammel::sim {

struct MachineOptions {
  KlipperConfig klipper = DefaultKlipperConfig();
  KlipperFaults faults;
  std::uint64_t seed = 0;  ///< names the printer and its print
  std::optional<double>
      pressure_advance_s;  ///< the truth, 0.0001 … 10; drawn from the seed if absent
  double speed = 1;        ///< machine seconds per second of the host, > 0 … 1000
  /// The same while it prints, moves, heats or cools down and the laser has been off for 10 s, so
  /// that scans keep their speed and an idle machine its clock, > 0 … 1000; absent: `speed`.
  std::optional<double> hurry;
};

/// Thread-safe. All times of its interface are the host's, in seconds; the machine starts at
/// `start_s`.
class MachineHost final : public MachineSource {
 public:
  MachineHost(MachineOptions options, double start_s);
  ~MachineHost() override;

  /// Lets the machine live up to that moment first: what was seen once stays so, however late the
  /// server comes to its next command.
  [[nodiscard]] MachineView At(double monotonic_s) const override;
  /// Rebuilt where beads were finished, at most every two seconds while more are being laid.
  /// Starting to print a file cleans the plate.
  [[nodiscard]] std::shared_ptr<const Bed> bed(double monotonic_s) const override;

  [[nodiscard]] double MachineTime(double monotonic_s) const;
  /// Runs a function with the machine to itself.
  void With(const std::function<void(VirtualKlipper&)>& function) const;
  /// The latest time that At() was asked for, and moved the machine to. Only within With().
  [[nodiscard]] double latest_view_s() const { return latest_view_s_; }
  /// K*: what a calibration should find.
  [[nodiscard]] double true_pressure_advance_s() const { return truth_s_; }

 private:
  /// REQUIRES the machine's lock.
  void SetClock() const;

  MachineOptions options_;
  mutable MachineClock clock_;
  mutable double last_laser_s_ = -1e9;  ///< machine time
  double truth_s_;
  mutable double latest_view_s_ = -1e9;  ///< host time
  mutable std::mutex mutex_;
  std::unique_ptr<VirtualKlipper> klipper_;
  // The bed, behind a lock of its own: printing takes long.
  mutable std::mutex bed_mutex_;
  mutable std::shared_ptr<const Bed> bed_;
  mutable std::size_t bed_beads_ = 0;
  mutable double bed_cleaned_s_ = 0;
  mutable double bed_built_s_ = -1e9;
};

/// CLOCK_MONOTONIC_RAW less CLOCK_MONOTONIC, s: Klipper tells the former, cameras the latter.
[[nodiscard]] double RawLessMonotonic();

}  // namespace trammel::sim
