#include "tap_further_rows.h"

#include <fmt/format.h>

namespace trammel {
namespace {

constexpr double kMm = 1e-3;  // per um

using Rows = std::vector<TapRow>;

TapRow& Push(Rows& rows, std::string name, Demand demand = Demand::kDisturbed) {
  rows.emplace_back();
  rows.back().name = std::move(name);
  rows.back().demand = demand;
  return rows.back();
}

void PushNoise(Rows& rows) {
  for (const double noise_g : {0.02, 0.05, 0.1, 0.3, 0.5, 1.0, 5.0, 10.0, 20.0}) {
    const Demand demand = noise_g > 5 ? Demand::kDisturbed : Demand::kExact;
    Push(rows, fmt::format("noise {} gf", noise_g), demand).cell.disturbance.noise_g = noise_g;
  }
  for (const double pink_g : {0.3, 1.0, 3.0}) {
    TapRow& row = Push(rows, fmt::format("noise 0.5 gf and 1/f {} gf", pink_g));
    row.cell.disturbance.noise_g = 0.5;
    row.cell.disturbance.pink_g = pink_g;
  }
  for (const double wander_g : {1.0, 5.0}) {
    TapRow& row = Push(rows, fmt::format("noise 0.5 gf, wander {} gf in 1 s", wander_g));
    row.cell.disturbance.noise_g = 0.5;
    row.cell.disturbance.wander_g = wander_g;
  }
  for (const double hum_g : {0.5, 2.0, 8.0}) {
    for (const double hz : {49.8, 60.0}) {
      TapRow& row =
          Push(rows, fmt::format("noise 0.3 gf, hum {} gf at {} Hz, harmonics", hum_g, hz));
      row.cell.disturbance.noise_g = 0.3;
      row.cell.disturbance.hum_g = hum_g;
      row.cell.disturbance.hum_hz = hz;
      row.cell.disturbance.hum_second = 0.5;
      row.cell.disturbance.hum_third = 0.3;
    }
  }
  for (const double drift_g_s : {20.0, 60.0}) {
    TapRow& row = Push(rows, fmt::format("noise 0.5 gf, drift {} gf/s", drift_g_s));
    row.cell.disturbance.noise_g = 0.5;
    row.cell.disturbance.drift_g_s = drift_g_s;
  }
  TapRow& heater = Push(rows, "noise 0.5 gf, heater steps 2 gf");
  heater.cell.disturbance.noise_g = 0.5;
  heater.cell.disturbance.heater_g = 2;
}

void PushPullBack(Rows& rows) {
  for (const double speed_mm_s : {0.03, 0.05, 0.1, 0.2, 0.6, 1.0, 1.5, 3.0}) {
    const Demand demand = speed_mm_s > 1 ? Demand::kDisturbed : Demand::kExact;
    Push(rows, fmt::format("pull-back at {} mm/s", speed_mm_s), demand)
        .scene.motion.pull_back_speed_mm_s = speed_mm_s;
  }
  for (const double mm : {0.06, 0.2, 0.5, 1.0, 1.5, 2.0}) {
    const Demand demand = mm < 0.1 ? Demand::kDisturbed : Demand::kExact;
    Push(rows, fmt::format("pull-back of {} mm", mm), demand).scene.motion.pull_back_mm = mm;
  }
  for (const double mm_s2 : {3.0, 10.0, 30.0, 100.0}) {
    Push(rows, fmt::format("acceleration {} mm/s2", mm_s2), Demand::kOther)
        .scene.motion.acceleration_mm_s2 = mm_s2;
  }
  for (const double noise_g : {0.3, 2.0}) {
    for (const double um : {1.0, 4.0, 10.0, 20.0}) {
      TapRow& play = Push(rows, fmt::format("backlash {} um, {} gf", um, noise_g));
      play.cell.disturbance.noise_g = noise_g;
      play.cell.press.onset = sim::Onset::kFlat;
      play.cell.press.onset_travel_mm = um * kMm;
      TapRow& friction = Push(rows, fmt::format("friction {} um, {} gf", um, noise_g));
      friction.cell.disturbance.noise_g = noise_g;
      friction.cell.press.onset = sim::Onset::kCurved;
      friction.cell.press.onset_travel_mm = um * kMm;
    }
    TapRow& creep = Push(rows, fmt::format("creep of the bed 8 %, {} gf", noise_g));
    creep.cell.disturbance.noise_g = noise_g;
    creep.cell.press.creep_share = 0.08;
  }
}

void PushRates(Rows& rows) {
  for (const double rate_hz : {40., 80., 160., 640., 1000., 4000., 8000.}) {
    const Demand demand = rate_hz < 160 ? Demand::kDisturbed : Demand::kExact;
    Push(rows, fmt::format("rate {}/s", rate_hz), demand).cell.converter.rate_hz = rate_hz;
  }
  for (const double rate_hz : {80., 160., 4000.}) {
    TapRow& row = Push(rows, fmt::format("rate {}/s, 1 um a sample", rate_hz), Demand::kExact);
    row.cell.converter.rate_hz = rate_hz;
    row.scene.motion.pull_back_speed_mm_s = rate_hz * kMm;
  }
  for (const double step_g : {0.1, 0.5, 1.0, 2.0, 5.0}) {
    for (const double noise_g : {0.1, 0.5, 2.0}) {
      TapRow& row = Push(rows, fmt::format("counts of {} gf, noise {} gf", step_g, noise_g));
      row.cell.converter.counts_per_g = 1 / step_g;
      row.cell.disturbance.noise_g = noise_g;
    }
  }
  for (const int order : {1, 2, 4}) {
    for (const double noise_g : {0.1, 0.5}) {
      TapRow& row = Push(rows, fmt::format("filter of {} samples, {} gf", order, noise_g));
      row.cell.converter.filter_order = order;
      row.cell.disturbance.noise_g = noise_g;
    }
  }
  for (const double ms : {-3.0, 0.0}) {
    TapRow& row = Push(rows, fmt::format("untold latency {} ms", ms));
    row.cell.converter.latency_s = ms * 1e-3;
    row.latency_known = false;
  }
  for (const double ms : {2.0, 5.0, 10.0, 20.0}) {
    for (const bool known : {true, false}) {
      TapRow& row = Push(rows, fmt::format("{} latency {} ms", known ? "told" : "untold", ms));
      row.cell.converter.latency_s = ms * 1e-3;
      row.latency_known = known;
    }
  }
  for (const double share : {0.01, 0.05}) {
    Push(rows, fmt::format("creep of the cell {} %", 100 * share)).cell.converter.creep_share =
        share;
    Push(rows, fmt::format("hysteresis of the cell {} %", 100 * share))
        .cell.converter.hysteresis_share = share;
  }
}

void PushStamps(Rows& rows) {
  for (const double share : {0.05, 0.3, 0.5, 0.8}) {
    const double percent = 100 * share;
    Push(rows, fmt::format("held {:.0f} %, fresh times", percent)).cell.faults.held_share = share;
    TapRow& turns = Push(rows, fmt::format("held {:.0f} % in turn, fresh times", percent));
    turns.cell.faults.held_share = share;
    turns.cell.faults.held_regularly = true;
    TapRow& same = Push(rows, fmt::format("held {:.0f} %, times too", percent));
    same.cell.faults.held_share = share;
    same.cell.faults.held_times = true;
    TapRow& quiet = Push(rows, fmt::format("held {:.0f} %, fresh times, 0.5 gf", percent));
    quiet.cell.faults.held_share = share;
    quiet.cell.disturbance.noise_g = 0.5;
  }
  for (const double jitter : {0.25, 0.5, 1.0}) {
    for (const double noise_g : {0.3, 2.0}) {
      TapRow& row = Push(rows, fmt::format("jitter of {} intervals, {} gf", jitter, noise_g));
      row.cell.faults.jitter = jitter;
      row.cell.disturbance.noise_g = noise_g;
    }
  }
  // In the middle of the release, and between the break and the end.
  for (const double at_s : {0.66, 0.8}) {
    for (const double ms : {1.0, 5.0, -5.0, 20.0}) {
      TapRow& row = Push(rows, fmt::format("clock steps {} ms at {} s", ms, at_s));
      row.cell.faults.clock_step_at_s = at_s;
      row.cell.faults.clock_step_s = ms * 1e-3;
    }
  }
}

void PushPresses(Rows& rows) {
  for (const double noise_g : {0.5, 2.0}) {
    for (const double um : {1.0, 3.0, 5.0, 7.5, 10.0, 20.0, 30.0}) {
      for (const double share : {0.1, 0.2, 0.5}) {
        TapRow& row = Push(rows, fmt::format("toe {} um at {} of k, {} gf", um, share, noise_g));
        row.cell.disturbance.noise_g = noise_g;
        row.cell.press.law.toe_mm = um * kMm;
        row.cell.press.law.toe_share = share;
        row.cell.press.law.toe_rounding = um < 4 ? 0 : 0.5;
      }
    }
  }
  for (const double exponent : {0.7, 0.8, 0.9, 1.1, 1.7}) {
    TapRow& row = Push(rows, fmt::format("press by d^{}", exponent));
    row.cell.press.law.kind = sim::ContactKind::kPower;
    row.cell.press.law.exponent = exponent;
  }
  for (const double knee : {0.25, 0.5}) {
    for (const double change : {-0.5, 0.5, 2.0}) {
      TapRow& row =
          Push(rows, fmt::format("slope {:+.0f} % beyond {} of the press", 100 * change, knee));
      row.cell.press.law.kind = sim::ContactKind::kTwoSlope;
      row.cell.press.law.knee = knee;
      row.cell.press.law.share = change;
    }
  }
  for (const double knee : {0.3, 0.7}) {
    TapRow& row = Push(rows, fmt::format("yields at {} of the press", knee));
    row.cell.press.law.kind = sim::ContactKind::kYielding;
    row.cell.press.law.knee = knee;
  }
  for (const double stiffness_g_mm : {500.0, 1500.0, 8000.0}) {
    TapRow& row = Push(rows, fmt::format("stiffness {} gf/mm, trigger 75 gf", stiffness_g_mm));
    row.cell.press.law.stiffness_g_mm = stiffness_g_mm;
    row.scene.press_mm = 0;
    row.scene.motion.pull_back_mm = 0.1 + 150 / stiffness_g_mm;
  }
}

// Toes that stiffen otherwise than those above: at once, over other parts of their depth, or
// exponentially.
void PushToes(Rows& rows) {
  const auto push = [&](const std::string& kind, double um, double share, double noise_g) {
    TapRow& row = Push(rows, fmt::format("{} {} um at {} of k, {} gf", kind, um, share, noise_g));
    row.cell.disturbance.noise_g = noise_g;
    row.cell.press.law.toe_mm = um * kMm;
    row.cell.press.law.toe_share = share;
    return &row.cell.press.law;
  };
  const auto push_rounded = [&](double rounding, double um, double share, double noise_g) {
    push(fmt::format("toe rounded over {},", rounding), um, share, noise_g)->toe_rounding =
        rounding;
  };
  const auto push_exponential = [&](double um, double share, double noise_g) {
    push("exponential toe of", um, share, noise_g)->toe_kind = sim::ToeKind::kExponential;
  };
  for (const double um : {5.0, 10.0}) {
    for (const double rounding : {0.0, 0.25, 0.75, 1.0}) {
      push_rounded(rounding, um, 0.1, 0.5);
    }
    push_exponential(um, 0.1, 0.5);
  }
  push_rounded(0.75, 10, 0.2, 2);
  push_exponential(10, 0.2, 2);
}

void PushStructure(Rows& rows) {
  for (const double hz : {5.0, 8.0, 12.0, 20.0, 40.0}) {
    for (const double share : {0.03, 0.12, 0.3}) {
      TapRow& row = Push(rows, fmt::format("rings at {} Hz with {:.0f} %", hz, 100 * share));
      row.cell.disturbance.mode_hz = hz;
      row.cell.disturbance.mode_share = share;
      row.cell.disturbance.mode_mass_g = 100;
    }
    for (const double swing_g : {0.5, 3.0}) {
      TapRow& row = Push(rows, fmt::format("swings at {} Hz by {} gf", hz, swing_g));
      row.cell.disturbance.swing_hz = hz;
      row.cell.disturbance.swing_g = swing_g;
    }
  }
  for (const double slip_g : {2.0, 5.0, -5.0, 10.0, 20.0}) {
    for (const double um : {2.0, 10.0, 30.0}) {
      TapRow& row = Push(rows, fmt::format("slip of {} gf at {} um", slip_g, um));
      row.cell.disturbance.slip_g = slip_g;
      row.cell.disturbance.slip_above_mm = um * kMm;
    }
  }
}

void PushStrands(Rows& rows) {
  for (const double pull_g : {1.0, 5.0, 10.0, 15.0, 30.0}) {
    for (const double snap_mm : {0.03, 0.15, 0.3}) {
      TapRow& row = Push(rows, fmt::format("strand of {} gf, snaps at {} mm", pull_g, snap_mm));
      row.cell.press.strand_g = pull_g;
      row.cell.press.strand_snap_mm = snap_mm;
      row.scene.motion.pull_back_mm = 0.25;
    }
  }
  for (const double onset_um : {0.1, 10.0, 50.0}) {
    TapRow& row = Push(rows, fmt::format("strand of 10 gf, onset {} um", onset_um));
    row.cell.press.strand_g = 10;
    row.cell.press.strand_onset_mm = onset_um * kMm;
  }
}

// A latency shows as the approach and the break being apart; so do backlash and slow sampling.
void PushLatencies(Rows& rows) {
  for (const double speed_mm_s : {0.5, 2.0, 8.0}) {
    for (const double ms : {0.0, 5.0, 15.0}) {
      TapRow& row =
          Push(rows, fmt::format("untold latency {} ms, approach at {} mm/s", ms, speed_mm_s));
      row.cell.converter.latency_s = ms * 1e-3;
      row.latency_known = false;
      row.scene.motion.approach_speed_mm_s = speed_mm_s;
    }
  }
  for (const double um : {2.0, 6.0}) {
    for (const double ms : {0.0, 8.0}) {
      TapRow& row = Push(rows, fmt::format("untold latency {} ms, backlash {} um", ms, um));
      row.cell.converter.latency_s = ms * 1e-3;
      row.latency_known = false;
      row.cell.press.onset = sim::Onset::kFlat;
      row.cell.press.onset_travel_mm = um * kMm;
    }
  }
  for (const double rate_hz : {80.0, 1000.0}) {
    TapRow& row = Push(rows, fmt::format("untold latency 8 ms, {} samples/s", rate_hz));
    row.cell.converter.latency_s = 8e-3;
    row.latency_known = false;
    row.cell.converter.rate_hz = rate_hz;
  }
  for (const int order : {2, 4}) {
    TapRow& row = Push(rows, fmt::format("untold latency of a filter of {} samples", order));
    row.cell.converter.filter_order = order;
    row.latency_known = false;
  }
}

}  // namespace

std::vector<TapRow> FurtherRows() {
  Rows rows;
  PushNoise(rows);
  PushPullBack(rows);
  PushRates(rows);
  PushStamps(rows);
  PushPresses(rows);
  PushToes(rows);
  PushStructure(rows);
  PushStrands(rows);
  return rows;
}

std::vector<TapRow> CrossedRows() {
  Rows rows;
  for (const double noise_g : {0.05, 0.3, 1.0}) {
    for (const double speed_mm_s : {0.05, 0.1, 0.32}) {
      for (const double mm : {0.1, 0.5, 1.0}) {
        TapRow& row = Push(rows, fmt::format("{} gf, {} mm/s, {} mm", noise_g, speed_mm_s, mm),
                           Demand::kExact);
        row.cell.disturbance.noise_g = noise_g;
        row.scene.motion.pull_back_speed_mm_s = speed_mm_s;
        row.scene.motion.pull_back_mm = mm;
      }
    }
  }
  for (const double share : {-0.3, 0.5}) {
    for (const double noise_g : {0.05, 0.3, 1.0}) {
      TapRow& row =
          Push(rows, fmt::format("{} gf, quadratic {:+.0f} %, 0.5 mm", noise_g, 100 * share),
               Demand::kExact);
      row.cell.disturbance.noise_g = noise_g;
      row.cell.press.law.kind = sim::ContactKind::kQuadratic;
      row.cell.press.law.share = share;
      row.scene.motion.pull_back_mm = 0.5;
    }
  }
  PushLatencies(rows);
  // The nozzle lets go before the cruise; what the cruise shows is a strand that snaps.
  for (const double mm_s2 : {20.0, 60.0}) {
    for (const double pull_g : {3.0, 10.0}) {
      TapRow& row =
          Push(rows, fmt::format("let go in the ramp of {} mm/s2, strand of {} gf", mm_s2, pull_g));
      row.cell.disturbance.noise_g = 0.2;
      row.cell.press.strand_g = pull_g;
      row.cell.press.strand_snap_mm = 0.35;
      row.scene.motion.acceleration_mm_s2 = mm_s2;
      row.scene.motion.pull_back_speed_mm_s = 3;
      row.scene.motion.pull_back_mm = 1;
      row.cell.converter.rate_hz = 1000;
    }
  }
  for (const double exponent : {0.8, 1.25, 1.5}) {
    for (const double noise_g : {0.1, 0.5}) {
      TapRow& row = Push(rows, fmt::format("{} gf, press by d^{}", noise_g, exponent));
      row.cell.disturbance.noise_g = noise_g;
      row.cell.press.law.kind = sim::ContactKind::kPower;
      row.cell.press.law.exponent = exponent;
    }
  }
  return rows;
}

}  // namespace trammel
