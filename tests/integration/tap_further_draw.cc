// Draws taps of printers that a user could have.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tap_further_rows.h"

namespace trammel {
namespace {

double LogUniform(Random& random, double lo, double hi) {
  return lo * std::pow(hi / lo, random.Uniform());
}

void DrawLaw(sim::ContactLaw& law, Random& random) {
  law = {};
  law.stiffness_g_mm = LogUniform(random, 500, 8000);
  law.kind = static_cast<sim::ContactKind>(random.Below(6));
  law.knee = random.Uniform(0.2, 0.9);
  switch (law.kind) {
    case sim::ContactKind::kLinear:
    case sim::ContactKind::kYielding:
      break;
    case sim::ContactKind::kQuadratic:
      law.share = random.Uniform(-0.35, 0.6);
      break;
    case sim::ContactKind::kCubic:
      law.share = random.Uniform(-0.2, 0.6);
      break;
    case sim::ContactKind::kPower:
      law.exponent = random.Uniform(0.7, 1.7);
      break;
    case sim::ContactKind::kTwoSlope:
      law.share = random.Uniform(-0.5, 1.5);
      break;
  }
}

// Cell, converter and motion without disturbances. The law's depth is that of the press.
void DrawPlain(TapRow& row, Random& random) {
  sim::CellTraits& cell = row.cell;
  cell = {};
  DrawLaw(cell.press.law, random);
  const double press_mm =
      std::clamp(LogUniform(random, 30, 300) / cell.press.law.stiffness_g_mm, 0.01, 0.4);
  cell.press.law.reference_mm = press_mm;
  cell.disturbance.noise_g = LogUniform(random, 0.02, 20);
  cell.converter.rate_hz = LogUniform(random, 40, 8000);
  cell.converter.filter_order = static_cast<int>(random.Below(5));
  cell.converter.sign = random.Uniform() < 0.5 ? 1 : -1;
  cell.converter.offset_g = random.Uniform(-500, 500);
  sim::TapScene& scene = row.scene;
  scene = {};
  scene.press_mm = press_mm;
  scene.motion.approach_speed_mm_s = LogUniform(random, 0.5, 10);
  scene.motion.acceleration_mm_s2 = LogUniform(random, 20, 5000);
  scene.motion.pull_back_mm = LogUniform(random, 1.3 * press_mm, std::max(2.0, 2 * press_mm));
  scene.motion.pull_back_speed_mm_s = LogUniform(random, 0.03, 3);
  // A recording has at most 20000 samples, as nobody waits for more.
  const double lasts_s = scene.motion.pull_back_mm / scene.motion.pull_back_speed_mm_s + 1;
  cell.converter.rate_hz = std::min(cell.converter.rate_hz, 20000 / lasts_s);
  cell.converter.rate_hz = std::max(cell.converter.rate_hz, 40.0);
  row.latency_known = random.Uniform() < 0.7;
}

constexpr int kDisturbances = 17;

void Disturb(int which, TapRow& row, Random& random) {
  sim::CellTraits& cell = row.cell;
  sim::DisturbanceTraits& d = cell.disturbance;
  switch (which) {
    case 0:
      cell.press.law.toe_mm = LogUniform(random, 0.001, 0.03);
      cell.press.law.toe_share = random.Uniform(0.1, 0.5);
      cell.press.law.toe_rounding = random.Uniform(0, 1);
      break;
    case 1:
      d.mode_hz = LogUniform(random, 5, 40);
      d.mode_share = LogUniform(random, 0.01, 0.5);
      d.mode_mass_g = random.Uniform(0, 300);
      d.mode_damping = LogUniform(random, 0.01, 0.2);
      break;
    case 2:
      d.swing_hz = LogUniform(random, 5, 40);
      d.swing_g = LogUniform(random, 0.2, 5);
      break;
    case 3:
      cell.press.strand_g = LogUniform(random, 1, 30);
      cell.press.strand_onset_mm = LogUniform(random, 0.0005, 0.02);
      cell.press.strand_length_mm = LogUniform(random, 0.03, 0.5);
      cell.press.strand_snap_mm = LogUniform(random, 0.02, 0.5);
      break;
    case 4:
      d.slip_g = random.Uniform(-20, 20);
      d.slip_above_mm = LogUniform(random, 0.001, 0.1);
      d.slip_s = LogUniform(random, 0.0003, 0.02);
      break;
    case 5:
      cell.faults.held_share = random.Uniform(0.05, 0.8);
      cell.faults.held_regularly = random.Uniform() < 0.5;
      cell.faults.held_times = random.Uniform() < 0.4;
      break;
    case 6:
      cell.converter.counts_per_g = 1 / LogUniform(random, 0.1, 5);
      break;
    case 7:
      cell.faults.jitter = random.Uniform(0, 1);
      break;
    case 8:
      d.pink_g = LogUniform(random, 0.1, 5);
      break;
    case 9:
      d.wander_g = LogUniform(random, 0.2, 10);
      d.wander_s = LogUniform(random, 0.3, 10);
      break;
    case 10:
      d.hum_hz = random.Uniform() < 0.5 ? 50 : 60;
      d.hum_g = LogUniform(random, 0.2, 10);
      d.hum_second = random.Uniform(0, 0.6);
      d.hum_third = random.Uniform(0, 0.4);
      break;
    case 11:
      cell.converter.latency_s = LogUniform(random, 0.0005, 0.02);
      break;
    case 12:
      cell.converter.creep_share = LogUniform(random, 0.002, 0.05);
      cell.converter.hysteresis_share = random.Uniform(-0.02, 0.02);
      break;
    case 13:
      cell.press.onset = random.Uniform() < 0.5 ? sim::Onset::kFlat : sim::Onset::kCurved;
      cell.press.onset_travel_mm = LogUniform(random, 0.001, 0.02);
      break;
    case 14:
      d.drift_g_s = random.Normal(0, 20);
      d.drift_g_mm = random.Normal(0, 30);
      break;
    case 15:
      cell.press.creep_share = random.Uniform(0, 0.1);
      cell.press.creep_s = LogUniform(random, 0.03, 1);
      break;
    default:
      cell.faults.drop_share = LogUniform(random, 0.01, 0.3);
  }
}

}  // namespace

void DrawOrdinaryTap(TapRow& row, Random& random) {
  DrawPlain(row, random);
  for (std::uint64_t i = random.Below(3); i > 0; --i) {
    Disturb(static_cast<int>(random.Below(kDisturbances)), row, random);
  }
}

void DrawAnyTap(TapRow& row, Random& random) {
  DrawPlain(row, random);
  for (int which = 0; which < kDisturbances; ++which) {
    if (random.Uniform() < 1.0 / 3) Disturb(which, row, random);
  }
}

std::string Describe(const TapRow& row) {
  const sim::CellTraits& c = row.cell;
  const sim::PressTraits& p = c.press;
  const sim::DisturbanceTraits& d = c.disturbance;
  const sim::TapMotion& m = row.scene.motion;
  std::string text = fmt::format(
      "{:.2g} gf, {:.0f}/s, filter {}, {} {:.0f} gf/mm (share {:.2f}, n {:.2f}, knee {:.2f}), "
      "press "
      "{:.0f} um, back {:.2f} mm at {:.2f} mm/s, {:.0f} mm/s2, approach {:.1f} mm/s",
      d.noise_g, c.converter.rate_hz, c.converter.filter_order, sim::ToString(p.law.kind),
      p.law.stiffness_g_mm, p.law.share, p.law.exponent, p.law.knee, kUmPerMm * row.scene.press_mm,
      m.pull_back_mm, m.pull_back_speed_mm_s, m.acceleration_mm_s2, m.approach_speed_mm_s);
  const auto add = [&](bool there, const char* what, double first, double second = std::nan("")) {
    if (!there) return;
    text += fmt::format("; {} {:.3g}", what, first);
    if (std::isfinite(second)) text += fmt::format(", {:.3g}", second);
  };
  add(!row.latency_known, "latency unknown, ms", 1e3 * c.converter.latency_s);
  add(row.latency_known && c.converter.latency_s > 0, "latency ms", 1e3 * c.converter.latency_s);
  add(p.law.toe_mm > 0, "toe um, share", kUmPerMm * p.law.toe_mm, p.law.toe_share);
  add(p.onset == sim::Onset::kFlat, "backlash um", kUmPerMm * p.onset_travel_mm);
  add(p.onset == sim::Onset::kCurved, "friction um", kUmPerMm * p.onset_travel_mm);
  add(p.creep_share > 0, "bed creeps", p.creep_share, p.creep_s);
  add(p.strand_g > 0, "strand gf, snap mm", p.strand_g, p.strand_snap_mm);
  add(d.mode_share > 0, "rings Hz, share", d.mode_hz, d.mode_share);
  add(d.swing_g > 0, "swings Hz, gf", d.swing_hz, d.swing_g);
  add(d.slip_g != 0, "slip gf, um", d.slip_g, kUmPerMm * d.slip_above_mm);
  add(d.pink_g > 0, "1/f gf", d.pink_g);
  add(d.wander_g > 0, "wander gf, s", d.wander_g, d.wander_s);
  add(d.hum_g > 0, "hum gf, Hz", d.hum_g, d.hum_hz);
  add(d.drift_g_s != 0, "drift gf/s, gf/mm", d.drift_g_s, d.drift_g_mm);
  add(c.converter.creep_share > 0, "cell creeps, hysteresis", c.converter.creep_share,
      c.converter.hysteresis_share);
  add(c.converter.counts_per_g < 50, "counts gf", 1 / c.converter.counts_per_g);
  add(c.faults.held_share > 0, c.faults.held_regularly ? "held in turn" : "held",
      c.faults.held_share);
  add(c.faults.held_times, "with times", 1);
  add(c.faults.jitter > 0, "jitter", c.faults.jitter);
  add(c.faults.drop_share > 0, "drops", c.faults.drop_share);
  return text;
}

}  // namespace trammel
