#include "sim/camera/machine_host.h"

#include <time.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "sim/camera/camera_http.h"
#include "sim/print/printer.h"

namespace trammel::sim {
namespace {

constexpr double kRebuildEveryS = 2;
constexpr double kDark_s = 10;  // between two sweeps of a scan the laser is off for less

// Returns a clean plate of the size of every world's printer.
std::shared_ptr<const Bed> EmptyBed() {
  auto bed = std::make_shared<Bed>();
  bed->size_x_mm = PrinterTraits{}.bed_size_x_mm;
  bed->size_y_mm = PrinterTraits{}.bed_size_y_mm;
  return bed;
}

// True if users would wait for it: it prints, moves, heats, or cools down.
bool HasLongToGo(const VirtualKlipper& klipper) {
  constexpr double kHandWarm_c = 35;
  const auto changes = [](const Heater& heater) {
    return Busy(heater) || (heater.target_c == 0 && heater.temperature_c > kHandWarm_c);
  };
  return klipper.print.running || klipper.busy() || changes(klipper.nozzle) || changes(klipper.bed);
}

}  // namespace

double RawLessMonotonic() {
  constexpr int kReadings = 5;  // a busy machine interrupts few of them
  double difference_s = 0;
  double narrowest_s = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kReadings; ++i) {
    const double before_s = MonotonicNow();
    timespec raw_time{};
    clock_gettime(CLOCK_MONOTONIC_RAW, &raw_time);
    const double after_s = MonotonicNow();
    if (after_s - before_s >= narrowest_s) continue;
    narrowest_s = after_s - before_s;
    difference_s = static_cast<double>(raw_time.tv_sec) +
                   1e-9 * static_cast<double>(raw_time.tv_nsec) - 0.5 * (before_s + after_s);
  }
  return difference_s;
}

MachineHost::MachineHost(MachineOptions options, double start_s)
    : options_(std::move(options)),
      clock_(start_s, options_.speed),
      truth_s_(options_.pressure_advance_s.value_or(TruthOf(options_.seed))),
      klipper_(std::make_unique<VirtualKlipper>(options_.klipper, options_.faults)),
      bed_(EmptyBed()) {}

MachineHost::~MachineHost() = default;

double MachineHost::MachineTime(double monotonic_s) const { return clock_.At(monotonic_s); }

void MachineHost::SetClock() const {
  if (!options_.hurry) return;
  const double now_s = klipper_->now_s();
  if (klipper_->pins["LASER"] > 0) last_laser_s_ = now_s;
  const bool hurries = HasLongToGo(*klipper_) && now_s - last_laser_s_ > kDark_s;
  clock_.SetRate(hurries ? *options_.hurry : options_.speed);
}

void MachineHost::With(const std::function<void(VirtualKlipper&)>& function) const {
  const std::lock_guard lock(mutex_);
  function(*klipper_);
  SetClock();
}

MachineView MachineHost::At(double monotonic_s) const {
  const std::lock_guard lock(mutex_);
  latest_view_s_ = std::max(latest_view_s_, monotonic_s);
  const double time_s = MachineTime(monotonic_s);
  klipper_->Advance(time_s);
  SetClock();
  const HeadState head = klipper_->TrueHead(time_s);
  const History& history = klipper_->history();
  return {head.position.x_mm,
          head.position.y_mm,
          head.position.z_mm,
          head.speed_mm_s,
          ValueAt(history, "output_pin LASER", time_s, 0) > 0,
          ValueAt(history, "output_pin LIGHTS", time_s, 0) > 0};
}

std::shared_ptr<const Bed> MachineHost::bed(double monotonic_s) const {
  const std::lock_guard bed_lock(bed_mutex_);
  std::string gcode;
  {
    const std::lock_guard lock(mutex_);
    const double time_s = MachineTime(monotonic_s);
    const double cleaned_s = klipper_->plate_cleaned_s;
    std::size_t beads = 0;
    for (const ExecutedMove& move : klipper_->history().moves) {
      beads +=
          move.timed.deposits() && move.timed.start_s >= cleaned_s && move.timed.end_s() <= time_s;
    }
    if (beads == bed_beads_ && cleaned_s == bed_cleaned_s_) return bed_;
    const bool laying = klipper_->TrueHead(time_s).filament_speed_mm_s > 0;
    if (laying && monotonic_s - bed_built_s_ < kRebuildEveryS && cleaned_s == bed_cleaned_s_) {
      return bed_;
    }
    bed_beads_ = beads;
    bed_cleaned_s_ = cleaned_s;
    bed_built_s_ = monotonic_s;
    if (beads > 0) gcode = ExecutedGcode(klipper_->history(), cleaned_s, time_s);
  }
  if (gcode.empty()) {
    bed_ = EmptyBed();
    return bed_;
  }
  Result<Print> print = PrintInWorld(gcode, options_.seed, truth_s_);
  // Beyond the limits of the printer's model (an hour, 100 m) the plate is unchanged.
  if (print) bed_ = std::make_shared<Bed>(std::move(print->bed));
  return bed_;
}

}  // namespace trammel::sim
