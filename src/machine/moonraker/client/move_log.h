// Moves that the firmware planned, from motion_report.dump_trapq.
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

  /// Adds a batch: an object with "data", a list of [time, duration, start velocity, acceleration,
  /// [x, y, z], [dx, dy, dz]]. Skips rows of another form or with impossible values. The later
  /// report of a known move replaces the earlier.
  void Add(const nlohmann::json& batch);
  void Clear() { moves_.clear(); }

  /// Returns the moves that overlap [from, to], by print time.
  [[nodiscard]] std::vector<TrapezoidMove> Overlapping(double from_s, double to_s) const;
  /// True if a known move begins at or after this time.
  [[nodiscard]] bool Reaches(double print_time_s) const;

 private:
  void Put(const TrapezoidMove& move);

  std::size_t capacity_;
  std::deque<TrapezoidMove> moves_;  // sorted by print time, no duplicates
};

}  // namespace trammel::machine
