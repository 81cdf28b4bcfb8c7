// Virtual printer's load cell: its stream of readings, and PROBE's taps with it.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "sim/cell/cell_traits.h"
#include "sim/cell/load_cell.h"
#include "sim/klipper/config.h"

namespace trammel::sim {

/// Row of load_cell/dump_force. Print time; force_g is tared.
struct ForceReading {
  double time_s = 0;
  double force_g = 0;
  long long counts = 0;
  long long tare_counts = 0;
};

/// Tap as reported to clients, and its truth. Times are print time.
struct ProbedTap {
  double x_mm = 0;
  double y_mm = 0;
  std::vector<double> time_s;
  std::vector<double> force_g;
  std::vector<ZMove> moves;
  double reported_z_mm = 0;  ///< virtual firmware's result: the head's stop
  double surface_z_mm = 0;
  double latency_s = 0;             ///< converter's latency
  std::optional<PressTruth> truth;  ///< absent until the nozzle lets go
};

/// Cell in print time. Restarts with Klipper.
class CellProbe {
 public:
  /// REQUIRES valid traits and motion.
  explicit CellProbe(const LoadCellConfig& config);

  /// Produces all samples up to a print time. Does not go back.
  void Advance(double print_time_s, const NozzleAt& nozzle);
  /// Returns the height of the bed at a position.
  [[nodiscard]] double SurfaceZ(double x_mm, double y_mm) const;
  /// Returns the height at which an approach at this place halts; each approach is random.
  [[nodiscard]] double NextHaltZ(const TapMotion& motion, double x_mm, double y_mm);
  /// Sets the current reading to zero force, and the present as the origin of faults' times.
  void Tare(double print_time_s);
  /// Returns the last press that began since then, once it has ended.
  [[nodiscard]] std::optional<PressTruth> EndedPress(double since_s) const;
  /// Returns a tap of the samples in a window, without its moves.
  [[nodiscard]] ProbedTap Collect(double from_s, double until_s);

  /// Returns the readings of the last 30 s, oldest first, after the number that was discarded.
  [[nodiscard]] const std::deque<ForceReading>& readings() const { return readings_; }
  [[nodiscard]] std::size_t forgotten() const { return forgotten_; }
  [[nodiscard]] long long tare_counts() const { return tare_counts_; }
  [[nodiscard]] double latency_s() const { return cell_.latency_s(); }

 private:
  LoadCellConfig config_;
  Random random_;
  LoadCell cell_;
  SampleCorruptor corruptor_;
  long long tare_counts_ = 0;
  std::deque<ForceReading> readings_;
  std::size_t forgotten_ = 0;
  std::vector<PressTruth> presses_;
};

}  // namespace trammel::sim
