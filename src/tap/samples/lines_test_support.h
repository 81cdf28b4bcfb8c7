// Drawn taps (tests/support) as this room takes them.
#pragma once

#include <algorithm>
#include <vector>

#include "support/drawn_tap.h"
#include "tap/analyse/analyse.h"

namespace trammel::tap {

/// A drawn tap that owns what a view of it shows; members may be changed before viewing.
struct RecordedTap {
  test_support::DrawnTap drawn;
  std::vector<Move> moves;

  [[nodiscard]] TapView View() const { return {drawn.time_s, drawn.force_g, moves}; }
};

inline RecordedTap Record(const test_support::TapDrawing& drawing, std::uint64_t seed) {
  RecordedTap tap{test_support::DrawTap(drawing, seed), {}};
  for (const auto& move : tap.drawn.moves) {
    tap.moves.push_back({move.start_time_s, move.duration_s, move.start_velocity_mm_s,
                         move.acceleration_mm_s2, move.start_z_mm, move.z_direction});
  }
  return tap;
}

inline TapAnalysis AnalyseTwoLine(const TapView& tap) {
  TapOptions options;
  options.method = Method::kTwoLine;
  return TapAnalyser(options).Analyse(tap);
}

inline bool HasNotice(const TapAnalysis& analysis, FindingCode code) {
  const auto notices = analysis.Notices();
  return std::any_of(notices.begin(), notices.end(),
                     [code](const Finding& notice) { return notice.code == code; });
}

}  // namespace trammel::tap
