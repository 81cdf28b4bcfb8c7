#include "sim/klipper/motion_queue.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace trammel::sim {

namespace {

constexpr std::size_t kMaxBends = 100;

}  // namespace

double MachineClock::TimeAt(double host_s) const {
  auto bend = bends_.rbegin();
  while (bend->host_s > host_s && std::next(bend) != bends_.rend()) ++bend;
  return bend->machine_s + (host_s - bend->host_s) * bend->rate;
}

double MachineClock::At(double host_s) {
  const std::lock_guard lock(mutex_);
  latest_s_ = std::max(latest_s_, host_s);
  return TimeAt(host_s);
}

void MachineClock::SetRate(double rate) {
  const std::lock_guard lock(mutex_);
  if (bends_.back().rate == rate) return;
  bends_.push_back({latest_s_, TimeAt(latest_s_), rate});
  if (bends_.size() > kMaxBends) bends_.pop_front();
}

namespace {

constexpr double kQueueLeadS = 0.25;  // Klipper's buffer_time_start
constexpr double kPrimingS = 0.1;     // a pause in the stream of commands that lets a move begin
constexpr double kLowBufferS = 0.25;  // remaining motion at which waiting moves are decided
constexpr double kLookEveryS = 0.2;   // new motion required for another look-ahead
constexpr double kKeptS = 30;

// Returns the longest straight continuation: no real future lets the head be faster at the end.
Move Continued(const Move& move) {
  constexpr double kFarMm = 1e5;
  Move next = move;
  const double length = std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm,
                                   move.to.z_mm - move.from.z_mm);
  const double scale = length > 1e-9 ? kFarMm / length : 1;
  next.from = move.to;
  next.to = {move.to.x_mm + scale * (move.to.x_mm - move.from.x_mm),
             move.to.y_mm + scale * (move.to.y_mm - move.from.y_mm),
             move.to.z_mm + scale * (move.to.z_mm - move.from.z_mm)};
  next.e_mm = scale * move.e_mm;
  return next;
}

bool Same(const TimedMove& a, const TimedMove& b) {
  constexpr double kSameMmS = 1e-9;
  return std::abs(a.start_v_mm_s - b.start_v_mm_s) < kSameMmS &&
         std::abs(a.cruise_v_mm_s - b.cruise_v_mm_s) < kSameMmS &&
         std::abs(a.end_v_mm_s - b.end_v_mm_s) < kSameMmS;
}

}  // namespace

void MotionQueue::Reset(const Position& position) {
  pending_.clear();
  marks_.clear();
  decided_.clear();
  entry_v_mm_s_ = undecided_s_ = last_append_s_ = print_time_s_ = e_mm_ = 0;
  forgotten_ = 0;
  place_ = position;
}

void MotionQueue::Append(const Move& move, double now_s) {
  pending_.push_back(move);
  last_append_s_ = now_s;
  const double length = std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm,
                                   move.to.z_mm - move.from.z_mm);
  undecided_s_ += (length > 1e-9 ? length : std::abs(move.e_mm)) / move.feed_mm_s;
  if (undecided_s_ > kLookEveryS) {
    undecided_s_ = 0;
    CommitWhatIsCertain(now_s);
  }
}

// Commits moves planned alike for a stop and an endless continuation: no future changes them.
void MotionQueue::CommitWhatIsCertain(double now_s) {
  const std::vector<TimedMove> stopping = PlanContinuation(pending_, entry_v_mm_s_);
  pending_.push_back(Continued(pending_.back()));
  const std::vector<TimedMove> endless = PlanContinuation(pending_, entry_v_mm_s_);
  pending_.pop_back();
  std::size_t certain = 0;
  while (certain < stopping.size() && Same(stopping[certain], endless[certain])) ++certain;
  if (certain > 0) Commit(certain, stopping, now_s);
}

void MotionQueue::Commit(std::size_t count, const std::vector<TimedMove>& plan, double now_s) {
  if (entry_v_mm_s_ == 0) print_time_s_ = std::max(print_time_s_, now_s + kQueueLeadS);
  const double origin_s = print_time_s_;
  for (std::size_t i = 0; i < count; ++i) {
    PlannedMove planned;
    planned.timed = plan[i];
    planned.timed.start_s += origin_s;
    planned.e_start_mm = e_mm_;
    print_time_s_ = planned.timed.end_s();
    place_ = plan[i].move.to;
    e_mm_ += plan[i].move.e_mm;
    decided_.push_back(planned);
    if (on_planned_) on_planned_(planned);
  }
  entry_v_mm_s_ = plan[count - 1].end_v_mm_s;
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(count));
  RunMarks(count);
  while (decided_.size() > 2 && decided_[1].timed.end_s() < now_s - kKeptS) {
    decided_.pop_front();
    ++forgotten_;
  }
}

void MotionQueue::RunMarks(std::size_t passed) {
  std::vector<Mark> marks;
  marks.swap(marks_);
  for (Mark& mark : marks) {
    if (mark.after > passed) {
      mark.after -= passed;
      marks_.push_back(std::move(mark));
      continue;
    }
    // Mark inside the batch: its move's end is counted from the back.
    const std::size_t later = passed - mark.after;
    mark.function(decided_[decided_.size() - 1 - later].timed.end_s());
  }
}

void MotionQueue::Flush(double now_s) {
  undecided_s_ = 0;
  if (!pending_.empty()) {
    const std::vector<TimedMove> plan = PlanContinuation(pending_, entry_v_mm_s_);
    Commit(plan.size(), plan, now_s);
  }
  entry_v_mm_s_ = 0;
}

void MotionQueue::Service(double now_s) {
  if (pending_.empty()) return;
  const bool low = print_time_s_ - now_s < kLowBufferS;
  if (low && now_s - last_append_s_ >= kPrimingS) Flush(now_s);
}

void MotionQueue::Dwell(double seconds, double now_s) {
  Flush(now_s);
  print_time_s_ = std::max(print_time_s_, now_s + kQueueLeadS) + seconds;
}

void MotionQueue::SetPosition(const Position& position, double now_s) {
  Flush(now_s);
  PlannedMove planned;
  planned.jump = true;
  planned.timed.move.from = planned.timed.move.to = position;
  planned.timed.start_s = std::max(print_time_s_, now_s);
  planned.e_start_mm = e_mm_;
  decided_.push_back(planned);
  place_ = position;
}

double MotionQueue::NextStart(double now_s) const {
  return std::max(print_time_s_, now_s + kQueueLeadS);
}

void MotionQueue::AppendTimed(TimedMove timed) {
  TRAMMEL_CHECK(pending_.empty(), "moves that wait = {}", pending_.size());
  timed.start_s = std::max(timed.start_s, print_time_s_);
  PlannedMove planned;
  planned.timed = timed;
  planned.e_start_mm = e_mm_;
  print_time_s_ = timed.end_s();
  place_ = timed.move.to;
  decided_.push_back(planned);
  if (on_planned_) on_planned_(planned);
}

void MotionQueue::AppendHalt(double time_s) {
  TRAMMEL_CHECK(pending_.empty() && time_s >= print_time_s_, "time = {}, end = {}", time_s,
                print_time_s_);
  PlannedMove planned;
  planned.jump = true;
  planned.timed.move.from = planned.timed.move.to = place_;
  planned.timed.start_s = print_time_s_ = time_s;
  planned.e_start_mm = e_mm_;
  decided_.push_back(planned);
}

void MotionQueue::AfterLastMove(AtTime function, double now_s) {
  if (pending_.empty()) {
    function(std::max(print_time_s_, now_s));
  } else {
    marks_.push_back({pending_.size(), std::move(function)});
  }
}

HeadState MotionQueue::At(double print_time_s) const {
  const auto after = std::upper_bound(
      decided_.begin(), decided_.end(), print_time_s,
      [](double time_s, const PlannedMove& move) { return time_s < move.timed.start_s; });
  HeadState head;
  if (after == decided_.begin()) {
    head.position = decided_.empty() ? place_ : decided_.front().timed.move.from;
    head.e_mm = decided_.empty() ? e_mm_ : decided_.front().e_start_mm;
    return head;
  }
  const PlannedMove& planned = *std::prev(after);
  const Move& move = planned.timed.move;
  if (planned.jump || planned.timed.length_mm <= 0) {
    head.position = move.to;
    head.e_mm = planned.e_start_mm;
    return head;
  }
  const PathState path = StateAt(planned.timed, print_time_s);
  const double share = std::clamp(path.distance_mm / planned.timed.length_mm, 0.0, 1.0);
  head.position = {std::lerp(move.from.x_mm, move.to.x_mm, share),
                   std::lerp(move.from.y_mm, move.to.y_mm, share),
                   std::lerp(move.from.z_mm, move.to.z_mm, share)};
  head.e_mm = planned.e_start_mm + share * move.e_mm;
  if (print_time_s < planned.timed.end_s()) {
    const bool moves_head = std::hypot(move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm,
                                       move.to.z_mm - move.from.z_mm) > 1e-9;
    head.speed_mm_s = moves_head ? path.speed_mm_s : 0;
    head.filament_speed_mm_s = path.speed_mm_s * move.e_mm / planned.timed.length_mm;
  }
  return head;
}

namespace {

// Returns the stretches of a trapezoid along one direction. `per_mm`: of the moved axis, per mm of
// path.
std::vector<TrapqEntry> Stretches(const TimedMove& timed, const std::array<double, 3>& start,
                                  const std::array<double, 3>& direction, double per_mm) {
  std::vector<TrapqEntry> entries;
  const double a = timed.move.acceleration_mm_s2;
  const std::array<double, 3> durations = {timed.accelerate_s, timed.cruise_s, timed.decelerate_s};
  const std::array<double, 3> speeds = {timed.start_v_mm_s, timed.cruise_v_mm_s,
                                        timed.cruise_v_mm_s};
  const std::array<double, 3> accelerations = {a, 0, -a};
  double time_s = timed.start_s;
  double along_mm = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (durations[i] <= 1e-12) continue;
    TrapqEntry entry;
    entry.time_s = time_s;
    entry.duration_s = durations[i];
    entry.start_velocity = speeds[i] * per_mm;
    entry.acceleration = accelerations[i] * per_mm;
    for (std::size_t k = 0; k < 3; ++k)
      entry.start[k] = start[k] + direction[k] * along_mm * per_mm;
    entry.direction = direction;
    entries.push_back(entry);
    along_mm += (speeds[i] + 0.5 * accelerations[i] * durations[i]) * durations[i];
    time_s += durations[i];
  }
  return entries;
}

}  // namespace

std::vector<TrapqEntry> ToolheadTrapq(const PlannedMove& planned) {
  const Move& move = planned.timed.move;
  const std::array<double, 3> start = {move.from.x_mm, move.from.y_mm, move.from.z_mm};
  if (planned.jump) return {{planned.timed.start_s, 0, 0, 0, start, {}}};
  const std::array<double, 3> delta = {move.to.x_mm - move.from.x_mm, move.to.y_mm - move.from.y_mm,
                                       move.to.z_mm - move.from.z_mm};
  const double length = std::hypot(delta[0], delta[1], delta[2]);
  if (length <= 1e-9) return {};
  return Stretches(planned.timed, start, {delta[0] / length, delta[1] / length, delta[2] / length},
                   1);
}

std::vector<TrapqEntry> ExtruderTrapq(const PlannedMove& planned) {
  if (planned.jump || std::abs(planned.timed.move.e_mm) <= 1e-12) return {};
  const double advances = planned.timed.deposits() ? 1 : 0;
  const double per_mm = planned.timed.move.e_mm / planned.timed.length_mm;
  std::vector<TrapqEntry> entries =
      Stretches(planned.timed, {planned.e_start_mm, 0, 0}, {1, 0, 0}, per_mm);
  // The second direction component states if pressure advance applies.
  for (TrapqEntry& entry : entries) entry.direction = {1, advances, 0};
  return entries;
}

}  // namespace trammel::sim
