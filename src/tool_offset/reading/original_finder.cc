#include "tool_offset/reading/original_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "tool_offset/reading/box_lines.h"
#include "tool_offset/reading/box_start.h"
#include "tool_offset/reading/small_page.h"

namespace trammel::tool_offset {
namespace {

/// How well a way round fits: ink where the reference combs stand alone above the paper between, in
/// parts of the box's ink.
constexpr double kLeastMatch = 0.45;
/// A wrong way round has single legs of combs under its own.
constexpr double kLeastLead = 0.25;

enum class Finding { kNothing, kPart, kOtherShape, kNoWayRound, kSheet };

struct Attempt {
  Finding finding = Finding::kNothing;
  SheetOnPage sheet;
};

/// The box as it is seen: the middle of its bar.
SheetPlan BarOf(const SheetPlan& plan) {
  SheetPlan bar;
  bar.original = true;
  bar.settings = plan.settings;
  const double inset_mm = plan.box_insets_mm.back() / 2;
  bar.settings.line_width_mm += 2 * inset_mm;
  bar.box_insets_mm = {0};
  bar.width_mm = plan.width_mm - 2 * inset_mm;
  bar.height_mm = plan.height_mm - 2 * inset_mm;
  return bar;
}

class Match {
 public:
  Match(const PageView& page, const SheetPlan& plan, const ChannelMix& mix, const PageMap& map)
      : page_(page), plan_(plan), mix_(mix), map_(map) {}

  double Score() {
    for (const Structure& structure : plan_.structures) Take(structure);
    return ink_.Mean() - paper_.Mean();
  }

 private:
  struct Sum {
    double sum = 0;
    int count = 0;
    [[nodiscard]] double Mean() const { return sum / std::max(1, count); }
  };

  void Take(const Structure& structure) {
    const std::size_t comb = structure.swapped ? 0 : 1;  // the reference tool's own
    const SheetSettings& settings = plan_.settings;
    const double half_mm = settings.leg_spacing_mm / 2;
    for (int finger = 0; finger < settings.teeth; ++finger) {
      if (finger == structure.incomplete[comb]) continue;
      const double at_mm = FingerPosition_mm(plan_, structure, comb, finger);
      for (const double aside_mm : {-half_mm, half_mm}) Add(structure, at_mm + aside_mm, ink_);
      Add(structure, at_mm, paper_);
      Add(structure, at_mm - settings.pitch_mm / 2, paper_);
    }
  }

  /// Where the comb stands alone, beyond what the other one's turns reach.
  void Add(const Structure& structure, double along_mm, Sum& sum) {
    constexpr double kFrom_mm = 0.3;  // beyond the other's turns; and to the own spine
    constexpr int kPlaces = 3;
    const SheetSettings& settings = plan_.settings;
    const double low_mm = settings.overlap_mm / 2 + plan_.turn_mm + kFrom_mm;
    const double high_mm = settings.leg_length_mm - settings.overlap_mm / 2 - kFrom_mm;
    const bool is_x = structure.axis == Axis::kX;
    for (int i = 0; i < kPlaces; ++i) {
      const double across_mm = (is_x ? structure.middle.v_mm : structure.middle.u_mm) + low_mm +
                               (high_mm - low_mm) * i / (kPlaces - 1);
      const SheetPoint at =
          is_x ? SheetPoint{along_mm, across_mm} : SheetPoint{across_mm, along_mm};
      // A place beside the page is no ink.
      if (SampleStrip(page_, mix_, {map_.ToPage(at), {}, {}, 1, 1}, sample_)) {
        sum.sum += static_cast<double>(sample_[0]);
      }
      ++sum.count;
    }
  }

  const PageView& page_;
  const SheetPlan& plan_;
  const ChannelMix& mix_;
  const PageMap& map_;
  Sum ink_;
  Sum paper_;
  std::vector<float> sample_;
};

/// Tries all ways round that the found lines of a box allow.
void TryWaysRound(const PageView& page, const SheetPlan& plan, const ChannelMix& mix,
                  const BoxFit& box, std::vector<std::pair<double, SheetOnPage>>& ways) {
  for (const bool flip_u : {false, true}) {
    for (const bool flip_v : {false, true}) {
      SheetOnPage sheet;
      sheet.map = Turned(box.map, flip_u, flip_v);
      sheet.box_places = box.places;
      sheet.box_rms_mm = box.rms_mm;
      sheet.reference_mix = mix;
      const double score = Match(page, plan, mix, sheet.map).Score();
      ways.emplace_back(score, std::move(sheet));
    }
  }
}

Attempt TryCandidate(const PageView& page, const SmallPage& small, const SheetPlan& plan,
                     const BoxCandidate& candidate, int threshold) {
  const SheetPlan bar = BarOf(plan);
  const ChannelMix mix = MixOfSides(small, candidate, threshold);
  std::vector<std::pair<double, SheetOnPage>> ways;
  bool other_shape = !candidate.straightened;
  for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
    const auto start = StartMap(small, candidate, side, bar);
    if (!start) continue;
    const double ratio = Length(start->u_px_mm) / Length(start->v_px_mm);
    if (std::abs(std::log(ratio)) > kAnisotropy) continue;
    other_shape = false;
    const BoxFit box = FitBox(page, mix, bar, *start);
    if (*std::min_element(box.support.begin(), box.support.end()) < kSideFound) continue;
    TryWaysRound(page, plan, mix, box, ways);
  }
  Attempt attempt;
  if (ways.empty()) {
    attempt.finding = other_shape ? Finding::kOtherShape : Finding::kNothing;
    return attempt;
  }
  std::stable_sort(ways.begin(), ways.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  const bool sure = ways[0].first >= kLeastMatch && ways[0].first >= ways[1].first + kLeastLead;
  attempt.finding = sure ? Finding::kSheet : Finding::kNoWayRound;
  attempt.sheet = std::move(ways[0].second);
  for (std::size_t i = 0; i < 4; ++i) {
    attempt.sheet.corners[i] = small.OnPage(candidate.corners[i].x_px, candidate.corners[i].y_px);
  }
  attempt.sheet.ink_is_darker = mix[0] + mix[1] + mix[2] < 0;
  DescribeTurn(attempt.sheet);
  return attempt;
}

struct Search {
  Attempt best;
  int sheets = 0;
};

Search SearchAt(const PageView& page, const SmallPage& small, const SheetPlan& plan, int threshold,
                bool widened) {
  constexpr double kPart = 0.25;  // of the page's longer side, for a box that is cut off
  constexpr int kMostTried = 20;  // a page full of frames is no sheet
  Search search;
  int tried = 0;
  std::vector<BoxCandidate> read;
  for (const BoxCandidate& candidate : FindBoxCandidates(small, threshold, widened)) {
    if (std::any_of(read.begin(), read.end(),
                    [&](const BoxCandidate& outer) { return Overlap(candidate, outer); })) {
      continue;
    }
    Attempt attempt;
    if (candidate.sides() == 4 && ++tried <= kMostTried) {
      attempt = TryCandidate(page, small, plan, candidate, threshold);
      if (attempt.finding == Finding::kSheet) {
        ++search.sheets;
        read.push_back(candidate);
      }
    }
    const bool whole = candidate.sides() == 4 && !candidate.straightened;
    const bool large = std::max(candidate.length(), candidate.width()) >
                       kPart * std::max(small.width, small.height);
    if (attempt.finding == Finding::kNothing && !whole && candidate.sides() >= 2 && large) {
      attempt.finding = Finding::kPart;
    }
    if (attempt.finding > search.best.finding) search.best = std::move(attempt);
  }
  return search;
}

std::string WhatToDo(Finding finding, const SheetPlan& plan) {
  const double width_mm = plan.width_mm;
  const double height_mm = plan.height_mm;
  switch (finding) {
    case Finding::kNoWayRound:
      return fmt::format(
          "a box was found, but whichever way round, the lines of T{} are not where an original "
          "sheet of {} pairs has them: check that it is the sheet of this file or list of tools, "
          "and that all lines of T{} stuck",
          plan.settings.reference_tool, plan.structures.size() / 4, plan.settings.reference_tool);
    case Finding::kOtherShape:
      return fmt::format(
          "the box on the page has not the shape of {:.0f} x {:.0f} mm, as that of {} pairs has: "
          "check that it is the sheet of this file or list of tools",
          width_mm, height_mm, plan.structures.size() / 4);
    case Finding::kPart:
      return fmt::format(
          "only a part of a box was found: the whole sheet, {:.0f} x {:.0f} mm with all four sides "
          "of its box, must be on the scan, unbroken and seen from straight above",
          width_mm, height_mm);
    case Finding::kNothing:
    case Finding::kSheet:
      break;
  }
  return fmt::format(
      "no sheet of the original generator was found on the page: no closed box of {:.0f} x {:.0f} "
      "mm, as that of {} pairs has. Check the list of tools; put the sheet on the glass with its "
      "printed side down and scan at 300 dpi or more",
      width_mm, height_mm, plan.structures.size() / 4);
}

}  // namespace

Result<SheetOnPage> FindOriginalSheet(const PageView& page, const SheetPlan& plan) {
  constexpr std::array<double, 3> kThresholds{0.45, 0.25, 0.12};  // of ink's strength
  constexpr int kLowest = 8;
  if (const auto usable = CheckPage(page); !usable) return tl::unexpected(usable.error());
  const SmallPage small = Shrink(page);
  const int strength = InkStrength(small);
  Attempt best;
  for (const bool widened : {false, true}) {
    int last_threshold = 256;
    for (const double part : kThresholds) {
      const int threshold = std::max(kLowest, static_cast<int>(part * strength));
      if (threshold >= last_threshold || best.finding == Finding::kSheet) break;
      last_threshold = threshold;
      Search search = SearchAt(page, small, plan, threshold, widened);
      if (search.sheets > 1) {
        return Fail(
            fmt::format("{} sheets were found on the page: scan one at a time", search.sheets),
            ErrorKind::kMeasurement);
      }
      if (search.best.finding > best.finding) best = std::move(search.best);
    }
  }
  if (best.finding == Finding::kSheet) return std::move(best.sheet);
  return Fail(WhatToDo(best.finding, plan), ErrorKind::kMeasurement);
}

}  // namespace trammel::tool_offset
