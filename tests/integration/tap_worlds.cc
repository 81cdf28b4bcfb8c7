#include "tap_worlds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trammel {
namespace {

using sim::CellTraits;
using sim::ContactKind;
using sim::DisturbanceTraits;

constexpr double kMm = 1e-3;  // per micrometre

/// A group under construction.
struct Group {
  TapWorlds group;

  TapWorld& Add(std::string name, Promise promise) {
    group.worlds.push_back({.name = std::move(name), .promise = promise});
    return group.worlds.back();
  }
  CellTraits& Cell(std::string name, Promise promise) { return Add(std::move(name), promise).cell; }
  DisturbanceTraits& Noise(std::string name, Promise promise, double noise_g) {
    DisturbanceTraits& traits = Cell(std::move(name), promise).disturbance;
    traits.noise_g = noise_g;
    return traits;
  }
};

TapWorlds Laws() {
  Group g{{"form of the press", {}}};
  for (const auto& [cell, promise] : {std::pair{"reference", Promise::kUnbiased},
                                      {"stiffening", Promise::kUnbiased},
                                      {"softening", Promise::kUnbiased},
                                      {"power-1.25", Promise::kCovered},
                                      {"hertz", Promise::kCovered},
                                      {"cubic", Promise::kCovered}}) {
    g.Cell(cell, promise) = sim::CellByName(cell).value();
  }
  for (const double exponent : {0.7, 1.7}) {
    sim::ContactStiffness& law =
        g.Cell(fmt::format("power {}", exponent), Promise::kCovered).press.law;
    law.kind = ContactKind::kPower;
    law.exponent = exponent;
  }
  for (const double change : {-0.5, 2.0}) {
    sim::ContactStiffness& law =
        g.Cell(fmt::format("slope {:+.0f} % deeper down", 100 * change), Promise::kMayRefuse)
            .press.law;
    law.kind = ContactKind::kTwoSlope;
    law.share = change;
  }
  sim::ContactStiffness& yielding = g.Cell("yields", Promise::kCovered).press.law;
  yielding.kind = ContactKind::kYielding;
  yielding.knee = 0.3;
  for (const double stiffness : {500.0, 8000.0}) {
    TapWorld& world = g.Add(fmt::format("{} gf/mm, trigger 75 gf", stiffness), Promise::kCovered);
    world.cell.press.law.stiffness_g_mm = stiffness;
    world.scene.press_mm = 0;
    world.scene.motion.pull_back_mm = 0.1 + 150 / stiffness;
  }
  return g.group;
}

TapWorlds Noises() {
  Group g{{"noise", {}}};
  for (const double noise_g : {0.02, 0.3, 5.0}) {
    g.Noise(fmt::format("{} gf", noise_g), Promise::kUnbiased, noise_g);
  }
  g.Noise("8 gf", Promise::kCovered, 8);
  g.Noise("20 gf", Promise::kMayRefuse, 20);
  g.Noise("1/f 3 gf", Promise::kMayRefuse, 0.5).pink_g = 3;
  g.Noise("wander 5 gf in 1 s", Promise::kMayRefuse, 0.5).wander_g = 5;
  g.Noise("drift 60 gf/s", Promise::kMayRefuse, 0.5).drift_g_s = 60;
  g.Noise("heater steps 4 gf", Promise::kMayRefuse, 2).heater_g = 4;
  g.Noise("approach 8 gf", Promise::kMayRefuse, 2).approach_noise_g = 8;
  for (const double hum_g : {0.5, 8.0}) {
    DisturbanceTraits& hum = g.Noise(fmt::format("hum {} gf", hum_g), Promise::kMayRefuse, 0.3);
    hum.hum_g = hum_g;
    hum.hum_hz = 49.8;
    hum.hum_second = 0.5;
    hum.hum_third = 0.3;
  }
  return g.group;
}

TapWorlds Motions() {
  Group g{{"pull-back and drive", {}}};
  for (const double speed : {0.03, 1.0, 3.0}) {
    g.Add(fmt::format("{} mm/s", speed), speed > 1 ? Promise::kMayRefuse : Promise::kUnbiased)
        .scene.motion.pull_back_speed_mm_s = speed;
  }
  for (const double mm : {0.06, 0.5, 2.0}) {
    g.Add(fmt::format("{} mm", mm), mm < 0.1 ? Promise::kMayRefuse : Promise::kUnbiased)
        .scene.motion.pull_back_mm = mm;
  }
  g.Add("3 mm/s2", Promise::kCovered).scene.motion.acceleration_mm_s2 = 3;
  TapWorld& brief = g.Add("press of 20 um, 4 gf", Promise::kCovered);
  brief.cell.disturbance.noise_g = 4;
  brief.scene.press_mm = 0.02;
  brief.within_um = 3;
  for (const double um : {4.0, 20.0}) {
    for (const auto& [what, onset] :
         {std::pair{"backlash", sim::Onset::kFlat}, {"friction", sim::Onset::kCurved}}) {
      sim::PressTraits& press =
          g.Cell(fmt::format("{} {} um", what, um), Promise::kMayRefuse).press;
      press.onset = onset;
      press.onset_travel_mm = um * kMm;
    }
  }
  g.Cell("creep of the bed 8 %", Promise::kMayRefuse).press.creep_share = 0.08;
  return g.group;
}

TapWorlds Converters() {
  Group g{{"converter", {}}};
  for (const double rate : {40.0, 2000.0, 8000.0}) {
    g.Cell(fmt::format("{} samples/s", rate), rate < 160 ? Promise::kMayRefuse : Promise::kUnbiased)
        .converter.rate_hz = rate;
  }
  TapWorld& hx711 = g.Add("HX711: 80 samples/s, sinc filter, 0.1 mm/s", Promise::kCovered);
  hx711.cell = sim::CellByName("slow").value();
  hx711.scene.motion.pull_back_speed_mm_s = 0.1;
  for (const auto& [step_g, noise_g] : {std::pair{0.5, 0.1}, {2.0, 0.5}, {5.0, 2.0}}) {
    CellTraits& cell =
        g.Cell(fmt::format("counts of {} gf, {} gf", step_g, noise_g), Promise::kMayRefuse);
    cell.converter.counts_per_g = 1 / step_g;
    cell.disturbance.noise_g = noise_g;
  }
  for (const int order : {1, 4}) {
    CellTraits& cell =
        g.Cell(fmt::format("filter of {} samples, 0.1 gf", order), Promise::kMayRefuse);
    cell.converter.filter_order = order;
    cell.disturbance.noise_g = 0.1;
  }
  CellTraits& creep = g.Cell("creep and hysteresis 5 %", Promise::kMayRefuse);
  creep.converter.creep_share = 0.05;
  creep.converter.hysteresis_share = 0.05;
  return g.group;
}

TapWorlds Latencies() {
  Group g{{"latency, not given", {}}};
  for (const double ms : {-3.0, 5.0, 20.0}) {
    for (const double approach_mm_s : {0.5, 2.0, 8.0}) {
      TapWorld& world =
          g.Add(fmt::format("{} ms, approach at {} mm/s", ms, approach_mm_s), Promise::kMayRefuse);
      world.cell.converter.latency_s = ms * 1e-3;
      world.scene.motion.approach_speed_mm_s = approach_mm_s;
    }
  }
  TapWorld& backlash = g.Add("8 ms, backlash 6 um", Promise::kMayRefuse);
  backlash.cell.converter.latency_s = 8e-3;
  backlash.cell.press.onset = sim::Onset::kFlat;
  backlash.cell.press.onset_travel_mm = 0.006;
  g.Add("of a filter of 4 samples", Promise::kMayRefuse).cell.converter.filter_order = 4;
  for (TapWorld& world : g.group.worlds) world.latency_known = false;
  return g.group;
}

TapWorlds Stamps() {
  Group g{{"time stamps and lost samples", {}}};
  for (const double share : {0.1, 0.5}) {
    g.Cell(fmt::format("{:.0f} % dropped", 100 * share), Promise::kMayRefuse).faults.drop_share =
        share;
  }
  for (const double share : {0.3, 0.8}) {
    sim::SampleFaults& faults =
        g.Cell(fmt::format("{:.0f} % held", 100 * share), Promise::kMayRefuse).faults;
    faults.held_share = share;
    faults.held_regularly = share > 0.5;
    g.Cell(fmt::format("{:.0f} % held with their times", 100 * share), Promise::kMayRefuse)
        .faults = {.held_share = share, .held_times = true};
  }
  g.Cell("5 % duplicate times", Promise::kMayRefuse).faults.duplicate_time_share = 0.05;
  g.Cell("jitter of an interval", Promise::kMayRefuse).faults.jitter = 1;
  for (const double ms : {1.0, -5.0, 20.0}) {
    sim::SampleFaults& faults =
        g.Cell(fmt::format("clock steps {} ms", ms), Promise::kMayRefuse).faults;
    faults.clock_step_at_s = 0.66;  // amid the release
    faults.clock_step_s = ms * 1e-3;
  }
  CellTraits& minus_one = g.Cell("2 % -1 frames", Promise::kMayRefuse);
  minus_one.faults.minus_one_share = 0.02;
  minus_one.converter.offset_g = 120;
  return g.group;
}

TapWorlds Toes() {
  Group g{{"soft toe", {}}};
  const auto add = [&g](double um, double share, double noise_g, Promise promise) {
    CellTraits& cell = g.Cell(fmt::format("{} um at {} of k, {} gf", um, share, noise_g), promise);
    cell.disturbance.noise_g = noise_g;
    cell.press.law.toe_mm = um * kMm;
    cell.press.law.toe_share = share;
    cell.press.law.toe_rounding = um < 4 ? 0 : 0.5;
    return &cell.press.law;
  };
  for (const double share : {0.1, 0.2, 0.5}) add(5, share, 0.5, Promise::kMayRefuse);
  add(10, 0.2, 2, Promise::kMayRefuse);
  add(30, 0.5, 2, Promise::kMayRefuse);
  add(10, 0.1, 0.5, Promise::kMayRefuse)->toe_kind = sim::ToeKind::kExponential;
  for (const auto& [um, share, noise_g] :
       {std::tuple{3.0, 0.1, 0.5}, {3.0, 0.2, 2.0}, {5.0, 0.1, 2.0}, {10.0, 0.1, 2.0}}) {
    add(um, share, noise_g, Promise::kHidden);
  }
  return g.group;
}

TapWorlds Disturbances() {
  Group g{{"structure and plastic", {}}};
  for (const double hz : {5.0, 12.0, 40.0}) {
    DisturbanceTraits& rings =
        g.Noise(fmt::format("rings at {} Hz with 12 %", hz), Promise::kMayRefuse, 2);
    rings.mode_hz = hz;
    rings.mode_share = 0.12;
    rings.mode_mass_g = 100;
    DisturbanceTraits& swings =
        g.Noise(fmt::format("swings at {} Hz by 3 gf", hz), Promise::kMayRefuse, 2);
    swings.swing_hz = hz;
    swings.swing_g = 3;
  }
  for (const double slip_g : {5.0, -5.0, 20.0}) {
    DisturbanceTraits& slip =
        g.Noise(fmt::format("slip of {} gf at 10 um", slip_g), Promise::kMayRefuse, 2);
    slip.slip_g = slip_g;
    slip.slip_above_mm = 0.01;
  }
  for (const double pull_g : {5.0, 30.0}) {
    for (const double snap_mm : {0.03, 0.3}) {
      TapWorld& world = g.Add(fmt::format("strand of {} gf, snaps at {} mm", pull_g, snap_mm),
                              Promise::kMayRefuse);
      world.cell.press.strand_g = pull_g;
      world.cell.press.strand_snap_mm = snap_mm;
      world.scene.motion.pull_back_mm = 0.25;
    }
  }
  g.Cell("impulse after the break", Promise::kMayRefuse).faults.impulse_at_s = 0.763;
  return g.group;
}

TapWorlds Faults() {
  // Times from the recording's first sample: touch at 0.15 s, pull-back from 0.593 s, break at
  // 0.733 s, end at 0.906 s.
  constexpr double kBeforeBreakS = 0.708;
  Group g{{"faults", {}}};
  const auto add = [&g](std::string name) -> TapWorld& {
    return g.Add(std::move(name), Promise::kRefused);
  };
  sim::SampleFaults& stuck = add("stuck 50 ms at the break").cell.faults;
  stuck.stuck_at_s = kBeforeBreakS;
  stuck.stuck_s = 0.05;
  sim::SampleFaults& gap = add("gap of 50 ms at the break").cell.faults;
  gap.gap_at_s = kBeforeBreakS;
  gap.gap_s = 0.05;
  add("saturated at 100 gf").cell.converter.saturation_g = 100;
  for (const auto& [name, cell] : {std::pair{"ooze: blob 40 gf, thread 15 gf", "oozing"},
                                   {"sticking 40 gf", "sticking"},
                                   {"loose sheet: 20 um at 700 gf/mm", "loose-sheet"}}) {
    add(name).cell = sim::CellByName(cell).value();
  }
  sim::PressTraits& fouled = add("heavy fouling: blob 120 gf, thread 30 gf").cell.press;
  fouled.blob_g = 120;
  fouled.blob_mm = 0.3;
  fouled.thread_g = 30;
  fouled.thread_mm = 0.08;
  add("drift 200 gf/s").cell.disturbance.drift_g_s = 200;
  add("noise 40 gf").cell.disturbance.noise_g = 40;
  add("pull-back of 35 um: still pressed").scene.motion.pull_back_mm = 0.035;
  add("pull-back of 48 um: ends at the break").scene.motion.pull_back_mm = 0.048;
  add("press of 3 um").scene.press_mm = 0.003;
  return g.group;
}

double LogUniform(Random& random, double lo, double hi) {
  return lo * std::pow(hi / lo, random.Uniform());
}

void DrawLaw(sim::ContactStiffness& law, Random& random) {
  law.stiffness_g_mm = LogUniform(random, 500, 8000);
  law.kind = static_cast<ContactKind>(random.Below(6));
  law.knee = random.Uniform(0.2, 0.9);
  law.exponent = random.Uniform(0.7, 1.7);
  law.share = law.kind == ContactKind::kTwoSlope ? random.Uniform(-0.5, 1.5)
              : law.kind == ContactKind::kCubic  ? random.Uniform(-0.2, 0.6)
                                                 : random.Uniform(-0.35, 0.6);
}

void Disturb(std::uint64_t which, CellTraits& cell, Random& random) {
  DisturbanceTraits& d = cell.disturbance;
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
      break;
    case 2:
      d.swing_hz = LogUniform(random, 5, 40);
      d.swing_g = LogUniform(random, 0.2, 5);
      break;
    case 3:
      cell.press.strand_g = LogUniform(random, 1, 30);
      cell.press.strand_snap_mm = LogUniform(random, 0.02, 0.5);
      break;
    case 4:
      d.slip_g = random.Uniform(-20, 20);
      d.slip_above_mm = LogUniform(random, 0.001, 0.1);
      break;
    case 5:
      cell.faults.held_share = random.Uniform(0.05, 0.8);
      cell.faults.held_times = random.Uniform() < 0.4;
      break;
    case 6:
      cell.converter.counts_per_g = 1 / LogUniform(random, 0.1, 5);
      break;
    case 7:
      d.pink_g = LogUniform(random, 0.1, 5);
      break;
    case 8:
      d.hum_g = LogUniform(random, 0.2, 10);
      d.hum_hz = random.Uniform() < 0.5 ? 50 : 60;
      break;
    case 9:
      cell.converter.latency_s = LogUniform(random, 0.0005, 0.02);
      break;
    case 10:
      cell.press.onset = random.Uniform() < 0.5 ? sim::Onset::kFlat : sim::Onset::kCurved;
      cell.press.onset_travel_mm = LogUniform(random, 0.001, 0.02);
      break;
    case 11:
      cell.press.creep_share = random.Uniform(0, 0.1);
      break;
    default:
      cell.faults.drop_share = LogUniform(random, 0.01, 0.3);
  }
}

/// Any cell and motion, at most two disturbances: a printer that somebody has.
void DrawPrinter(TapWorld& world, Random& random) {
  constexpr std::uint64_t kDisturbances = 13;
  CellTraits& cell = world.cell = {};
  DrawLaw(cell.press.law, random);
  const double press_mm =
      std::clamp(LogUniform(random, 30, 300) / cell.press.law.stiffness_g_mm, 0.01, 0.4);
  cell.press.law.reference_mm = press_mm;
  cell.disturbance.noise_g = LogUniform(random, 0.02, 20);
  cell.converter.filter_order = static_cast<int>(random.Below(5));
  cell.converter.sign = random.Uniform() < 0.5 ? 1 : -1;
  cell.converter.offset_g = random.Uniform(-500, 500);
  sim::TapScene& scene = world.scene = {};
  scene.press_mm = press_mm;
  scene.motion.approach_speed_mm_s = LogUniform(random, 0.5, 10);
  scene.motion.acceleration_mm_s2 = LogUniform(random, 20, 5000);
  scene.motion.pull_back_mm = LogUniform(random, 1.3 * press_mm, std::max(2.0, 2 * press_mm));
  scene.motion.pull_back_speed_mm_s = LogUniform(random, 0.03, 3);
  // A recording has at most 20000 samples, as nobody waits for more.
  const double lasts_s = scene.motion.pull_back_mm / scene.motion.pull_back_speed_mm_s + 1;
  cell.converter.rate_hz =
      std::clamp(LogUniform(random, 40, 8000), 40.0, std::max(40.0, 20000 / lasts_s));
  world.latency_known = random.Uniform() < 0.7;
  for (std::uint64_t i = random.Below(3); i > 0; --i) {
    Disturb(random.Below(kDisturbances), cell, random);
  }
}

TapWorlds Printers() {
  Group g{{"drawn printers", {}}};
  TapWorld& usual = g.Add("usual cells: 80 to 2000 samples/s, 0.8 to 4 gf", Promise::kMayRefuse);
  usual.scene.press_mm = 0;
  usual.draw = [](TapWorld& world, Random& random) { world.cell = sim::DrawCellTraits(random); };
  g.Add("any cell and motion, at most two disturbances", Promise::kMayRefuse).draw = DrawPrinter;
  return g.group;
}

}  // namespace

std::vector<TapWorlds> AllTapWorlds() {
  return {Laws(),   Noises(), Motions(),      Converters(), Latencies(),
          Stamps(), Toes(),   Disturbances(), Faults(),     Printers()};
}

sim::SimulatedTap SimulateTapOf(TapWorld& world, std::uint64_t seed) {
  Random random(seed);
  if (world.draw != nullptr) world.draw(world, random);
  sim::TapScene scene = world.scene;
  scene.surface_z_mm = random.Uniform(-0.05, 0.05);
  scene.start_time_s = random.Uniform(50, 500);
  return sim::SimulateTap(world.cell, scene, random);
}

}  // namespace trammel
