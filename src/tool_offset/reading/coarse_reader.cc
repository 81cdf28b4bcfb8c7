#include "tool_offset/reading/coarse_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>

#include "base/measured.h"
#include "base/parallel.h"
#include "base/statistics.h"
#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/reading/leg_reader.h"
#include "tool_offset/reading/structure_reader.h"
#include "tool_offset/reading/tool_search.h"

namespace trammel::tool_offset {
namespace {

/// Position of a comb by its own fingers: the median of their displacements from the plan.
struct CombPlace {
  double shift_mm = 0;    ///< along the structure's axis, with `about`
  double spread_mm = 0;   ///< robust standard deviation of the fingers
  bool searched = false;  ///< true if its fingers were unreadable: result of the search only
};

/// Shifts of every tool that draws on the sheet, found or assumed.
using Shifts = std::map<int, SheetPoint>;

/// Returns the lines of all other combs along those of one comb, as they were printed.
std::vector<ForeignLeg> LinesBeside(const SheetPlan& plan, const Shifts& shifts,
                                    const ToolComb& own) {
  std::vector<ForeignLeg> lines;
  for (std::size_t i = 0; i < plan.structures.size(); ++i) {
    const Structure& structure = plan.structures[i];
    if (structure.axis != plan.structures[own.structure].axis) continue;
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      const auto shift = shifts.find(structure.combs[comb].tool);
      if (shift == shifts.end() || (i == own.structure && comb == own.comb)) continue;
      for (int finger = 0; finger < plan.settings.teeth; ++finger) {
        for (const Leg& leg : FingerLegs(plan, structure, comb, finger)) {
          lines.push_back({shift->first, Shifted(leg, shift->second)});
        }
      }
    }
  }
  return lines;
}

/// Longest piece along a finger's legs without other lines that may be taken for one of its own.
struct FreeRows {
  Interval rows;
  int crowded_by = -1;  ///< whose lines take of it, the reference tool's last; -1: nobody's
};

FreeRows FindFreeRows(const SheetSettings& settings, const FingerSite& site,
                      std::span<const ForeignLeg> lines) {
  constexpr double kPaper_mm = 0.25;  // minimum between two lines
  const double near_mm = settings.leg_spacing_mm / 2 + settings.line_width_mm + kPaper_mm;
  const Axis axis = site.axis;
  const double along_mm = Across(axis, site.middle);  // the leg
  FreeRows free{{site.low_mm, site.high_mm}};
  for (const ForeignLeg& line : lines) {
    const Leg& leg = line.leg;
    if (std::abs(Along(axis, leg.start) - Along(axis, site.middle)) >= near_mm) continue;
    const double start_mm = Across(axis, leg.start);
    const double end_mm = Across(axis, leg.end);
    const auto [low, high] = std::minmax(start_mm, end_mm);
    const double below_mm = std::min(free.rows.hi, low - kLegEnd_mm - along_mm);
    const double above_mm = std::max(free.rows.lo, high + kLegEnd_mm - along_mm);
    if (below_mm >= free.rows.hi || above_mm <= free.rows.lo) continue;
    free.rows = below_mm - free.rows.lo > free.rows.hi - above_mm
                    ? Interval{free.rows.lo, below_mm}
                    : Interval{above_mm, free.rows.hi};
    if (free.crowded_by < 0 || line.tool != settings.reference_tool) free.crowded_by = line.tool;
  }
  return free;
}

/// Result of locating a comb's fingers one by one.
struct CombRead {
  std::optional<CombPlace> place;  ///< nothing where too few were found
  int crowded_by = -1;             ///< whose lines leave too few that can be read; -1: enough can
};

CombRead LocateFingers(const PageView& page, const PageMap& map, const SheetPlan& plan,
                       const ToolComb& tool_comb, const ChannelMix& mix, const Shifts& shifts) {
  constexpr double kReach_mm = 0.3;
  constexpr double kMinRows_mm = 1;
  const SheetSettings& settings = plan.settings;
  const std::size_t fewest = std::max(4, (settings.teeth + 2) / 3);
  const Structure& structure = plan.structures[tool_comb.structure];
  const SheetPoint about = shifts.at(structure.combs[tool_comb.comb].tool);
  const std::vector<ForeignLeg> lines = LinesBeside(plan, shifts, tool_comb);
  ReaderWorkspace workspace;
  std::vector<double> found_mm;
  std::size_t readable = 0;
  CombRead read;
  for (int finger = 0; finger < settings.teeth; ++finger) {
    const Leg leg = Shifted(FingerLegs(plan, structure, tool_comb.comb, finger)[0], about);
    FingerSite site;
    site.axis = structure.axis;
    site.middle =
        SheetPoint{(leg.start.u_mm + leg.end.u_mm) / 2, (leg.start.v_mm + leg.end.v_mm) / 2} +
        PointAt(site.axis, settings.leg_spacing_mm / 2, 0);
    site.high_mm = settings.leg_length_mm / 2 - kLegEnd_mm;
    site.low_mm = -site.high_mm;
    const FreeRows free = FindFreeRows(settings, site, lines);
    if (free.rows.hi - free.rows.lo < kMinRows_mm) {
      if (read.crowded_by < 0 || free.crowded_by != settings.reference_tool) {
        read.crowded_by = free.crowded_by;
      }
      continue;
    }
    site.low_mm = site.clear_low_mm = free.rows.lo;
    site.high_mm = site.clear_high_mm = free.rows.hi;
    ++readable;
    const auto found = LocateFinger(page, mix, map, settings, site, kReach_mm, workspace);
    if (found) found_mm.push_back(*found);
  }
  if (readable >= fewest) read.crowded_by = -1;
  if (found_mm.size() < fewest) return read;
  read.place = {Median(found_mm) + Along(structure.axis, about), RobustStandardDeviation(found_mm)};
  return read;
}

ChannelMix MixOf(const InkColour& ink) {
  ChannelMix mix = InkChannelMix(ink.best());
  for (float& weight : mix) weight /= static_cast<float>(ink.contrast[ink.best()]);
  return mix;
}

/// Returns legs of the tool's combs at their measured positions.
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

/// Positions by the structures of one axis.
struct AxisPlaces {
  std::vector<double> absolute_mm;
  std::vector<double> relative_mm;
  double worst_spread_mm = 0;
  bool searched = false;

  void Add(const CombPlace& own, const CombPlace& beside) {
    const bool only_searched = own.searched || beside.searched;
    if (only_searched && !searched && !absolute_mm.empty()) return;
    if (!only_searched && searched) *this = {};  // readings replace search results
    searched = only_searched;
    absolute_mm.push_back(own.shift_mm);
    relative_mm.push_back(own.shift_mm - beside.shift_mm);
    worst_spread_mm = std::max({worst_spread_mm, own.spread_mm, beside.spread_mm});
  }
  [[nodiscard]] double uncertainty_mm() const {
    /// Half a line, if ink of the reference tool hides the tool's.
    constexpr double kSearched_mm = 0.15;
    if (searched) return kSearched_mm;
    /// A pixel at 300 dpi, the resolution of fingers' positions, and the difference between two
    /// tools' backlash.
    constexpr double kMin_mm = 0.025;
    const double apart_mm =
        relative_mm.size() < 2 ? 0 : std::abs(relative_mm[0] - relative_mm[1]) / 2;
    return std::hypot(kMin_mm, std::max(apart_mm, 0.3 * worst_spread_mm));
  }
};

void ReadCombs(const PageView& page, const PageMap& map, const SheetPlan& plan,
               const InkColour& reference, const Shifts& shifts, int tool, CoarseReading& reading) {
  std::array<AxisPlaces, 2> axes;
  for (const ToolComb& comb : CombsOf(plan, tool)) {
    const Axis axis = plan.structures[comb.structure].axis;
    const ToolComb other{comb.structure, 1 - comb.comb};
    CombRead own = LocateFingers(page, map, plan, comb, MixOf(reading.ink), shifts);
    CombRead beside = LocateFingers(page, map, plan, other, MixOf(reference), shifts);
    for (const CombRead* read : {&own, &beside}) {
      if (read->place) reading.spread_mm = std::max(reading.spread_mm, read->place->spread_mm);
    }
    const bool crowded = own.crowded_by >= 0 || beside.crowded_by >= 0;
    int by_another = -1;
    for (const int by : {own.crowded_by, beside.crowded_by}) {
      if (by >= 0 && by != tool && by != plan.settings.reference_tool) by_another = by;
    }
    if (by_another >= 0) reading.beside = by_another;
    // Hidden by the reference tool's lines: uses the shift of the search over the visible rest.
    if (crowded && by_another < 0) {
      own.place = {Along(axis, reading.shift), 0, true};
      beside.place = {0, 0, true};
    }
    if (!own.place || !beside.place) continue;
    axes[axis == Axis::kX ? 0 : 1].Add(*own.place, *beside.place);
  }
  reading.found = !axes[0].absolute_mm.empty() && !axes[1].absolute_mm.empty();
  if (!reading.found) return;
  reading.beside = -1;
  reading.shift = {Mean(axes[0].absolute_mm), Mean(axes[1].absolute_mm)};
  reading.from_reference = {Mean(axes[0].relative_mm), Mean(axes[1].relative_mm)};
  reading.standard_uncertainty_mm = std::max(axes[0].uncertainty_mm(), axes[1].uncertainty_mm());
  // A position one leg farther fits the fingers of a single structure as well: the interval
  // contains both.
  const auto few = [](const AxisPlaces& axis) {
    return axis.searched || axis.absolute_mm.size() < 2;
  };
  if (few(axes[0]) && few(axes[1]) && (axes[0].searched || axes[1].searched)) {
    reading.standard_uncertainty_mm =
        std::hypot(reading.standard_uncertainty_mm, plan.settings.leg_spacing_mm / 2);
  }
}

}  // namespace

std::vector<CoarseReading> ReadCoarsely(const PageView& page, const PageMap& map,
                                        const SheetPlan& plan, const InkRaster& raster,
                                        const InkColour& reference, const std::vector<int>& tools) {
  const std::vector<ToolPlace> places = ToolSearch(raster, plan, Strength(reference)).Find(tools);
  Shifts shifts{{plan.settings.reference_tool, {}}};
  for (std::size_t i = 0; i < tools.size(); ++i) {
    if (places[i].found || places[i].ambiguous) shifts[tools[i]] = places[i].shift;
  }
  std::vector<CoarseReading> readings(tools.size());
  ParallelFor(static_cast<int>(tools.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    CoarseReading& reading = readings[k];
    reading.legs_share = places[k].share;
    reading.ambiguous = places[k].ambiguous;
    reading.beside = places[k].beside;
    if (!places[k].found) return;
    reading.beside = -1;
    reading.placed = true;
    reading.shift = places[k].shift;
    const std::vector<Leg> legs = LegsAt(plan, tools[k], reading.shift);
    reading.ink = SampleInk(page, map, plan.settings, legs);
    reading.strength = MedianStrength(raster, legs);
    if (IsReadable(reading.ink)) ReadCombs(page, map, plan, reference, shifts, tools[k], reading);
  });
  return readings;
}

}  // namespace trammel::tool_offset
