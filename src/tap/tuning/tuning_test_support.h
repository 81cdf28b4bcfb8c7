// Drawn taps for tests of tuning: a world, ten recordings of it, and taps under other settings.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"
#include "support/drawn_tap.h"
#include "tap/analyse/analyse.h"
#include "tap/samples/finding.h"
#include "tap/tuning/tuning.h"

namespace trammel::tap {

/// A printer by tests/support/drawn_tap.h, which shares nothing with the trial's own taps. Its bed
/// stays at one height; where its head halts scatters.
struct DrawnPrinter {
  test_support::TapDrawing drawing;
  double halt_scatter_mm = 0;  ///< To either side.

  [[nodiscard]] double Force(double depth_mm) const {
    return drawing.stiffness_g_mm * depth_mm *
           (1 + drawing.curvature * depth_mm / drawing.depth_mm);
  }
};

struct DrawnRecording {
  test_support::DrawnTap drawn;
  std::vector<Move> moves;
  TapAnalysis analysis;
  [[nodiscard]] TapView View() const { return {drawn.time_s, drawn.force_g, moves}; }
};

inline std::vector<DrawnRecording> Record(const DrawnPrinter& printer, int count,
                                          std::uint64_t seed) {
  Random random(seed);
  TapAnalyser analyser({});
  std::vector<DrawnRecording> taps;
  for (int i = 0; i < count; ++i) {
    test_support::TapDrawing drawing = printer.drawing;
    drawing.depth_mm += printer.halt_scatter_mm * random.Uniform(-1, 1);
    drawing.curvature *= drawing.depth_mm / printer.drawing.depth_mm;  // the same press
    DrawnRecording tap;
    tap.drawn = test_support::DrawTap(drawing, random.Bits());
    for (const test_support::DrawnMove& m : tap.drawn.moves) {
      tap.moves.push_back({m.start_time_s, m.duration_s, m.start_velocity_mm_s,
                           m.acceleration_mm_s2, m.start_z_mm - tap.drawn.contact_z_mm,
                           m.z_direction});
    }
    tap.analysis = analyser.Analyse(tap.View());
    taps.push_back(std::move(tap));
  }
  return taps;
}

inline std::vector<TuningTap> TuningTaps(const std::vector<DrawnRecording>& recordings) {
  std::vector<TuningTap> taps;
  for (const DrawnRecording& recording : recordings) {
    taps.push_back({recording.View(), &recording.analysis});
  }
  return taps;
}

inline Advice Find(const Tuning& tuning, const char* what) {
  const auto found = std::find_if(tuning.advice.begin(), tuning.advice.end(),
                                  [what](const Advice& advice) { return advice.what == what; });
  return found == tuning.advice.end() ? Advice{} : *found;
}

/// The printer with what the advice changes. The force is asked of the press as it is drawn, up to
/// the depth at which that has its most.
inline DrawnPrinter Follow(DrawnPrinter printer, const Tuning& tuning) {
  const auto value = [&](const char* what, double& setting) {
    if (const Advice advice = Find(tuning, what); advice.change) setting = advice.advised;
  };
  double force = 0;
  value("pull-back distance", printer.drawing.pull_back_mm);
  value("pull-back speed", printer.drawing.pull_back_mm_s);
  value("press force", force);
  if (force > 0) {
    const double target =
        force * printer.Force(printer.drawing.depth_mm) / Find(tuning, "press force").present;
    double depth = printer.drawing.depth_mm;
    while (printer.Force(depth) < target && printer.Force(depth + 1e-5) > printer.Force(depth)) {
      depth += 1e-5;
    }
    printer.drawing.curvature *= depth / printer.drawing.depth_mm;
    printer.drawing.depth_mm = depth;
  }
  return printer;
}

struct DrawnOutcome {
  int good = 0;
  int shallow = 0;
  double uncertainty_mm = std::nan("");  ///< Median.
};

inline DrawnOutcome OutcomeOf(const std::vector<DrawnRecording>& taps) {
  DrawnOutcome outcome;
  std::vector<double> uncertainties;
  for (const DrawnRecording& tap : taps) {
    if (tap.analysis.verdict != Verdict::kGood) continue;
    ++outcome.good;
    uncertainties.push_back(tap.analysis.standard_uncertainty_mm);
    for (const Finding& notice : tap.analysis.Notices()) {
      outcome.shallow += notice.code == FindingCode::kShortPress ? 1 : 0;
    }
  }
  if (!uncertainties.empty()) outcome.uncertainty_mm = Median(uncertainties);
  return outcome;
}

}  // namespace trammel::tap
