#include "sim/cell/cell_traits.h"

#include <cmath>
#include <map>

#include "sim/print/field_bound.h"

namespace trammel::sim {
namespace {

Result<void> CheckPress(const PressTraits& p) {
  // Softer than this the law would fall before its reference depth.
  const double softest = p.law.kind == ContactKind::kCubic      ? -0.3
                         : p.law.kind == ContactKind::kTwoSlope ? -0.95
                                                                : -0.45;
  return CheckBounds("load cell trait",
                     {{"press.law.stiffness_g_mm", p.law.stiffness_g_mm, 1, 1e6},
                      {"press.law.reference_mm", p.law.reference_mm, 1e-4, 1},
                      {"press.law.share", p.law.share, softest, 5},
                      {"press.law.exponent", p.law.exponent, 0.4, 3},
                      {"press.law.knee", p.law.knee, 0.05, 20},
                      {"press.law.toe_mm", p.law.toe_mm, 0, 0.2},
                      {"press.law.toe_share", p.law.toe_share, 0.02, 1},
                      {"press.law.toe_rounding", p.law.toe_rounding, 0, 1},
                      {"press.law.sheet_gap_mm", p.law.sheet_gap_mm, 0, 1},
                      {"press.law.sheet_stiffness_g_mm", p.law.sheet_stiffness_g_mm, 0, 1e5},
                      {"press.onset_travel_mm", p.onset_travel_mm, 0, 0.1},
                      {"press.creep_share", p.creep_share, 0, 0.5},
                      {"press.creep_s", p.creep_s, 1e-3, 100},
                      {"press.stick_g", p.stick_g, 0, 1e4},
                      {"press.blob_g", p.blob_g, 0, 1e4},
                      {"press.blob_mm", p.blob_mm, 1e-3, 5},
                      {"press.thread_g", p.thread_g, 0, 1e4},
                      {"press.thread_mm", p.thread_mm, 1e-3, 5},
                      {"press.strand_g", p.strand_g, 0, 1e4},
                      {"press.strand_onset_mm", p.strand_onset_mm, 1e-6, 5},
                      {"press.strand_length_mm", p.strand_length_mm, 1e-3, 100},
                      {"press.strand_snap_mm", p.strand_snap_mm, 1e-3, 5}});
}

Result<void> CheckDisturbance(const DisturbanceTraits& d) {
  return CheckBounds("load cell trait",
                     {{"disturbance.noise_g", d.noise_g, 0, 1e4},
                      {"disturbance.pink_g", d.pink_g, 0, 1e4},
                      {"disturbance.approach_noise_g", d.approach_noise_g, 0, 1e4},
                      {"disturbance.approach_speed_mm_s", d.approach_speed_mm_s, 0.01, 100},
                      {"disturbance.drift_g_s", d.drift_g_s, -1e4, 1e4},
                      {"disturbance.drift_g_mm", d.drift_g_mm, -1e4, 1e4},
                      {"disturbance.wander_g", d.wander_g, 0, 1e4},
                      {"disturbance.wander_s", d.wander_s, 1e-3, 1e4},
                      {"disturbance.hum_g", d.hum_g, 0, 1e4},
                      {"disturbance.hum_hz", d.hum_hz, 1, 1000},
                      {"disturbance.hum_second", d.hum_second, 0, 10},
                      {"disturbance.hum_third", d.hum_third, 0, 10},
                      {"disturbance.ring_g", d.ring_g, 0, 1e4},
                      {"disturbance.ring_hz", d.ring_hz, 0.1, 1e4},
                      {"disturbance.ring_s", d.ring_s, 1e-3, 100},
                      {"disturbance.mode_share", d.mode_share, 0, 1},
                      {"disturbance.mode_mass_g", d.mode_mass_g, 0, 1e5},
                      {"disturbance.mode_hz", d.mode_hz, 0.5, 1e4},
                      {"disturbance.mode_damping", d.mode_damping, 1e-4, 0.9},
                      {"disturbance.swing_g", d.swing_g, 0, 1e4},
                      {"disturbance.swing_hz", d.swing_hz, 0.1, 1e4},
                      {"disturbance.slip_g", d.slip_g, -1e4, 1e4},
                      {"disturbance.slip_above_mm", d.slip_above_mm, -1, 5},
                      {"disturbance.slip_s", d.slip_s, 1e-6, 10},
                      {"disturbance.heater_g", d.heater_g, -1e4, 1e4},
                      {"disturbance.heater_hz", d.heater_hz, 0.01, 1000},
                      {"disturbance.heater_duty", d.heater_duty, 0, 1}});
}

Result<void> CheckConverter(const ConverterTraits& c) {
  return CheckBounds("load cell trait",
                     {{"converter.rate_hz", c.rate_hz, 5, 1e5},
                      {"converter.filter_order", static_cast<double>(c.filter_order), 0, 5},
                      {"converter.counts_per_g", c.counts_per_g, 0.01, 1e5},
                      {"converter.sign squared", c.sign * c.sign, 1, 1},
                      {"converter.offset_g", c.offset_g, -1e6, 1e6},
                      {"converter.saturation_g", c.saturation_g, 1, 1e7},
                      {"converter.latency_s", c.latency_s, -0.02, 0.1},
                      {"converter.creep_share", c.creep_share, 0, 0.5},
                      {"converter.creep_s", c.creep_s, 1e-3, 100},
                      {"converter.hysteresis_share", c.hysteresis_share, -0.5, 0.5}});
}

Result<void> CheckFaults(const SampleFaults& f) {
  return CheckBounds("load cell trait",
                     {{"faults.drop_share", f.drop_share, 0, 1},
                      {"faults.duplicate_time_share", f.duplicate_time_share, 0, 1},
                      {"faults.held_share", f.held_share, 0, 1},
                      {"faults.jitter", f.jitter, 0, 2},
                      {"faults.clock_step_s", f.clock_step_s, -1, 1},
                      {"faults.minus_one_share", f.minus_one_share, 0, 1},
                      {"faults.stuck_s", f.stuck_s, 0, 1e6},
                      {"faults.gap_s", f.gap_s, 0, 1e6},
                      {"faults.impulse_g", f.impulse_g, -1e5, 1e5}});
}

CellTraits With(void (*change)(CellTraits&)) {
  CellTraits traits;
  change(traits);
  return traits;
}

// Laws reach 3500 gf/mm x 45 um at 45 um, but for the share that they are named after.
const std::map<std::string, CellTraits, std::less<>>& Named() {
  static const std::map<std::string, CellTraits, std::less<>> named = {
      {"reference", CellTraits{}},
      {"stiffening", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kQuadratic;
         t.press.law.share = 0.5;
       })},
      {"softening", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kQuadratic;
         t.press.law.share = -0.3;
       })},
      {"power-1.25", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kPower;
         t.press.law.exponent = 1.25;
       })},
      {"hertz", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kPower;
         t.press.law.exponent = 1.5;
       })},
      {"cubic", With([](CellTraits& t) {
         t.press.law.kind = ContactKind::kCubic;
         t.press.law.share = 0.5;
       })},
      {"noisy", With([](CellTraits& t) { t.disturbance.noise_g = 8; })},
      {"drifting", With([](CellTraits& t) { t.disturbance.drift_g_s = 20; })},
      {"humming", With([](CellTraits& t) {
         t.disturbance.hum_g = 4;
         t.disturbance.hum_second = 0.5;
         t.disturbance.hum_third = 0.3;
       })},
      {"heating", With([](CellTraits& t) { t.disturbance.heater_g = 4; })},
      {"creeping", With([](CellTraits& t) { t.press.creep_share = 0.08; })},
      {"backlash", With([](CellTraits& t) {
         t.press.onset = Onset::kFlat;
         t.press.onset_travel_mm = 0.004;
       })},
      {"friction", With([](CellTraits& t) {
         t.press.onset = Onset::kCurved;
         t.press.onset_travel_mm = 0.004;
       })},
      {"slow", With([](CellTraits& t) {
         t.converter.rate_hz = 80;
         t.converter.filter_order = 4;
       })},
      {"oozing", With([](CellTraits& t) {
         t.press.blob_g = 40;
         t.press.thread_g = 15;
       })},
      {"sticking", With([](CellTraits& t) { t.press.stick_g = 40; })},
      {"loose-sheet", With([](CellTraits& t) {
         t.press.law.sheet_gap_mm = 0.02;
         t.press.law.sheet_stiffness_g_mm = 700;
       })},
      {"soft-toe", With([](CellTraits& t) {
         t.press.law.toe_mm = 0.008;
         t.press.law.toe_share = 0.2;
         t.press.law.toe_rounding = 0.5;
       })},
      {"ringing", With([](CellTraits& t) {
         t.disturbance.mode_share = 0.1;
         t.disturbance.mode_mass_g = 100;
       })},
      {"swinging", With([](CellTraits& t) { t.disturbance.swing_g = 3; })},
      {"stringing", With([](CellTraits& t) { t.press.strand_g = 10; })},
      {"slipping", With([](CellTraits& t) { t.disturbance.slip_g = 8; })},
      {"late", With([](CellTraits& t) { t.converter.latency_s = 0.01; })},
      {"coarse", With([](CellTraits& t) { t.converter.counts_per_g = 0.5; })},
      {"held", With([](CellTraits& t) {
         t.faults.held_share = 0.5;
         t.faults.held_regularly = true;
       })},
      {"jittering", With([](CellTraits& t) { t.faults.jitter = 1; })},
      {"dropping", With([](CellTraits& t) { t.faults.drop_share = 0.1; })},
      {"minus-one", With([](CellTraits& t) {
         t.faults.minus_one_share = 0.02;
         t.converter.offset_g = 120;
       })},
  };
  return named;
}

PressTraits DrawPress(Random& random) {
  PressTraits press;
  ContactLaw& law = press.law;
  law.stiffness_g_mm = random.Uniform(2000, 6000);
  law.kind = static_cast<ContactKind>(random.Below(4));
  law.share =
      law.kind == ContactKind::kCubic ? random.Uniform(-0.15, 0.5) : random.Uniform(-0.3, 0.5);
  law.exponent = random.Uniform(1, 1.5);
  press.onset = static_cast<Onset>(random.Below(3));
  press.onset_travel_mm = press.onset == Onset::kInstant ? 0 : random.Uniform(0.0005, 0.004);
  press.creep_share = random.Uniform(0, 0.04);
  press.creep_s = random.Uniform(0.05, 0.5);
  return press;
}

}  // namespace

Result<void> Validate(const CellTraits& traits) {
  for (const Result<void>& checked :
       {CheckPress(traits.press), CheckDisturbance(traits.disturbance),
        CheckConverter(traits.converter), CheckFaults(traits.faults)}) {
    if (!checked) return checked;
  }
  return {};
}

CellTraits DrawCellTraits(Random& random) {
  constexpr double kRatesHz[] = {80, 320, 331.7, 400, 500, 1000, 2000};
  CellTraits traits;
  traits.press = DrawPress(random);
  traits.disturbance.noise_g = random.Uniform(0.8, 4);
  traits.disturbance.approach_noise_g = random.Uniform(0, 4);
  traits.disturbance.drift_g_s = random.Normal(0, 4);
  traits.disturbance.drift_g_mm = random.Normal(0, 10);
  traits.disturbance.wander_g = random.Uniform(0, 1);
  traits.disturbance.ring_g = random.Uniform(0, 6);
  traits.disturbance.ring_hz = random.Uniform(30, 120);
  traits.disturbance.hum_hz = random.Uniform() < 0.5 ? 50 : 60;
  traits.disturbance.hum_g = random.Uniform(0, 1);
  traits.converter.rate_hz = kRatesHz[random.Below(std::size(kRatesHz))];
  traits.converter.filter_order = static_cast<int>(random.Below(5));
  traits.converter.sign = random.Uniform() < 0.5 ? 1 : -1;
  traits.converter.offset_g = random.Uniform(-2000, 2000);
  return traits;
}

std::vector<std::string> CellNames() {
  std::vector<std::string> names;
  for (const auto& [name, traits] : Named()) names.push_back(name);
  return names;
}

Result<CellTraits> CellByName(std::string_view name) {
  const auto found = Named().find(name);
  if (found != Named().end()) return found->second;
  std::string known;
  for (const std::string& candidate : CellNames()) {
    known += (known.empty() ? "" : ", ") + candidate;
  }
  return Fail(
      fmt::format("there is no load cell \"{}\"; choose one of {}", name.substr(0, 60), known));
}

}  // namespace trammel::sim
