#include "tool_offset/coarse_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "base/measured.h"
#include "base/statistics.h"
#include "tool_offset/leg_reader.h"
#include "tool_offset/parallel.h"
#include "tool_offset/structure_reader.h"
#include "tool_offset/tool_search.h"

namespace trammel::tool_offset {
namespace {

/// A comb's fingers by themselves: the median of where they lie against the plan.
struct CombPlace {
  double shift_mm = 0;    ///< along the structure's axis, with `about`
  double spread_mm = 0;   ///< robust standard deviation of the fingers
  bool searched = false;  ///< its fingers could not be read: only as the search found it
};

/// Along the legs of a comb, on the sheet: where the other comb of its structure does not reach.
/// Where that is too little, all of the legs if they do not touch, else nothing.
/// @param own, other  shifts of the two combs' tools.
std::optional<Interval> ClearRows(const SheetPlan& plan, const Structure& structure,
                                  std::size_t comb, SheetPoint own, SheetPoint other) {
  constexpr double kLeast_mm = 1;
  const bool is_x = structure.axis == Axis::kX;
  const auto rows = [&](std::size_t which, SheetPoint shift, double end_mm) {
    const Leg leg = Shifted(FingerLegs(plan, structure, which, 0)[0], shift);
    const double a = is_x ? leg.start.v_mm : leg.start.u_mm;
    const double b = is_x ? leg.end.v_mm : leg.end.u_mm;
    return Interval{std::min(a, b) + end_mm, std::max(a, b) - end_mm};
  };
  const Interval whole = rows(comb, own, kLegEnd_mm);
  const Interval taken = rows(1 - comb, other, -kLegEnd_mm);
  const Interval below{whole.lo, std::min(whole.hi, taken.lo)};
  const Interval above{std::max(whole.lo, taken.hi), whole.hi};
  const Interval& longer = below.hi - below.lo > above.hi - above.lo ? below : above;
  if (longer.hi - longer.lo >= kLeast_mm) return longer;
  const double apart_mm = is_x ? own.u_mm - other.u_mm : own.v_mm - other.v_mm;
  const bool touches =
      std::abs(std::remainder(apart_mm, plan.settings.pitch_mm)) > FineReach_mm(plan.settings);
  return touches ? std::nullopt : std::optional(whole);
}

std::optional<CombPlace> LocateFingers(const PageView& page, const PageMap& map,
                                       const SheetPlan& plan, const ToolComb& tool_comb,
                                       const ChannelMix& mix, SheetPoint about, SheetPoint beside) {
  constexpr double kReach_mm = 0.3;
  const Structure& structure = plan.structures[tool_comb.structure];
  const bool is_x = structure.axis == Axis::kX;
  const auto rows = ClearRows(plan, structure, tool_comb.comb, about, beside);
  if (!rows) {
    return CombPlace{is_x ? about.u_mm : about.v_mm, 0, true};
  }
  ReaderWorkspace workspace;
  std::vector<double> found_mm;
  for (int finger = 0; finger < plan.settings.teeth; ++finger) {
    const auto legs = FingerLegs(plan, structure, tool_comb.comb, finger);
    const Leg middle = Shifted(legs[0], about);
    const double half_spacing_mm = plan.settings.leg_spacing_mm / 2;
    FingerSite site;
    site.axis = structure.axis;
    site.middle = {(middle.start.u_mm + middle.end.u_mm) / 2 + (is_x ? half_spacing_mm : 0),
                   (middle.start.v_mm + middle.end.v_mm) / 2 + (is_x ? 0 : half_spacing_mm)};
    const auto [low_mm, high_mm] = *rows;
    const double middle_mm = is_x ? site.middle.v_mm : site.middle.u_mm;
    site.low_mm = site.clear_low_mm = low_mm - middle_mm;
    site.high_mm = site.clear_high_mm = high_mm - middle_mm;
    const auto found = LocateFinger(page, mix, map, plan.settings, site, kReach_mm, workspace);
    if (found) found_mm.push_back(*found);
  }
  if (found_mm.size() < 4 || 3 * found_mm.size() < static_cast<std::size_t>(plan.settings.teeth)) {
    return std::nullopt;
  }
  return CombPlace{Median(found_mm) + (is_x ? about.u_mm : about.v_mm),
                   RobustStandardDeviation(found_mm)};
}

ChannelMix MixOf(const InkColour& ink) {
  ChannelMix mix = InkChannelMix(ink.best());
  for (float& weight : mix) weight /= static_cast<float>(ink.contrast[ink.best()]);
  return mix;
}

/// Legs of the tool's combs where they were found.
std::vector<Leg> LegsAt(const SheetPlan& plan, int tool, SheetPoint shift) {
  std::vector<Leg> legs;
  for (const ToolComb& comb : CombsOf(plan, tool)) {
    const Structure& structure = plan.structures[comb.structure];
    for (int finger = 0; finger < plan.settings.teeth; ++finger) {
      for (const Leg& leg : FingerLegs(plan, structure, comb.comb, finger)) {
        legs.push_back(Shifted(leg, shift));
      }
    }
  }
  return legs;
}

/// What the structures of one axis say.
struct AxisPlaces {
  std::vector<double> absolute_mm;
  std::vector<double> relative_mm;
  double worst_spread_mm = 0;
  bool searched = false;

  void Add(const CombPlace& own, const CombPlace& beside) {
    const bool only_searched = own.searched || beside.searched;
    if (only_searched && !searched && !absolute_mm.empty()) return;
    if (!only_searched && searched) *this = {};  // what was read counts alone
    searched = only_searched;
    absolute_mm.push_back(own.shift_mm);
    relative_mm.push_back(own.shift_mm - beside.shift_mm);
    worst_spread_mm = std::max({worst_spread_mm, own.spread_mm, beside.spread_mm});
  }
  [[nodiscard]] double uncertainty_mm() const {
    /// Half a line, where ink of the reference tool hides the tool's.
    constexpr double kSearched_mm = 0.15;
    if (searched) return kSearched_mm;
    /// A pixel at 300 dpi, in which fingers are located, and how unlike the play of two tools is.
    constexpr double kLeast_mm = 0.025;
    const double apart_mm =
        relative_mm.size() < 2 ? 0 : std::abs(relative_mm[0] - relative_mm[1]) / 2;
    return std::hypot(kLeast_mm, std::max(apart_mm, 0.3 * worst_spread_mm));
  }
};

void ReadCombs(const PageView& page, const PageMap& map, const SheetPlan& plan,
               const InkColour& reference, int tool, CoarseReading& reading) {
  std::array<AxisPlaces, 2> axes;
  for (const ToolComb& comb : CombsOf(plan, tool)) {
    const Structure& structure = plan.structures[comb.structure];
    const ToolComb other{comb.structure, 1 - comb.comb};
    const auto own = LocateFingers(page, map, plan, comb, MixOf(reading.ink), reading.shift, {});
    const auto beside = LocateFingers(page, map, plan, other, MixOf(reference), {}, reading.shift);
    if (!own || !beside) continue;
    axes[structure.axis == Axis::kX ? 0 : 1].Add(*own, *beside);
  }
  if (axes[0].absolute_mm.empty() || axes[1].absolute_mm.empty()) return;
  reading.found = true;
  reading.shift = {Mean(axes[0].absolute_mm), Mean(axes[1].absolute_mm)};
  reading.from_reference = {Mean(axes[0].relative_mm), Mean(axes[1].relative_mm)};
  reading.standard_uncertainty_mm = std::max(axes[0].uncertainty_mm(), axes[1].uncertainty_mm());
}

}  // namespace

std::vector<CoarseReading> ReadCoarsely(const PageView& page, const PageMap& map,
                                        const SheetPlan& plan, const InkRaster& raster,
                                        const InkColour& reference, const std::vector<int>& tools) {
  const std::vector<ToolPlace> places = ToolSearch(raster, plan, Strength(reference)).Find(tools);
  std::vector<CoarseReading> readings(tools.size());
  ParallelFor(static_cast<int>(tools.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    CoarseReading& reading = readings[k];
    reading.legs_share = places[k].share;
    reading.ambiguous = places[k].ambiguous;
    if (!places[k].found) return;
    reading.shift = places[k].shift;
    reading.ink = SampleInk(page, map, plan.settings, LegsAt(plan, tools[k], reading.shift));
    if (IsReadable(reading.ink)) ReadCombs(page, map, plan, reference, tools[k], reading);
  });
  return readings;
}

}  // namespace trammel::tool_offset
