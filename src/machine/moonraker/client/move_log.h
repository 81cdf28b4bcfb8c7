// The moves that the firmware planned, as motion_report.dump_trapq tells them.
#pragma once

#include <deque>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "machine/moonraker/printer.h"

namespace trammel::machine {

class MoveLog {
 public:
  /// @param capacity  moves kept, >= 1; the oldest go first
  explicit MoveLog(std::size_t capacity = 100'000) : capacity_(capacity) {}

  /// One batch: an object with "data", a list of [time, duration, start velocity, acceleration,
  /// [x, y, z], [dx, dy, dz]]. Rows of another form, or that no printer makes, are skipped. A move
  /// that is known already is not kept twice: the later telling of it counts.
  void Add(const nlohmann::json& batch);
  void Clear() { moves_.clear(); }

  /// Those that overlap [from, to], by print time.
  [[nodiscard]] std::vector<TrapezoidMove> Overlapping(double from_s, double to_s) const;
  /// Whether a move is known that begins at or after this time.
  [[nodiscard]] bool Reaches(double print_time_s) const;

 private:
  void Put(const TrapezoidMove& move);

  std::size_t capacity_;
  std::deque<TrapezoidMove> moves_;  // by print time, no two at the same
};

}  // namespace trammel::machine
