// Taps put together from the stream of forces and the firmware's moves, for printers that do not
// send whole taps.
#pragma once

#include <cstddef>
#include <deque>
#include <nlohmann/json.hpp>
#include <vector>

#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// Looks for a descent along z, a halt, and a rise of at most 1 mm, and cuts out the samples around
/// them. What comes a second time is dropped; a move that comes again with another length was cut
/// short, and replaces the first. Not thread-safe.
class TapBuilder {
 public:
  /// One batch of load_cell/dump_force: "data" with [time, force, …] rows. Others are skipped.
  void AddForces(const nlohmann::json& batch);
  /// One batch of motion_report/dump_trapq (MoveLog::Add).
  void AddMoves(const nlohmann::json& batch);
  /// What is kept belongs to another time: the firmware was restarted.
  void Reset();

  /// The taps that are complete, each once, in the shape of load_cell_probe/dump_taps: "time",
  /// "force" and "moves"; "x_rise_print_time_s" is when the rise began.
  [[nodiscard]] std::vector<nlohmann::json> Take();
  /// Print time of the newest force; -infinity where none came.
  [[nodiscard]] double forces_until_s() const;
  /// Forces come and moves have not for a while. True of a printer that stands still, too.
  [[nodiscard]] bool MovesStayAway() const;

 private:
  struct Sample {
    double time_s = 0;
    double force_g = 0;
  };
  /// A rise, and the descent before it, as indices of moves_.
  struct Found {
    std::size_t first = 0;
    std::size_t rise = 0;
    std::size_t end = 0;
  };
  [[nodiscard]] bool Complete(const Found& found, double& until_s) const;
  [[nodiscard]] bool FindRise(std::size_t from, Found& found) const;
  [[nodiscard]] nlohmann::json Cut(const Found& found, double until_s) const;
  void Insert(const TrapezoidMove& move);
  void Forget();

  std::deque<Sample> samples_;
  std::deque<TrapezoidMove> moves_;
  double taken_until_s_ = -1e300;
};

}  // namespace trammel::machine
