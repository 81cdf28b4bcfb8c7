// A structure as a signal: what a person can check the fit of the fingers against.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "tool_offset/reading/page.h"
#include "tool_offset/reading/page_map.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

inline constexpr int kHarmonics = 3;

/// One comb by quadrature detection: its ink, where it stands alone, times sine and cosine of the
/// pitch.
struct CombPhase {
  std::vector<double> ink;  ///< mean over the rows, along the measured axis; about 1 on a leg
  /// Whole comb, Hann-windowed, by harmonic of the pitch (the first is [0]).
  std::array<double, kHarmonics> amplitude{};
  std::array<double, kHarmonics> phase_rad{};  ///< against fingers in their planned places
  /// The first harmonic's displacement over each pitch by itself: bent by wrinkles like the
  /// fingers.
  std::vector<double> local_mm;
};

/// Diagnostic only. The answer comes from the fingers one by one (comb_fit.h): unlike a phase they
/// can be left out one by one, and say by their scatter how well they are known.
struct CombSignal {
  double from_mm = 0;  ///< of the first sample, along the axis, from the structure's middle
  double step_mm = 1;
  std::vector<double> overlap;  ///< mean ink where both combs stand side by side
  std::array<CombPhase, 2> comb;
  /// Comb 1 against comb 0 by each harmonic, and by all, weighted by their amplitudes and orders.
  std::array<double, kHarmonics> offset_mm{};
  double combined_offset_mm = 0;
};

/// @param mix    of each comb: its ink is about 1 above its paper (ink_channel.h).
/// @param shift  of each comb's tool as known before, on the sheet.
/// @returns nothing where the structure leaves the page.
[[nodiscard]] std::optional<CombSignal> ReadCombSignal(const PageView& page, const PageMap& map,
                                                       const SheetPlan& plan,
                                                       const Structure& structure,
                                                       const std::array<ChannelMix, 2>& mix,
                                                       const std::array<SheetPoint, 2>& shift);

}  // namespace trammel::tool_offset
