// Virtual machine in host time, shared by the server and the camera.
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
  /// Speed while it prints, moves, heats or cools down and the laser has been off for 10 s, > 0 …
  /// 1000; absent: `speed`. Scans and an idle machine's clock are not accelerated.
  std::optional<double> hurry;
};

/// Thread-safe. All times of its interface are the host's, in seconds; the machine starts at
/// `start_s`.
class MachineHost final : public MachineSource {
 public:
  MachineHost(MachineOptions options, double start_s);
  ~MachineHost() override;

  /// First advances the machine to that moment: a state once seen is final, however late the server
  /// handles its next command.
  [[nodiscard]] MachineView At(double monotonic_s) const override;
  /// Rebuilt when beads were finished, at most every two seconds during printing. Starting to print
  /// a file clears the plate.
  [[nodiscard]] std::shared_ptr<const Bed> bed(double monotonic_s) const override;

  [[nodiscard]] double MachineTime(double monotonic_s) const;
  /// Runs a function with exclusive access to the machine.
  void With(const std::function<void(VirtualKlipper&)>& function) const;
  /// Returns the latest time passed to At(), to which the machine was advanced. Only within With().
  [[nodiscard]] double latest_view_s() const { return latest_view_s_; }
  /// Returns K*: the right result of a calibration.
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
  // Bed, with its own lock: printing takes long.
  mutable std::mutex bed_mutex_;
  mutable std::shared_ptr<const Bed> bed_;
  mutable std::size_t bed_beads_ = 0;
  mutable double bed_cleaned_s_ = 0;
  mutable double bed_built_s_ = -1e9;
};

/// Returns CLOCK_MONOTONIC_RAW minus CLOCK_MONOTONIC, s: Klipper reports the former, cameras the
/// latter.
[[nodiscard]] double RawLessMonotonic();

}  // namespace trammel::sim
