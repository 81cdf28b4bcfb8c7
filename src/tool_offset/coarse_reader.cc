#include "tool_offset/coarse_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/statistics.h"
#include "tool_offset/leg_reader.h"

namespace trammel::tool_offset {
namespace {

constexpr double kStep_mm = 0.1;  // of the shifts that are tried
/// The reach is along the bed's axes; along the tilted sheet's both may add up.
constexpr double kSearch_mm = kCoarseReach_mm * std::numbers::sqrt2 + 0.1;

/// A patch of the page in sheet coordinates around a mark.
struct Patch {
  double low_u_mm = 0;  ///< of the first column, from the mark's middle
  double low_v_mm = 0;
  int columns = 0;  ///< along u
  int rows = 0;     ///< along v
  std::vector<float> level;
  double noise = 1;

  [[nodiscard]] std::ptrdiff_t Index(double u_mm, double v_mm) const {
    return std::lround((v_mm - low_v_mm) / kStep_mm) * columns +
           std::lround((u_mm - low_u_mm) / kStep_mm);
  }
};

/// Offsets into the patch for the mark at shift zero: on the legs of a pair, and beside them.
struct Pair {
  std::vector<std::ptrdiff_t> on;
  std::vector<std::ptrdiff_t> beside;
};

/// A mark's legs from its middle.
std::array<Leg, 4> LegsFromMiddle(const SheetPlan& plan, const CoarseMark& mark) {
  std::array<Leg, 4> legs = CoarseLegs(plan, mark);
  for (Leg& leg : legs) {
    for (SheetPoint* point : {&leg.start, &leg.end}) {
      point->u_mm -= mark.middle.u_mm;
      point->v_mm -= mark.middle.v_mm;
    }
  }
  return legs;
}

std::optional<Patch> TakePatch(const PageView& page, const PageMap& map, const CoarseMark& mark,
                               const std::array<Leg, 4>& legs, std::size_t channel) {
  constexpr double kMargin_mm = 0.6;  // beside the outermost legs
  double low = 0;
  double high = 0;
  for (const Leg& leg : legs) {
    for (const SheetPoint& point : {leg.start, leg.end}) {
      low = std::min({low, point.u_mm, point.v_mm});
      high = std::max({high, point.u_mm, point.v_mm});
    }
  }
  Patch patch;
  patch.low_u_mm = patch.low_v_mm = low - kSearch_mm - kMargin_mm;
  patch.columns = patch.rows =
      static_cast<int>((high - low + 2 * (kSearch_mm + kMargin_mm)) / kStep_mm) + 1;
  const LocalMap local = map.Near(mark.middle);
  const Strip strip{local.ToPage(patch.low_u_mm, patch.low_v_mm), kStep_mm * local.v_px_mm,
                    kStep_mm * local.u_px_mm, patch.rows, patch.columns};
  if (!SampleStrip(page, InkChannelMix(channel), strip, patch.level)) return std::nullopt;
  const std::vector<double> levels(patch.level.begin(), patch.level.end());
  patch.noise = std::max(0.5, RobustStandardDeviation(levels));
  return patch;
}

std::array<Pair, 2> PlacesOf(const Patch& patch, const std::array<Leg, 4>& legs,
                             const SheetSettings& settings) {
  constexpr double kAlong_mm = 0.4;
  std::array<Pair, 2> pairs;
  const std::ptrdiff_t origin = patch.Index(0, 0);
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const Leg& leg = legs[i];
    const double du = leg.end.u_mm - leg.start.u_mm;
    const double dv = leg.end.v_mm - leg.start.v_mm;
    const double length = std::hypot(du, dv);
    const double aside_mm = settings.leg_spacing_mm / 2;
    for (double along = kLegEnd_mm; along <= length - kLegEnd_mm; along += kAlong_mm) {
      const double u = leg.start.u_mm + along / length * du;
      const double v = leg.start.v_mm + along / length * dv;
      Pair& pair = pairs[i / 2];
      pair.on.push_back(patch.Index(u, v) - origin);
      for (const double side : {-aside_mm, aside_mm}) {
        pair.beside.push_back(patch.Index(u - dv / length * side, v + du / length * side) - origin);
      }
    }
  }
  return pairs;
}

double Contrast(const Patch& patch, const Pair& pair, std::ptrdiff_t at) {
  double on = 0;
  double beside = 0;
  for (const std::ptrdiff_t i : pair.on)
    on += static_cast<double>(patch.level[static_cast<std::size_t>(at + i)]);
  for (const std::ptrdiff_t i : pair.beside) {
    beside += static_cast<double>(patch.level[static_cast<std::size_t>(at + i)]);
  }
  return on / static_cast<double>(pair.on.size()) -
         beside / static_cast<double>(pair.beside.size());
}

struct Guess {
  double signal = 0;
  double contrast = 0;
  SheetPoint shift;
};

/// The shift at which both pairs of legs stand out most, in either direction of brightness.
Guess Search(const Patch& patch, const std::array<Pair, 2>& pairs) {
  Guess best;
  const int steps = static_cast<int>(std::lround(kSearch_mm / kStep_mm));
  for (int j = -steps; j <= steps; ++j) {
    for (int i = -steps; i <= steps; ++i) {
      const SheetPoint shift{i * kStep_mm, j * kStep_mm};
      const std::ptrdiff_t at = patch.Index(shift.u_mm, shift.v_mm);
      const double first = Contrast(patch, pairs[0], at);
      const double second = Contrast(patch, pairs[1], at);
      if (first * second <= 0) continue;
      const double contrast = std::abs(first) < std::abs(second) ? first : second;
      if (std::abs(contrast) <= std::abs(best.contrast)) continue;
      best = {std::abs(contrast) / patch.noise, contrast, shift};
    }
  }
  return best;
}

/// Reads a pair of legs like a finger; nothing where they are not clear.
std::optional<double> ReadPair(const PageView& page, const ChannelMix& mix, const PageMap& map,
                               const SheetPlan& plan, const CoarseMark& mark, Axis axis,
                               SheetPoint shift, const Leg& leg, double& variance_mm2) {
  const bool is_x = axis == Axis::kX;
  const double from = is_x ? leg.start.v_mm : leg.start.u_mm;
  const double to = is_x ? leg.end.v_mm : leg.end.u_mm;
  const double half_mm = std::abs(to - from) / 2 - kLegEnd_mm;
  const double centre_mm = (from + to) / 2;
  FingerSite site;
  site.axis = axis;
  site.middle = {mark.middle.u_mm + shift.u_mm + (is_x ? 0 : centre_mm),
                 mark.middle.v_mm + shift.v_mm + (is_x ? centre_mm : 0)};
  site.low_mm = site.clear_low_mm = -half_mm;
  site.high_mm = site.clear_high_mm = half_mm;
  site.free_low_mm = site.free_high_mm = plan.settings.leg_spacing_mm / 2;
  ReaderWorkspace workspace;
  constexpr double kReach_mm = 0.3;
  const auto located = LocateFinger(page, mix, map, plan.settings, site, kReach_mm, workspace);
  if (!located) return std::nullopt;
  (is_x ? site.middle.u_mm : site.middle.v_mm) += *located;
  const auto legs = ReadLegs(page, mix, map, plan.settings, site, workspace);
  if (!legs) return std::nullopt;
  for (const LegReading& reading : *legs) {
    if (2 * reading.rows_used < reading.rows) return std::nullopt;
  }
  const double apart_mm =
      (*legs)[1].position_mm - (*legs)[0].position_mm - plan.settings.leg_spacing_mm;
  variance_mm2 += apart_mm * apart_mm / 4;
  return *located + ((*legs)[0].position_mm + (*legs)[1].position_mm) / 2;
}

}  // namespace

CoarseReading ReadCoarseMark(const PageView& page, const PageMap& map, const SheetPlan& plan,
                             const CoarseMark& mark) {
  /// What the legs of a print may be off by without showing it by their distance.
  constexpr double kPlacement_mm = 0.01;
  const std::array<Leg, 4> legs = LegsFromMiddle(plan, mark);
  CoarseReading reading;
  Guess best;
  std::size_t best_channel = 0;
  const std::size_t channels = page.channels == 1 ? 1 : kInkChannels;
  for (std::size_t channel = 0; channel < channels; ++channel) {
    const auto patch = TakePatch(page, map, mark, legs, channel);
    if (!patch) return reading;
    const Guess guess = Search(*patch, PlacesOf(*patch, legs, plan.settings));
    if (std::abs(guess.contrast) > reading.best_contrast)
      reading.best_contrast = std::abs(guess.contrast);
    if (guess.signal <= best.signal) continue;
    best = guess;
    best_channel = channel;
  }
  std::array<Leg, 4> found = legs;
  for (Leg& leg : found) {
    for (SheetPoint* point : {&leg.start, &leg.end}) {
      point->u_mm += mark.middle.u_mm + best.shift.u_mm;
      point->v_mm += mark.middle.v_mm + best.shift.v_mm;
    }
  }
  reading.ink = SampleInk(page, map, plan.settings, found);
  if (!IsReadable(reading.ink)) return reading;
  best_channel = reading.ink.best();
  ChannelMix mix = InkChannelMix(best_channel);
  for (float& weight : mix) weight /= static_cast<float>(reading.ink.contrast[best_channel]);
  double variance_mm2 = kPlacement_mm * kPlacement_mm;
  const auto v_mm =
      ReadPair(page, mix, map, plan, mark, Axis::kY, best.shift, legs[0], variance_mm2);
  const auto u_mm =
      ReadPair(page, mix, map, plan, mark, Axis::kX, best.shift, legs[2], variance_mm2);
  if (!u_mm || !v_mm) return reading;
  reading.found = true;
  reading.shift = {best.shift.u_mm + *u_mm, best.shift.v_mm + *v_mm};
  reading.standard_uncertainty_mm = std::sqrt(variance_mm2);
  return reading;
}

}  // namespace trammel::tool_offset
