// The virtual machine's time over the host's.
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <mutex>
#include <vector>

#include "sim/print/planner.h"

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

/// A move whose motion is decided. Times are print time.
struct PlannedMove {
  TimedMove timed;
  double e_start_mm = 0;  ///< of all filament so far
  bool jump = false;      ///< the position was set, nothing moved
};

struct HeadState {
  Position position;
  double e_mm = 0;
  double speed_mm_s = 0;           ///< of the head
  double filament_speed_mm_s = 0;  ///< signed
};

/// One stretch of constant acceleration, as dump_trapq tells it.
struct TrapqEntry {
  double time_s = 0;
  double duration_s = 0;
  double start_velocity = 0;
  double acceleration = 0;
  std::array<double, 3> start{};
  std::array<double, 3> direction{};
};

/// Moves wait until nothing that may follow can change their motion, until the buffer runs low, or
/// until Flush. `now` is always the estimated print time.
class MotionQueue {
 public:
  using AtTime = std::function<void(double print_time_s)>;
  using OnPlanned = std::function<void(const PlannedMove&)>;

  /// Called for each move when its motion is decided.
  void set_on_planned(OnPlanned on_planned) { on_planned_ = std::move(on_planned); }

  /// Forgets everything and puts the head at a place.
  void Reset(const Position& position);
  /// REQUIRES HasMotion(move), and that it begins where the last one ends.
  void Append(const Move& move, double now_s);
  /// Decides all moves: the head comes to rest after the last.
  void Flush(double now_s);
  /// Decides what cannot wait any longer.
  void Service(double now_s);
  /// Comes to rest and stands still for a while.
  void Dwell(double seconds, double now_s);
  /// Comes to rest and takes the place where the head stands for another one.
  void SetPosition(const Position& position, double now_s);
  /// A move whose motion is given, not planned, for motion that stops at once. It begins when all
  /// before it is done, or at its own start_s where that is later. REQUIRES nothing waiting().
  void AppendTimed(TimedMove timed);
  /// Tells at a time that the head stands where it stands, as Klipper does after homing. REQUIRES
  /// nothing waiting(), and that time_s is not before print_time_s().
  void AppendHalt(double time_s);
  /// When a move that is queued now begins.
  [[nodiscard]] double NextStart(double now_s) const;
  /// Runs a function with the print time at which the last queued move ends, once that is known.
  void AfterLastMove(AtTime function, double now_s);

  /// The end of everything decided.
  [[nodiscard]] double print_time_s() const { return print_time_s_; }
  [[nodiscard]] bool waiting() const { return !pending_.empty(); }
  [[nodiscard]] HeadState At(double print_time_s) const;
  /// Decided moves of the last 30 s.
  [[nodiscard]] const std::deque<PlannedMove>& decided() const { return decided_; }
  /// How many moves were forgotten from the front of decided().
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

/// The stretches of the toolhead's motion in one move; a jump has one of no duration.
[[nodiscard]] std::vector<TrapqEntry> ToolheadTrapq(const PlannedMove& move);

/// The same for the filament; empty where none moves.
[[nodiscard]] std::vector<TrapqEntry> ExtruderTrapq(const PlannedMove& move);

}  // namespace trammel::sim
