#include "tool_offset/reading/tool_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tool_offset/reading/leg_reader.h"
#include "tool_offset/reading/shift_scores.h"

namespace trammel::tool_offset {
namespace {

using Claims = std::vector<std::vector<PlaceClaim>>;

/// One place for each tool, and the number of explanations of each cell.
class Explanation {
 public:
  Explanation(const Claims& claims, std::size_t cells)
      : claims_(&claims), place_(claims.size(), -1), times_(cells, 0) {}

  [[nodiscard]] const std::vector<int>& places() const { return place_; }
  /// Returns the explained cells of ink minus those missing.
  [[nodiscard]] double explained() const { return explained_; }

  void Put(std::size_t tool, int place) {
    Take(tool);
    place_[tool] = place;
    if (place < 0) return;
    explained_ += Gain(tool, place);
    for (const auto& ink : claim(tool, place).ink) {
      for (const std::uint32_t cell : ink) ++times_[cell];
    }
  }

  /// Moves one tool after the other, except `fixed`, to its best place, until none moves.
  void Settle(std::size_t fixed, bool backwards = false) {
    constexpr int kMaxRounds = 8;  // each explains more; two suffice but for ties
    bool moved = true;
    for (int round = 0; moved && round < kMaxRounds; ++round) {
      moved = false;
      for (std::size_t i = 0; i < place_.size(); ++i) {
        const std::size_t tool = backwards ? place_.size() - 1 - i : i;
        if (tool == fixed) continue;
        const int before = place_[tool];
        Take(tool);
        Put(tool, BestPlace(tool));
        moved |= place_[tool] != before;
      }
    }
  }

  /// Counts cells at a tool's position that no other explains, less those missing, along an axis.
  [[nodiscard]] double Own(std::size_t tool, std::size_t axis) const {
    const PlaceClaim& at = claim(tool, place_[tool]);
    const auto alone = std::count_if(at.ink[axis].begin(), at.ink[axis].end(),
                                     [&](std::uint32_t cell) { return times_[cell] == 1; });
    return static_cast<double>(alone) - at.missing[axis];
  }

 private:
  [[nodiscard]] const PlaceClaim& claim(std::size_t tool, int place) const {
    return (*claims_)[tool][static_cast<std::size_t>(place)];
  }
  void Take(std::size_t tool) {
    const int place = place_[tool];
    if (place < 0) return;
    for (const auto& ink : claim(tool, place).ink) {
      for (const std::uint32_t cell : ink) --times_[cell];
    }
    place_[tool] = -1;
    explained_ -= Gain(tool, place);
  }
  [[nodiscard]] double Gain(std::size_t tool, int place) const {
    const PlaceClaim& at = claim(tool, place);
    std::ptrdiff_t added = 0;
    for (const auto& ink : at.ink) {
      added += std::count_if(ink.begin(), ink.end(),
                             [&](std::uint32_t cell) { return times_[cell] == 0; });
    }
    return static_cast<double>(added) - at.missing[0] - at.missing[1];
  }
  [[nodiscard]] int BestPlace(std::size_t tool) const {
    int best = -1;
    double most = 0;
    for (int place = 0; place < static_cast<int>((*claims_)[tool].size()); ++place) {
      const double gain = Gain(tool, place);
      if (gain <= most) continue;
      most = gain;
      best = place;
    }
    return best;
  }

  const Claims* claims_;
  std::vector<int> place_;
  std::vector<std::uint8_t> times_;
  double explained_ = 0;
};

/// Returns the tool that explains most of a tool's ink as well, at its place or its first one.
int Beside(const Claims& claims, const std::vector<int>& places, std::size_t tool,
           std::vector<std::uint8_t>& mask) {
  if (claims[tool].empty()) return -1;
  const auto for_each_cell = [&](std::size_t of, const auto& visit) {
    for (const auto& ink : claims[of][static_cast<std::size_t>(std::max(0, places[of]))].ink) {
      for (const std::uint32_t cell : ink) visit(cell);
    }
  };
  for_each_cell(tool, [&](std::uint32_t cell) { mask[cell] = 1; });
  int beside = -1;
  int most = 0;
  for (std::size_t other = 0; other < places.size(); ++other) {
    if (other == tool || places[other] < 0) continue;
    int shared = 0;
    for_each_cell(other, [&](std::uint32_t cell) { shared += mask[cell]; });
    if (shared <= most) continue;
    most = shared;
    beside = static_cast<int>(other);
  }
  for_each_cell(tool, [&](std::uint32_t cell) { mask[cell] = 0; });
  return beside;
}

/// Numbers the cells of all claims from 0 on, and returns their count.
std::size_t NumberCells(Claims& claims) {
  std::vector<std::uint32_t> cells;
  const auto for_each_list = [&](const auto& visit) {
    for (auto& of_tool : claims) {
      for (PlaceClaim& claim : of_tool) {
        for (auto& ink : claim.ink) visit(ink);
      }
    }
  };
  for_each_list([&](const auto& ink) { cells.insert(cells.end(), ink.begin(), ink.end()); });
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  for_each_list([&](auto& ink) {
    for (std::uint32_t& cell : ink) {
      cell = static_cast<std::uint32_t>(std::lower_bound(cells.begin(), cells.end(), cell) -
                                        cells.begin());
    }
  });
  return cells.size();
}

}  // namespace

std::vector<PlaceChoice> ChoosePlaces(Claims claims) {
  const std::size_t cells = NumberCells(claims);
  constexpr double kNobody = std::numeric_limits<double>::infinity();
  Explanation best(claims, cells);
  best.Settle(claims.size());
  std::vector<double> lead(claims.size(), kNobody);
  // Tries every tool at each of its other places; restarts after an improvement.
  for (bool improved = true; improved;) {
    improved = false;
    std::fill(lead.begin(), lead.end(), kNobody);
    for (std::size_t tool = 0; tool < claims.size() && !improved; ++tool) {
      const int places = static_cast<int>(claims[tool].size());
      for (int place = -1; place < places && !improved; ++place) {
        if (place == best.places()[tool]) continue;
        Explanation other = best;
        other.Put(tool, place);
        other.Settle(tool);
        // Starts from the others' positions and from none, in either order: overlapping claims have
        // several optima.
        for (const bool backwards : {false, true}) {
          Explanation anew(claims, cells);
          anew.Put(tool, place);
          anew.Settle(tool, backwards);
          if (anew.explained() > other.explained()) other = anew;
        }
        const double ahead = best.explained() - other.explained();
        improved = ahead < 0;  // the same sum of cells in another order is the same
        if (improved) best = other;
        for (std::size_t i = 0; i < claims.size(); ++i) {
          if (other.places()[i] != best.places()[i]) lead[i] = std::min(lead[i], ahead);
        }
      }
    }
  }
  std::vector<PlaceChoice> choices(claims.size());
  std::vector<std::uint8_t> mask(cells, 0);
  for (std::size_t tool = 0; tool < claims.size(); ++tool) {
    PlaceChoice& choice = choices[tool];
    choice.place = best.places()[tool];
    choice.beside = Beside(claims, best.places(), tool, mask);
    if (choice.place < 0) continue;
    choice.lead = lead[tool];
    choice.own = {best.Own(tool, 0), best.Own(tool, 1)};
  }
  return choices;
}

namespace {

/// Step between claimed rows along a leg, in cells.
constexpr int kClaimStep = 3;

/// Counts the claimed cells that a tool's legs would ink, by axis.
std::array<double, 2> WholeClaim(const SheetPlan& plan, int tool) {
  const double leg_cells = (plan.settings.leg_length_mm - 2 * kLegEnd_mm) / kInkCell_mm /
                           kClaimStep * plan.settings.line_width_mm / kInkCell_mm;
  std::array<double, 2> whole{};
  for (const Structure& structure : plan.structures) {
    for (const Comb& comb : structure.combs) {
      if (comb.tool != tool) continue;
      whole[structure.axis == Axis::kX ? 0 : 1] += 2 * plan.settings.teeth * leg_cells;
    }
  }
  return whole;
}

/// True if a position is clearly the best, and the tool's own ink shows it along both axes.
/// @param share  of the legs that are there.
/// @param left   cells of ink in the box that no clearly located tool explains.
bool IsSure(const PlaceChoice& choice, const std::array<double, 2>& whole, double share,
            double left) {
  /// Limits in parts of all its ink: other ink makes half of a tool's legs at most.
  constexpr double kMinLead = 0.15;
  constexpr double kMinLeadOfPart = 0.3;
  constexpr double kMinOwn = 0.2;
  constexpr double kMinOwnOfAxis = 0.1;
  constexpr double kNearlyAll = 0.93;
  constexpr double kMaxLeft = 0.5;
  const double all = whole[0] + whole[1];
  const bool part = share < kNearlyAll;
  // If enough ink remains for its lines elsewhere, perhaps beyond the search range, only a nearly
  // complete fit counts.
  if (part && left >= kMaxLeft * all) return false;
  return choice.lead >= (part ? kMinLeadOfPart : kMinLead) * all &&
         choice.own[0] + choice.own[1] >= kMinOwn * all &&
         choice.own[0] >= kMinOwnOfAxis * whole[0] && choice.own[1] >= kMinOwnOfAxis * whole[1];
}

}  // namespace

ToolSearch::ToolSearch(const InkRaster& raster, const SheetPlan& plan, double ink_strength)
    : raster_(raster),
      plan_(plan),
      ink_strength_(ink_strength),
      explained_(raster.strength.size(), 0) {
  Explain(plan.settings.reference_tool, {}, explained_);
  const double half_mm = plan.settings.line_width_mm / 2 + kInkCell_mm;
  for (const CodeCell& cell : plan.code) {
    if (cell.dark) PaintLeg(raster, CodeLeg(plan, cell), half_mm, explained_);
  }
  for (const double inset_mm : plan.box_insets_mm) {
    const double u_mm = plan.width_mm / 2 - inset_mm;
    const double v_mm = plan.height_mm / 2 - inset_mm;
    for (const double sign : {-1.0, 1.0}) {
      PaintLeg(raster, {{-u_mm, sign * v_mm}, {u_mm, sign * v_mm}}, half_mm, explained_);
      PaintLeg(raster, {{sign * u_mm, -v_mm}, {sign * u_mm, v_mm}}, half_mm, explained_);
    }
  }
}

void ToolSearch::Explain(int tool, SheetPoint shift, std::vector<std::uint8_t>& explained) const {
  const double half_mm = plan_.settings.line_width_mm / 2 + kInkCell_mm;
  for (const Leg& leg : LegsOfTool(plan_, tool)) {
    PaintLeg(raster_, Shifted(leg, shift), half_mm, explained);
  }
}

PlaceClaim ToolSearch::Claim(int tool, SheetPoint shift, double threshold) const {
  constexpr int kAside = 2;  // cells by which paper lies elsewhere under one comb than another
  const int half_leg =
      static_cast<int>((plan_.settings.leg_length_mm / 2 - kLegEnd_mm) / kInkCell_mm);
  const double line_cells = plan_.settings.line_width_mm / kInkCell_mm;
  const int half_line = static_cast<int>(std::lround(line_cells / 2)) + 1;
  PlaceClaim claim;
  for (std::size_t i = 0; i < plan_.structures.size(); ++i) {
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      if (plan_.structures[i].combs[comb].tool != tool) continue;
      const CombCells cells = CellsOf(raster_, plan_, {i, comb}, shift);
      const std::size_t axis = cells.along_v ? 0 : 1;
      // Cells at a distance from the middle lines, in the rows across the legs that all claims
      // share.
      const auto for_each = [&](int aside, const auto& visit) {
        for (const auto& [column, row] : cells.middle) {
          const int middle = cells.along_v ? row : column;
          const int across = (cells.along_v ? column : row) + aside;
          const int last_across = (cells.along_v ? raster_.columns : raster_.rows) - 1;
          const int last_along = (cells.along_v ? raster_.rows : raster_.columns) - 1;
          if (across < 0 || across > last_across) continue;
          const int low = std::max(0, middle - half_leg);
          for (int along = (low + kClaimStep - 1) / kClaimStep * kClaimStep;
               along <= std::min(last_along, middle + half_leg); along += kClaimStep) {
            const std::size_t cell =
                cells.along_v ? raster_.at(across, along) : raster_.at(along, across);
            if (explained_[cell] == 0) visit(cell);
          }
        }
      };
      int best_aside = 0;
      int least = -1;
      for (const int aside : {0, -1, 1, -kAside, kAside}) {
        int missing = 0;
        for_each(aside,
                 [&](std::size_t cell) { missing += raster_.strength[cell] < threshold ? 1 : 0; });
        if (least >= 0 && missing >= least) continue;
        least = missing;
        best_aside = aside;
      }
      claim.missing[axis] += least * line_cells;
      for (int by = -half_line; by <= half_line; ++by) {
        for_each(best_aside + by, [&](std::size_t cell) {
          if (raster_.strength[cell] < threshold) return;
          claim.ink[axis].push_back(static_cast<std::uint32_t>(cell));
        });
      }
    }
  }
  // Adjacent legs share cells.
  for (auto& ink : claim.ink) {
    std::sort(ink.begin(), ink.end());
    ink.erase(std::unique(ink.begin(), ink.end()), ink.end());
  }
  return claim;
}

double ToolSearch::InkLeft(const std::vector<std::uint8_t>& explained, double threshold) const {
  const int first_column = std::max(0, raster_.Column(-plan_.width_mm / 2));
  const int last_column = std::min(raster_.columns - 1, raster_.Column(plan_.width_mm / 2));
  const int last_row = std::min(raster_.rows - 1, raster_.Row(plan_.height_mm / 2));
  std::ptrdiff_t cells = 0;
  for (int row = std::max(0, raster_.Row(-plan_.height_mm / 2)); row <= last_row; ++row) {
    for (int column = first_column; column <= last_column; ++column) {
      const std::size_t cell = raster_.at(column, row);
      cells += explained[cell] == 0 && raster_.strength[cell] >= threshold ? 1 : 0;
    }
  }
  return static_cast<double>(cells) / kClaimStep;
}

ToolSearch::LegContrast ToolSearch::Contrast(const ToolComb& comb, SheetPoint shift,
                                             const std::vector<std::uint8_t>& explained) const {
  const Structure& structure = plan_.structures[comb.structure];
  const bool along_v = structure.axis == Axis::kX;
  const int aside = static_cast<int>(std::lround(plan_.settings.leg_spacing_mm / 2 / kInkCell_mm));
  const int half = static_cast<int>((plan_.settings.leg_length_mm / 2 - kLegEnd_mm) / kInkCell_mm);
  // Sums over the line and the paper on both sides, without known ink.
  std::array<double, 2> sum{};
  std::array<double, 2> cells{};
  for (const auto& [column, row] : CellsOf(raster_, plan_, comb, shift).middle) {
    for (int along = -half; along <= half; ++along) {
      for (const int across : {-aside, -1, 0, 1, aside}) {
        const int x = column + (along_v ? across : along);
        const int y = row + (along_v ? along : across);
        if (x < 0 || y < 0 || x >= raster_.columns || y >= raster_.rows) continue;
        const std::size_t cell = raster_.at(x, y);
        if (explained[cell] != 0) continue;
        const std::size_t which = std::abs(across) == aside ? 1 : 0;
        sum[which] += raster_.strength[cell];
        cells[which] += 1;
      }
    }
  }
  return {sum[0] / std::max(1.0, cells[0]), sum[1] / std::max(1.0, cells[1]), cells[0]};
}

bool ToolSearch::IsEven(int tool, SheetPoint shift,
                        const std::vector<std::uint8_t>& explained) const {
  constexpr double kMinShare = 0.82;  // of the darkest comb; one tool's differ by 0.14 at most
  constexpr double kMinOpen = 0.3;    // of a comb's cells: fewer are the rims of known lines
  constexpr int kApart = 3;           // cells by which combs lie unlike each other
  const double whole_cells = 3.0 * 2 * plan_.settings.teeth *
                             (plan_.settings.leg_length_mm - 2 * kLegEnd_mm) / kInkCell_mm;
  double least = 1e9;
  double most = 0;
  for (const ToolComb& comb : CombsOf(plan_, tool)) {
    const Axis axis = plan_.structures[comb.structure].axis;
    LegContrast darkest;
    for (int i = -kApart; i <= kApart; ++i) {
      const double by_mm = i * kInkCell_mm;
      const LegContrast legs = Contrast(comb, shift + PointAt(axis, by_mm, 0), explained);
      if (legs.contrast() > darkest.contrast()) darkest = legs;
    }
    if (darkest.open_cells < kMinOpen * whole_cells) continue;
    least = std::min(least, darkest.contrast());
    most = std::max(most, darkest.contrast());
  }
  return least >= kMinShare * most;
}

SheetPoint ToolSearch::Refine(int tool, SheetPoint shift,
                              const std::vector<std::uint8_t>& explained) const {
  constexpr int kPlateau = 6;  // cells: of the search, and its steps
  // Beyond the shift at which one leg takes the other's place.
  const int reach =
      kPlateau + static_cast<int>(std::lround(plan_.settings.leg_spacing_mm / kInkCell_mm));
  for (int pass = 0; pass < 2; ++pass) {
    std::array<double, 2> max_open{};
    SheetPoint refined = shift;
    for (const ToolComb& comb : CombsOf(plan_, tool)) {
      const Axis axis = plan_.structures[comb.structure].axis;
      const bool is_x = axis == Axis::kX;
      double best = -1e9;
      double best_open = 0;
      double best_mm = 0;
      for (int i = -reach; i <= reach; ++i) {
        const double by_mm = i * kInkCell_mm;
        const SheetPoint at = shift + PointAt(axis, by_mm, 0);
        const LegContrast legs = Contrast(comb, at, explained);
        if (legs.contrast() <= best || (std::abs(i) > kPlateau && !legs.paper_is_clean())) continue;
        best = legs.contrast();
        best_open = legs.open_cells;
        best_mm = by_mm;
      }
      // Uses the comb of each axis that known ink hides least.
      double& most = max_open[is_x ? 0 : 1];
      if (best_open <= most) continue;
      most = best_open;
      (is_x ? refined.u_mm : refined.v_mm) = Along(axis, shift) + best_mm;
    }
    shift = refined;
  }
  return shift;
}

bool ToolSearch::LookOnce(const std::vector<int>& tools, double threshold,
                          std::vector<ToolPlace>& places) {
  const LegMarks legs = {JudgeLegs(raster_, explained_, plan_.settings, true, threshold),
                         JudgeLegs(raster_, explained_, plan_.settings, false, threshold)};
  std::vector<std::size_t> open;
  std::vector<std::vector<Candidate>> candidates;
  std::vector<std::vector<PlaceClaim>> claims;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    if (places[i].found) continue;
    open.push_back(i);
    candidates.push_back(FindCandidates(raster_, plan_, legs, tools[i]));
    claims.emplace_back();
    for (const Candidate& candidate : candidates.back()) {
      claims.back().push_back(Claim(tools[i], candidate.shift, threshold));
    }
    places[i] = {};
    if (!candidates.back().empty()) places[i].share = candidates.back().front().share;
  }
  const std::vector<PlaceChoice> choices = ChoosePlaces(std::move(claims));
  std::vector<std::uint8_t> others = explained_;
  for (std::size_t k = 0; k < open.size(); ++k) {
    if (choices[k].place < 0) continue;
    const Candidate& candidate = candidates[k][static_cast<std::size_t>(choices[k].place)];
    if (!IsSure(choices[k], WholeClaim(plan_, tools[open[k]]), candidate.share, 0)) continue;
    Explain(tools[open[k]], candidate.shift, others);
  }
  const double left = InkLeft(others, threshold);
  bool more = false;
  for (std::size_t k = 0; k < open.size(); ++k) {
    const PlaceChoice& choice = choices[k];
    const int tool = tools[open[k]];
    ToolPlace& place = places[open[k]];
    place.beside = choice.beside < 0 ? -1 : tools[open[static_cast<std::size_t>(choice.beside)]];
    if (choice.place < 0) continue;
    const Candidate& candidate = candidates[k][static_cast<std::size_t>(choice.place)];
    place.shift = candidate.shift;
    place.share = candidate.share;
    place.found = IsSure(choice, WholeClaim(plan_, tool), candidate.share, left);
    place.ambiguous = !place.found;
    if (!place.found) continue;
    others = explained_;
    for (std::size_t m = 0; m < open.size(); ++m) {
      if (m == k || choices[m].place < 0) continue;
      Explain(tools[open[m]], candidates[m][static_cast<std::size_t>(choices[m].place)].shift,
              others);
    }
    place.shift = Refine(tool, candidate.shift, others);
    place.found = place.beside < 0 || IsEven(tool, place.shift, others);
    place.ambiguous = !place.found;
    more |= place.found;
  }
  for (const std::size_t i : open) {
    if (places[i].found) Explain(tools[i], places[i].shift, explained_);
  }
  return more;
}

std::vector<ToolPlace> ToolSearch::Find(const std::vector<int>& tools) {
  const double faint = raster_.FaintestInk();
  std::vector<ToolPlace> places(tools.size());
  for (const double threshold : {std::max(faint, 0.35 * ink_strength_), faint}) {
    // Found tools explain ink, which may reveal the others.
    for (bool more = true; more;) {
      if (std::all_of(places.begin(), places.end(), [](const auto& p) { return p.found; })) break;
      more = LookOnce(tools, threshold, places);
    }
  }
  return places;
}

}  // namespace trammel::tool_offset
