// Virtual machine's time over host time.
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <mutex>
#include <vector>

#include "sim/print/planner.h"

namespace trammel::sim {

/// Piecewise linear function that never decreases. Thread-safe; all times in seconds.
class MachineClock {
 public:
  /// @param start_s  host time at which the machine's is 0.
  /// @param rate     machine seconds per second of the host, > 0.
  MachineClock(double start_s, double rate) : bends_{{start_s, 0, rate}}, latest_s_(start_s) {}

  /// Returns machine time at a host time. A returned time remains valid, for the last hundred
  /// changes of the rate.
  [[nodiscard]] double At(double host_s);

  /// Changes the rate, > 0, from the latest host time passed to At().
  void SetRate(double rate);

 private:
  struct Bend {
    double host_s = 0;
    double machine_s = 0;
    double rate = 1;  ///< from this point on
  };
  [[nodiscard]] double TimeAt(double host_s) const;

  std::mutex mutex_;
  std::deque<Bend> bends_;  ///< never empty
  double latest_s_;
};

/// Move with final motion. Times are print time.
struct PlannedMove {
  TimedMove timed;
  double e_start_mm = 0;  ///< cumulative filament
  bool jump = false;      ///< the position was set, nothing moved
};

struct HeadState {
  Position position;
  double e_mm = 0;
  double speed_mm_s = 0;           ///< head's speed
  double filament_speed_mm_s = 0;  ///< signed
};

/// Stretch of constant acceleration, as reported by dump_trapq.
struct TrapqEntry {
  double time_s = 0;
  double duration_s = 0;
  double start_velocity = 0;
  double acceleration = 0;
  std::array<double, 3> start{};
  std::array<double, 3> direction{};
};

/// Moves wait until no later move can change their motion, until the buffer runs low, or until
/// Flush. `now` is always the estimated print time.
class MotionQueue {
 public:
  using AtTime = std::function<void(double print_time_s)>;
  using OnPlanned = std::function<void(const PlannedMove&)>;

  /// Called for each move when its motion is final.
  void set_on_planned(OnPlanned on_planned) { on_planned_ = std::move(on_planned); }

  /// Clears everything and sets the head's position.
  void Reset(const Position& position);
  /// REQUIRES HasMotion(move), and that it begins at the end of the last one.
  void Append(const Move& move, double now_s);
  /// Finalises all moves: the head comes to rest after the last.
  void Flush(double now_s);
  /// Finalises the moves that cannot wait any longer.
  void Service(double now_s);
  /// Comes to rest and pauses.
  void Dwell(double seconds, double now_s);
  /// Comes to rest and redefines the head's position.
  void SetPosition(const Position& position, double now_s);
  /// Appends a move with given motion, for motion that stops at once. It begins after all earlier
  /// ones, or at its own start_s if later. REQUIRES nothing waiting().
  void AppendTimed(TimedMove timed);
  /// Reports at a time that the head is at rest at its position, as Klipper does after homing.
  /// REQUIRES nothing waiting(), and that time_s is not before print_time_s().
  void AppendHalt(double time_s);
  /// Returns the start time of a newly queued move.
  [[nodiscard]] double NextStart(double now_s) const;
  /// Calls a function with the print time at which the last queued move ends, once that is known.
  void AfterLastMove(AtTime function, double now_s);

  /// Returns the end of all final moves.
  [[nodiscard]] double print_time_s() const { return print_time_s_; }
  [[nodiscard]] bool waiting() const { return !pending_.empty(); }
  [[nodiscard]] HeadState At(double print_time_s) const;
  /// Returns the final moves of the last 30 s.
  [[nodiscard]] const std::deque<PlannedMove>& decided() const { return decided_; }
  /// Returns the number of moves removed from the front of decided().
  [[nodiscard]] std::size_t forgotten() const { return forgotten_; }

 private:
  struct Mark {
    std::size_t after = 0;  ///< moves of pending_ that come first
    AtTime function;
  };
  void Commit(std::size_t count, const std::vector<TimedMove>& plan, double now_s);
  void CommitWhatIsCertain(double now_s);
  void RunMarks(std::size_t passed);

  std::vector<Move> pending_;
  std::vector<Mark> marks_;
  double entry_v_mm_s_ = 0;
  double undecided_s_ = 0;  ///< rough duration of what came since the last look
  double last_append_s_ = 0;
  double print_time_s_ = 0;
  std::deque<PlannedMove> decided_;
  std::size_t forgotten_ = 0;
  Position place_;
  double e_mm_ = 0;
  OnPlanned on_planned_;
};

/// Returns the stretches of the toolhead's motion in one move; a jump has one of zero duration.
[[nodiscard]] std::vector<TrapqEntry> ToolheadTrapq(const PlannedMove& move);

/// Returns the same for the filament; empty if none moves.
[[nodiscard]] std::vector<TrapqEntry> ExtruderTrapq(const PlannedMove& move);

}  // namespace trammel::sim
