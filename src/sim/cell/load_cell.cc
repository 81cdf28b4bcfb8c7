#include "sim/cell/load_cell.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/check.h"

namespace trammel::sim {

namespace {

constexpr double kGravityMmS2 = 9806.65;

}  // namespace

double StructureMode::Advance(const DisturbanceTraits& traits, double bed_g,
                              double acceleration_mm_s2, double dt_s) {
  const double rest_g = traits.mode_share * bed_g;
  if (!begun_) {
    begun_ = true;
    force_g_ = rest_g;
    return 0;
  }
  const double goal_g = rest_g + traits.mode_mass_g * acceleration_mm_s2 / kGravityMmS2;
  const double w = 2 * std::numbers::pi * traits.mode_hz;
  const double fading = traits.mode_damping * w;
  const double swing = w * std::sqrt(1 - traits.mode_damping * traits.mode_damping);
  const double kept = std::exp(-fading * dt_s);
  const double c = std::cos(swing * dt_s);
  const double s = std::sin(swing * dt_s) / swing;
  const double off_g = force_g_ - goal_g;
  const double rate_g_s = rate_g_s_;
  force_g_ = goal_g + kept * (off_g * c + (rate_g_s + fading * off_g) * s);
  rate_g_s_ = kept * (rate_g_s * c - (fading * rate_g_s + w * w * off_g) * s);
  return force_g_ - rest_g;
}

PinkNoise::PinkNoise(double rate_hz, Random random) : random_(random) {
  constexpr double kLowestHz = 0.02;
  constexpr double kApart = 4;
  for (double corner_hz = 0.5 * rate_hz; corner_hz > kLowestHz; corner_hz /= kApart) {
    kept_.push_back(std::exp(-2 * std::numbers::pi * corner_hz / rate_hz));
    values_.push_back(random_.Normal());
  }
}

double PinkNoise::Next() {
  double sum = 0;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    values_[i] = values_[i] * kept_[i] + std::sqrt(1 - kept_[i] * kept_[i]) * random_.Normal();
    sum += values_[i];
  }
  return sum / std::sqrt(static_cast<double>(values_.size()));
}

double PlasticStrand::Pull(const PressTraits& traits, double gap_mm) {
  if (gap_mm <= 0) {
    fast_ = true;
    return 0;
  }
  if (gap_mm >= traits.strand_snap_mm) fast_ = false;
  if (!fast_) return 0;
  return traits.strand_g * (1 - std::exp(-gap_mm / traits.strand_onset_mm)) *
         traits.strand_length_mm / (traits.strand_length_mm + gap_mm);
}

double Slip::Force(const DisturbanceTraits& traits, double gap_mm, double dt_s) {
  if (gap_mm < std::min(0.0, traits.slip_above_mm)) armed_ = true;
  if (armed_ && gap_mm >= traits.slip_above_mm) {
    armed_ = false;
    slips_ += 1;
  }
  gone_ += (slips_ - gone_) * (1 - std::exp(-dt_s / traits.slip_s));
  return -traits.slip_g * gone_;
}

double CellMemory::Advance(const ConverterTraits& traits, double load_g, double dt_s) {
  if (!begun_) {
    begun_ = true;
    slow_g_ = load_g;
  }
  slow_g_ += (load_g - slow_g_) * (1 - std::exp(-dt_s / traits.creep_s));
  peak_g_ = load_g > 0 ? std::max(peak_g_, load_g) : 0;
  const double kept_g = peak_g_ > 0 ? 4 * load_g * (1 - load_g / peak_g_) : 0;
  return load_g + traits.creep_share * (slow_g_ - load_g) + traits.hysteresis_share * kept_g;
}

namespace {

constexpr int kFinePerSample = 16;
constexpr double kImpulseS = 0.01;

// Separate random streams for rare traits, so that other cells' random numbers are unchanged.
constexpr std::uint64_t kPinkStream = 101;
constexpr std::uint64_t kSwingStream = 102;
constexpr std::uint64_t kStampStream = 103;

// Returns the depth below first touch at the trigger force; negative, above it, if plastic under
// the nozzle suffices.
double TriggerDepth(const PressTraits& press, double force_g) {
  if (press.blob_g >= force_g) {
    return press.blob_mm * (std::pow(force_g / press.blob_g, 1 / kBlobShape) - 1);
  }
  return ContactDepth(press.law, force_g - press.blob_g);
}

}  // namespace

LoadCell::LoadCell(const CellTraits& traits, double start_s, Random random)
    : traits_(traits),
      random_(random),
      start_s_(start_s),
      first_s_(start_s + random_.Uniform() / traits.converter.rate_hz),
      next_s_(first_s_),
      pink_(traits.converter.rate_hz, random.Fork(kPinkStream)) {
  for (double& phase_rad : hum_phase_rad_) phase_rad = random_.Uniform(0, 2 * std::numbers::pi);
  heater_phase_ = random_.Uniform();
  swing_phase_rad_ = random_.Fork(kSwingStream).Uniform(0, 2 * std::numbers::pi);
  wander_g_ =
      traits_.disturbance.wander_g > 0 ? random_.Normal(0, traits_.disturbance.wander_g) : 0;
}

double LoadCell::latency_s() const {
  // A boxcar of n values has a delay of (n - 1) / 2 of their spacing.
  return traits_.converter.latency_s + traits_.converter.filter_order * 0.5 * (kFinePerSample - 1) /
                                           kFinePerSample / traits_.converter.rate_hz;
}

std::vector<PressTruth> LoadCell::TakePresses() { return std::exchange(presses_, {}); }

CellSample LoadCell::Next(const NozzleAt& nozzle) {
  const ConverterTraits& converter = traits_.converter;
  const double interval_s = 1 / converter.rate_hz;
  for (int i = kFinePerSample - 1; i >= 0; --i) {
    Step(next_s_ - i * interval_s / kFinePerSample, nozzle);
  }
  const double read_g = converter.offset_g + converter.sign * (force_g_ + OutputNoise());
  CellSample sample;
  sample.time_s = next_s_ + converter.latency_s;
  sample.saturated = std::abs(read_g) >= converter.saturation_g;
  const double held_g = std::clamp(read_g, -converter.saturation_g, converter.saturation_g);
  sample.counts = std::llround(held_g * converter.counts_per_g);
  sample.force_g = static_cast<double>(sample.counts) / converter.counts_per_g;
  ++samples_;
  next_s_ = first_s_ + static_cast<double>(samples_) * interval_s;
  return sample;
}

double LoadCell::OutputNoise() {
  const DisturbanceTraits& d = traits_.disturbance;
  const double moving_g = d.approach_noise_g * speed_mm_s_ / d.approach_speed_mm_s;
  const double white_g = random_.Normal(0, std::hypot(d.noise_g, moving_g));
  return d.pink_g > 0 ? white_g + d.pink_g * pink_.Next() : white_g;
}

void LoadCell::Begin(double time_s, const NozzleState& nozzle) {
  begun_ = true;
  // A descending head has already taken up the backlash.
  const double backlash_mm = nozzle.velocity_mm_s < 0 ? BacklashOf(traits_.press) : 0;
  nozzle_z_mm_ = nozzle.z_mm + backlash_mm;
  velocity_mm_s_ = nozzle.velocity_mm_s;
  last_ = {time_s, nozzle.z_mm, nozzle.surface_z_mm - nozzle_z_mm_, 0};
  blob_mm_ = traits_.press.blob_mm;
}

void LoadCell::FollowDrive(double drive_z_mm) {
  const double travel_mm = traits_.press.onset_travel_mm;
  const double moved_mm = drive_z_mm - last_.drive_z_mm;
  double backlash_mm = nozzle_z_mm_ - last_.drive_z_mm;
  switch (traits_.press.onset) {
    case Onset::kInstant:
      backlash_mm = 0;
      break;
    case Onset::kFlat:
      backlash_mm = std::clamp(backlash_mm - moved_mm, 0.0, travel_mm);
      break;
    case Onset::kCurved: {
      // Dahl's friction: the remaining compliance falls exponentially with the distance.
      const double kept = travel_mm > 0 ? std::exp(-std::abs(moved_mm) / travel_mm) : 0;
      backlash_mm =
          moved_mm > 0 ? backlash_mm * kept : travel_mm - (travel_mm - backlash_mm) * kept;
      break;
    }
  }
  nozzle_z_mm_ = drive_z_mm + backlash_mm;
}

double LoadCell::Elastic(double depth_mm) const {
  return depth_mm > 0 ? ContactForce(traits_.press.law, depth_mm)
                      : traits_.press.law.stiffness_g_mm * depth_mm;
}

double LoadCell::BedForce(const Fine& now) {
  if (!touching_) return 0;
  if (now.contact_g > 0) return now.contact_g;
  if (stuck_ && now.contact_g <= -traits_.press.stick_g) stuck_ = false;
  return stuck_ ? now.contact_g : 0;
}

double LoadCell::PlasticForce(double gap_mm, double fell_mm, double dt_s) {
  constexpr double kFlowS = 0.05;  // molten plastic yields to a resting nozzle
  constexpr double kRefillMm = 1;  // so far up a new blob hangs from the nozzle
  const PressTraits& press = traits_.press;
  if (gap_mm > press.blob_mm + kRefillMm) {
    blob_mm_ = press.blob_mm;
    thread_ = false;
  }
  constexpr double kResolvedMm = 1e-9;  // less is the rounding of a head that stands
  const double height_mm = std::max(gap_mm, 0.0);
  if (fell_mm > kResolvedMm && gap_mm < press.blob_mm && height_mm < blob_mm_) {
    blob_force_g_ = press.blob_g * std::pow(1 - height_mm / press.blob_mm, kBlobShape);
    blob_mm_ = height_mm;
  } else {
    blob_force_g_ *= fell_mm < -kResolvedMm ? 0 : std::exp(-dt_s / kFlowS);
  }
  if (gap_mm <= 0) thread_ = true;
  double pull_g = 0;
  if (thread_ && gap_mm > 0) {
    const double x = gap_mm / press.thread_mm;
    pull_g = press.thread_g * x * std::exp(1 - x);
  }
  return blob_force_g_ - pull_g;
}

double LoadCell::Disturbance(double time_s, double gap_mm, double dt_s) {
  const DisturbanceTraits& d = traits_.disturbance;
  const double since_s = time_s - start_s_;
  double force_g = d.drift_g_s * since_s + d.drift_g_mm * gap_mm;
  if (d.wander_g > 0 && dt_s > 0) {
    const double kept = std::exp(-dt_s / d.wander_s);
    wander_g_ = wander_g_ * kept + d.wander_g * std::sqrt(1 - kept * kept) * random_.Normal();
  }
  force_g += wander_g_;
  const std::array<double, 3> hum = {1, d.hum_second, d.hum_third};
  for (std::size_t i = 0; i < hum.size(); ++i) {
    const double harmonic = static_cast<double>(i + 1);
    force_g += d.hum_g * hum[i] *
               std::sin(2 * std::numbers::pi * d.hum_hz * harmonic * since_s + hum_phase_rad_[i]);
  }
  if (d.swing_g > 0) {
    force_g += d.swing_g * std::sin(2 * std::numbers::pi * d.swing_hz * since_s + swing_phase_rad_);
  }
  if (d.slip_g != 0) force_g += slip_.Force(d, gap_mm, dt_s);
  const double cycles = since_s * d.heater_hz + heater_phase_;
  if (cycles - std::floor(cycles) < d.heater_duty) force_g += d.heater_g;
  const double rung_s = time_s - stopped_s_;
  force_g += d.ring_g * stopped_mm_s_ / d.approach_speed_mm_s * std::exp(-rung_s / d.ring_s) *
             std::sin(2 * std::numbers::pi * d.ring_hz * rung_s);
  const double impulse_s = since_s - traits_.faults.impulse_at_s;
  if (impulse_s >= 0 && impulse_s < kImpulseS) {
    force_g += traits_.faults.impulse_g * std::sin(std::numbers::pi * impulse_s / kImpulseS);
  }
  return force_g;
}

double LoadCell::Filtered(double force_g) {
  const auto order = static_cast<std::size_t>(traits_.converter.filter_order);
  for (std::size_t i = 0; i < order; ++i) {
    if (boxcars_[i].empty()) {
      boxcars_[i].assign(kFinePerSample, force_g);
      boxcar_sums_[i] = force_g * kFinePerSample;
    }
    boxcar_sums_[i] += force_g - boxcars_[i][boxcar_at_];
    boxcars_[i][boxcar_at_] = force_g;
    force_g = boxcar_sums_[i] / kFinePerSample;
  }
  boxcar_at_ = (boxcar_at_ + 1) % kFinePerSample;
  return force_g;
}

void LoadCell::NoteTruth(const Fine& now, double bed_g) {
  if (!touching_) return;
  const double span = last_.contact_g - now.contact_g;
  if (last_.contact_g > 0 && now.contact_g <= 0) {
    // Without creep the depth is linear in time while the force may be curved.
    const double share = traits_.press.creep_share > 0
                             ? last_.contact_g / span
                             : last_.depth_mm / (last_.depth_mm - now.depth_mm);
    press_.contact_time_s = std::lerp(last_.time_s, now.time_s, share);
    press_.contact_z_mm = std::lerp(last_.drive_z_mm, now.drive_z_mm, share);
    press_.snap_z_mm = press_.contact_z_mm;
  }
  press_.peak_force_g = std::max(press_.peak_force_g, bed_g);
  if (now.depth_mm > 0 || stuck_) return;
  if (traits_.press.stick_g > 0) press_.snap_z_mm = now.drive_z_mm;
  touching_ = false;
  presses_.push_back(press_);
}

void LoadCell::Step(double time_s, const NozzleAt& nozzle) {
  const NozzleState told = nozzle(time_s);
  if (!begun_) Begin(time_s, told);
  const double dt_s = time_s - last_.time_s;
  const double nozzle_before_mm = nozzle_z_mm_;
  FollowDrive(told.z_mm);
  const double before_mm_s = std::exchange(speed_mm_s_, std::abs(told.velocity_mm_s));
  if (before_mm_s > 0 && speed_mm_s_ == 0) {
    stopped_s_ = time_s;
    stopped_mm_s_ = before_mm_s;
  }
  Fine now{time_s, told.z_mm, told.surface_z_mm - nozzle_z_mm_, 0};
  if (!touching_ && now.depth_mm > 0 && last_.depth_mm <= 0) {
    touching_ = true;
    stuck_ = traits_.press.stick_g > 0;
    const double share = last_.depth_mm / (last_.depth_mm - now.depth_mm);
    press_ = {};
    press_.touch_time_s = std::lerp(last_.time_s, now.time_s, share);
    press_.touch_z_mm = std::lerp(last_.drive_z_mm, now.drive_z_mm, share);
  }
  const double elastic_g = Elastic(now.depth_mm);
  if (traits_.press.creep_share > 0) {
    const double rest_g = traits_.press.creep_share * std::max(elastic_g, 0.0);
    dent_g_ += (rest_g - dent_g_) * (1 - std::exp(-dt_s / traits_.press.creep_s));
  }
  now.contact_g = elastic_g - dent_g_;
  const double bed_g = BedForce(now);
  NoteTruth(now, bed_g);
  const double gap_mm = -now.depth_mm;
  double load_g = bed_g;
  if (traits_.press.strand_g > 0) load_g -= strand_.Pull(traits_.press, gap_mm);
  const DisturbanceTraits& d = traits_.disturbance;
  if (d.mode_share > 0 || d.mode_mass_g > 0) {
    const double acceleration_mm_s2 = dt_s > 0 ? (told.velocity_mm_s - velocity_mm_s_) / dt_s : 0;
    load_g += mode_.Advance(d, bed_g, acceleration_mm_s2, dt_s);
  }
  velocity_mm_s_ = told.velocity_mm_s;
  const ConverterTraits& converter = traits_.converter;
  if (converter.creep_share > 0 || converter.hysteresis_share != 0) {
    load_g = memory_.Advance(converter, load_g, dt_s);
  }
  double force_g = load_g + Disturbance(time_s, gap_mm, dt_s);
  if (traits_.press.blob_g > 0 || traits_.press.thread_g > 0) {
    force_g += PlasticForce(gap_mm, nozzle_before_mm - nozzle_z_mm_, dt_s);
  }
  force_g_ = Filtered(force_g);
  last_ = now;
}

double HaltZ(const CellTraits& traits, const TapMotion& motion, double surface_z_mm,
             Random& random) {
  const ConverterTraits& converter = traits.converter;
  const double trigger_mm = TriggerDepth(traits.press, motion.trigger_force_g);
  // The triggering sample is the first after the crossing, delayed by its filter.
  const double late_s = (random.Uniform() + 0.5 * converter.filter_order) / converter.rate_hz +
                        std::max(0.0, converter.latency_s) + motion.stop_latency_s;
  return surface_z_mm - BacklashOf(traits.press) - trigger_mm - motion.approach_speed_mm_s * late_s;
}

SampleCorruptor::SampleCorruptor(const CellTraits& traits, double first_time_s, Random random)
    : traits_(traits),
      first_time_s_(first_time_s),
      random_(random),
      stamps_(random.Fork(kStampStream)),
      hold_phase_(stamps_.Uniform()) {}

void SampleCorruptor::Hold(CellSample& sample) {
  const SampleFaults& faults = traits_.faults;
  bool held = false;
  if (faults.held_regularly) {
    // The converter advances for a share 1 - held_share of the samples that the host reads.
    hold_phase_ += 1 - faults.held_share;
    held = hold_phase_ < 1;
    hold_phase_ -= std::floor(hold_phase_);
  } else {
    held = stamps_.Uniform() < faults.held_share;
  }
  if (!held || !has_last_) return;
  sample.counts = last_.counts;
  sample.force_g = last_.force_g;
  if (faults.held_times) sample.time_s = last_.time_s;
}

void SampleCorruptor::Stamp(CellSample& sample) {
  const SampleFaults& faults = traits_.faults;
  const double since_s = sample.time_s - first_time_s_;
  if (faults.jitter > 0) {
    sample.time_s += faults.jitter * stamps_.Uniform(-0.5, 0.5) / traits_.converter.rate_hz;
  }
  if (since_s >= faults.clock_step_at_s) sample.time_s += faults.clock_step_s;
}

bool SampleCorruptor::Pass(CellSample& sample) {
  const SampleFaults& faults = traits_.faults;
  const double since_s = sample.time_s - first_time_s_;
  const bool dropped = random_.Uniform() < faults.drop_share;
  const bool minus_one = random_.Uniform() < faults.minus_one_share;
  const bool same_time = random_.Uniform() < faults.duplicate_time_share;
  if (dropped || (since_s >= faults.gap_at_s && since_s < faults.gap_at_s + faults.gap_s)) {
    return false;
  }
  if (minus_one) {
    sample.counts = -1;
    sample.force_g = -1 / traits_.converter.counts_per_g;
  }
  const bool stuck = since_s >= faults.stuck_at_s && since_s < faults.stuck_at_s + faults.stuck_s;
  if (stuck && has_last_) {
    sample.counts = last_.counts;
    sample.force_g = last_.force_g;
  }
  Stamp(sample);
  if (faults.held_share > 0) Hold(sample);
  if (same_time && has_last_) sample.time_s = last_.time_s;
  last_ = sample;
  has_last_ = true;
  return true;
}

SimulatedTap SimulateTap(const CellTraits& traits, const TapScene& scene, Random& random) {
  TRAMMEL_CHECK(scene.press_mm >= 0, "press_mm = {}", scene.press_mm);
  const TapMotion& motion = scene.motion;
  const double halt_z_mm = scene.press_mm > 0
                               ? scene.surface_z_mm - BacklashOf(traits.press) - scene.press_mm
                               : HaltZ(traits, motion, scene.surface_z_mm, random);
  SimulatedTap tap;
  tap.moves = ApproachMoves(motion, scene.start_time_s,
                            scene.surface_z_mm + motion.approach_from_mm, halt_z_mm);
  const double stop_s = tap.moves.back().start_time_s + tap.moves.back().duration_s;
  const std::vector<ZMove> back = PullBackMoves(motion, stop_s, halt_z_mm);
  tap.moves.insert(tap.moves.end(), back.begin(), back.end());
  const double touch_s = stop_s - (scene.surface_z_mm - halt_z_mm) / motion.approach_speed_mm_s;
  const double from_s = touch_s - scene.lead_s;
  const double until_s = back.back().start_time_s + back.back().duration_s + scene.tail_s;
  LoadCell cell(traits, from_s, random.Fork(1));
  SampleCorruptor corruptor(traits, from_s, random.Fork(2));
  (void)random.Bits();  // the forks of the next tap are others
  const NozzleAt nozzle = [&](double time_s) -> NozzleState {
    const ZState z = StateAt(tap.moves, time_s);
    return {z.z_mm, z.velocity_mm_s, scene.surface_z_mm};
  };
  while (cell.next_time_s() < until_s) {
    CellSample sample = cell.Next(nozzle);
    if (!corruptor.Pass(sample)) continue;
    tap.time_s.push_back(sample.time_s);
    tap.force_g.push_back(sample.force_g);
  }
  const std::vector<PressTruth> presses = cell.TakePresses();
  if (!presses.empty()) tap.truth = presses.back();
  tap.latency_s = cell.latency_s();
  return tap;
}

}  // namespace trammel::sim
