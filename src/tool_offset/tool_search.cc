#include "tool_offset/tool_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tool_offset/leg_marks.h"
#include "tool_offset/leg_reader.h"
#include "tool_offset/parallel.h"

namespace trammel::tool_offset {
namespace {

/// Cells from one shift that is tried to the next: half a line.
constexpr int kShiftStep = 2;
constexpr double kStep_mm = kShiftStep * kInkCell_mm;

/// Within this a place is the same as another: two lines.
constexpr double kSame_mm = 1;

/// Of the score, by which a place has to be ahead of all others,
constexpr double kClearly = 0.15;
/// and where nearly all legs that can be judged are there, and others are only hidden.
constexpr double kNearlyAll = 0.93;
constexpr double kClearlyOfAll = 0.08;

/// More places than these that are nearly as good: nothing tells.
constexpr std::size_t kMostRivals = 6;

/// Where the middles of a comb's legs lie in the raster, and along which image they are looked up.
struct CombCells {
  bool along_v = true;
  std::vector<std::array<int, 2>> middle;  ///< column, row
};

CombCells CellsOf(const InkRaster& raster, const SheetPlan& plan, const ToolComb& tool_comb,
                  SheetPoint shift = {}) {
  const Structure& structure = plan.structures[tool_comb.structure];
  CombCells cells;
  cells.along_v = structure.axis == Axis::kX;
  for (int finger = 0; finger < plan.settings.teeth; ++finger) {
    for (const Leg& leg : FingerLegs(plan, structure, tool_comb.comb, finger)) {
      cells.middle.push_back({raster.Column((leg.start.u_mm + leg.end.u_mm) / 2 + shift.u_mm),
                              raster.Row((leg.start.v_mm + leg.end.v_mm) / 2 + shift.v_mm)});
    }
  }
  return cells;
}

struct ShiftGrid {
  int half = 0;  ///< shifts to either side
  [[nodiscard]] int side() const { return 2 * half + 1; }
  [[nodiscard]] std::size_t at(int i, int j) const {
    return static_cast<std::size_t>((j + half) * side() + i + half);
  }
};

/// A comb's marks at each shift, in parts of kWholeLeg.
struct CombMarks {
  std::vector<std::int16_t> sum;     ///< legs that are there less those that are not
  std::vector<std::int16_t> judged;  ///< all of them
};

CombMarks MarkComb(const InkRaster& raster, const std::vector<std::int8_t>& legs,
                   const CombCells& comb, const ShiftGrid& grid) {
  CombMarks marks;
  const auto size = static_cast<std::size_t>(grid.side() * grid.side());
  marks.sum.assign(size, 0);
  marks.judged.assign(size, 0);
  for (int j = -grid.half; j <= grid.half; ++j) {
    for (const auto& [column, row] : comb.middle) {
      const int y = row + j * kShiftStep;
      for (int i = -grid.half; i <= grid.half; ++i) {
        const int x = column + i * kShiftStep;
        const bool within = x >= 0 && y >= 0 && x < raster.columns && y < raster.rows;
        const int mark = within ? legs[raster.at(x, y)] : -kWholeLeg;
        const std::size_t at = grid.at(i, j);
        marks.sum[at] = static_cast<std::int16_t>(marks.sum[at] + mark);
        marks.judged[at] = static_cast<std::int16_t>(marks.judged[at] + std::abs(mark));
      }
    }
  }
  return marks;
}

/// Paper that lies a little elsewhere under one comb than under another: the best of the shifts
/// next to each.
CombMarks BestNearby(const CombMarks& marks, const ShiftGrid& grid) {
  CombMarks best = marks;
  for (int j = -grid.half; j <= grid.half; ++j) {
    for (int i = -grid.half; i <= grid.half; ++i) {
      const std::size_t at = grid.at(i, j);
      for (int dj = std::max(-1, -grid.half - j); dj <= std::min(1, grid.half - j); ++dj) {
        for (int di = std::max(-1, -grid.half - i); di <= std::min(1, grid.half - i); ++di) {
          const std::size_t other = grid.at(i + di, j + dj);
          if (marks.sum[other] <= best.sum[at]) continue;
          best.sum[at] = marks.sum[other];
          best.judged[at] = marks.judged[other];
        }
      }
    }
  }
  return best;
}

/// Scores by shift; -1 where too little can be judged.
struct ScoreMap {
  ShiftGrid grid;
  std::vector<double> score;

  explicit ScoreMap(const ShiftGrid& shifts)
      : grid(shifts), score(static_cast<std::size_t>(shifts.side() * shifts.side()), -1) {}
  /// Shifts from -half to half along u and v.
  void ForEach(const auto& visit) const {
    for (int j = -grid.half; j <= grid.half; ++j) {
      for (int i = -grid.half; i <= grid.half; ++i) visit(i, j, score[grid.at(i, j)]);
    }
  }
  /// The best place that is not the same as any of those.
  [[nodiscard]] Candidate BestBut(const std::vector<Candidate>& others) const {
    Candidate best;
    ForEach([&](int i, int j, double here) {
      const SheetPoint at{i * kStep_mm, j * kStep_mm};
      if (here > best.score && std::all_of(others.begin(), others.end(), [&](const auto& other) {
            return std::hypot(at.u_mm - other.shift.u_mm, at.v_mm - other.shift.v_mm) > kSame_mm;
          })) {
        best = {at, here};
      }
    });
    return best;
  }
  /// The middle of a plateau as wide as the line.
  [[nodiscard]] SheetPoint Middle(const Candidate& best) const {
    SheetPoint sum;
    double weight = 0;
    ForEach([&](int i, int j, double here) {
      const SheetPoint at{i * kStep_mm, j * kStep_mm};
      if (here <= 0.95 * best.score ||
          std::hypot(at.u_mm - best.shift.u_mm, at.v_mm - best.shift.v_mm) > kSame_mm) {
        return;
      }
      sum.u_mm += at.u_mm;
      sum.v_mm += at.v_mm;
      weight += 1;
    });
    return weight > 0 ? SheetPoint{sum.u_mm / weight, sum.v_mm / weight} : best.shift;
  }
};

/// By how much a place has to be ahead.
double Margin(const ToolPlace& place) {
  return place.share >= kNearlyAll ? kClearlyOfAll : kClearly;
}

bool IsClear(const ToolPlace& place) {
  return place.rivals.empty() || place.score - place.rivals.front().score >= Margin(place);
}

}  // namespace

std::vector<ToolComb> CombsOf(const SheetPlan& plan, int tool) {
  std::vector<ToolComb> combs;
  for (std::size_t i = 0; i < plan.structures.size(); ++i) {
    if (plan.structures[i].purpose != Purpose::kTool) continue;
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      if (plan.structures[i].combs[comb].tool == tool) combs.push_back({i, comb});
    }
  }
  return combs;
}

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

ToolSearch::LegMarks ToolSearch::Judge(const std::vector<std::uint8_t>& explained,
                                       double threshold) const {
  return {JudgeLegs(raster_, explained, plan_.settings, true, threshold),
          JudgeLegs(raster_, explained, plan_.settings, false, threshold)};
}

void ToolSearch::Explain(int tool, SheetPoint shift, std::vector<std::uint8_t>& explained) const {
  const double half_mm = plan_.settings.line_width_mm / 2 + kInkCell_mm;
  for (const Leg& leg : LegsOfTool(plan_, tool)) {
    PaintLeg(raster_, Shifted(leg, shift), half_mm, explained);
  }
}

ToolPlace ToolSearch::Look(int tool, const LegMarks& legs) const {
  /// Of all legs, so that a place can be told.
  constexpr double kLeastJudged = 0.35;
  const ShiftGrid grid{static_cast<int>(std::ceil(kSearch_mm * std::numbers::sqrt2 / kStep_mm))};
  const std::vector<ToolComb> combs = CombsOf(plan_, tool);
  std::vector<CombMarks> marks(combs.size());
  ParallelFor(static_cast<int>(combs.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const CombCells cells = CellsOf(raster_, plan_, combs[k]);
    marks[k] = BestNearby(MarkComb(raster_, legs[cells.along_v ? 0 : 1], cells, grid), grid);
  });
  const double whole =
      2.0 * kWholeLeg * plan_.settings.teeth * std::max(1.0, static_cast<double>(combs.size()));
  const double tilt_rad = plan_.settings.tilt_deg * std::numbers::pi / 180;
  const double c = std::cos(tilt_rad) * kStep_mm;
  const double s = std::sin(tilt_rad) * kStep_mm;
  ScoreMap map(grid);
  ToolPlace place;
  for (int j = -grid.half; j <= grid.half; ++j) {
    for (int i = -grid.half; i <= grid.half; ++i) {
      if (std::max(std::abs(c * i - s * j), std::abs(s * i + c * j)) > kSearch_mm) continue;
      const std::size_t at = grid.at(i, j);
      double sum = 0;
      double judged = 0;
      for (const CombMarks& comb : marks) {
        sum += comb.sum[at] / whole;
        judged += comb.judged[at] / whole;
      }
      if (judged < kLeastJudged) continue;
      map.score[at] = sum;
      if (sum <= place.score) continue;
      place.score = sum;
      place.share = (sum + judged) / (2 * judged);
    }
  }
  std::vector<Candidate> places{map.BestBut({})};
  place.shift = map.Middle(places[0]);
  while (places.size() <= kMostRivals + 1) {
    const Candidate rival = map.BestBut(places);
    if (rival.score <= -1 || place.score - rival.score >= kClearly) break;
    places.push_back(rival);
    place.rivals.push_back({map.Middle(rival), rival.score});
  }
  return place;
}

double ToolSearch::ScoreOfOthers(const std::vector<int>& others, int tool, SheetPoint shift,
                                 double threshold) const {
  std::vector<std::uint8_t> explained = explained_;
  Explain(tool, Refine(tool, shift), explained);
  const LegMarks legs = Judge(explained, threshold);
  double sum = 0;
  // One that did not print speaks for no place.
  for (const int other : others) sum += std::max(0.0, Look(other, legs).score);
  return sum;
}

bool ToolSearch::IsClearTogether(int tool, const ToolPlace& place, const std::vector<int>& others,
                                 double threshold) const {
  // Tools that print over each other hide each other's legs: what others lose may then favour a
  // wrong place. It only confirms one that has nearly all legs, and leads by itself.
  constexpr double kLeadAlone = kClearlyOfAll / 2;
  if (others.empty() || place.rivals.size() > kMostRivals) return false;
  if (place.score < kNearlyAll) return false;
  if (place.score - place.rivals.front().score < kLeadAlone) return false;
  const double best = place.score + ScoreOfOthers(others, tool, place.shift, threshold);
  return std::all_of(place.rivals.begin(), place.rivals.end(), [&](const Candidate& rival) {
    return best - rival.score - ScoreOfOthers(others, tool, rival.shift, threshold) >=
           kClearlyOfAll;
  });
}

double ToolSearch::Contrast(const ToolComb& comb, SheetPoint shift, double& open_cells) const {
  const Structure& structure = plan_.structures[comb.structure];
  const bool along_v = structure.axis == Axis::kX;
  const int aside = static_cast<int>(std::lround(plan_.settings.leg_spacing_mm / 2 / kInkCell_mm));
  const int half = static_cast<int>((plan_.settings.leg_length_mm / 2 - kLegEnd_mm) / kInkCell_mm);
  // Of the line and of the paper on both sides, where no known ink lies.
  std::array<double, 2> sum{};
  std::array<double, 2> cells{};
  for (const auto& [column, row] : CellsOf(raster_, plan_, comb, shift).middle) {
    for (int along = -half; along <= half; ++along) {
      for (const int across : {-aside, -1, 0, 1, aside}) {
        const int x = column + (along_v ? across : along);
        const int y = row + (along_v ? along : across);
        if (x < 0 || y < 0 || x >= raster_.columns || y >= raster_.rows) continue;
        const std::size_t cell = raster_.at(x, y);
        if (explained_[cell] != 0) continue;
        const std::size_t which = std::abs(across) == aside ? 1 : 0;
        sum[which] += raster_.strength[cell];
        cells[which] += 1;
      }
    }
  }
  open_cells = cells[0];
  return sum[0] / std::max(1.0, cells[0]) - sum[1] / std::max(1.0, cells[1]);
}

SheetPoint ToolSearch::Refine(int tool, SheetPoint shift) const {
  constexpr int kReach = 6;  // cells: the plateau of the search, and its steps
  for (int pass = 0; pass < 2; ++pass) {
    std::array<double, 2> most_open{};
    SheetPoint refined = shift;
    for (const ToolComb& comb : CombsOf(plan_, tool)) {
      const bool is_x = plan_.structures[comb.structure].axis == Axis::kX;
      double best = -1e9;
      double best_open = 0;
      double best_mm = 0;
      for (int i = -kReach; i <= kReach; ++i) {
        const double by_mm = i * kInkCell_mm;
        const SheetPoint at{shift.u_mm + (is_x ? by_mm : 0), shift.v_mm + (is_x ? 0 : by_mm)};
        double open = 0;
        const double contrast = Contrast(comb, at, open);
        if (contrast <= best) continue;
        best = contrast;
        best_open = open;
        best_mm = by_mm;
      }
      // Of the combs of an axis, the one that known ink hides least.
      double& most = most_open[is_x ? 0 : 1];
      if (best_open <= most) continue;
      most = best_open;
      (is_x ? refined.u_mm : refined.v_mm) = (is_x ? shift.u_mm : shift.v_mm) + best_mm;
    }
    shift = refined;
  }
  return shift;
}

std::vector<ToolPlace> ToolSearch::Find(const std::vector<int>& tools) {
  /// Other tools' combs alone fill half of a tool's legs at most, those of one axis: a score of 0.
  constexpr double kLeastScore = 0.2;
  constexpr double kBeyondDoubt = 0.7;
  constexpr double kFaintest = 8;  // levels
  const double faint = std::max(kFaintest, 4 * raster_.noise);
  std::vector<ToolPlace> places(tools.size());
  const auto others_than = [&](std::size_t but) {
    std::vector<int> others;
    for (std::size_t i = 0; i < tools.size(); ++i) {
      if (i != but && !places[i].found) others.push_back(tools[i]);
    }
    return others;
  };
  for (const double threshold : {std::max(faint, 0.35 * ink_strength_), faint}) {
    // What was found explains ink, which may show where the others are: the surest first.
    for (bool more = true; more;) {
      more = false;
      if (std::all_of(places.begin(), places.end(), [](const auto& p) { return p.found; })) break;
      const LegMarks legs = Judge(explained_, threshold);
      double surest = 0;
      for (std::size_t i = 0; i < tools.size(); ++i) {
        if (places[i].found) continue;
        places[i] = Look(tools[i], legs);
        places[i].ambiguous = places[i].score >= kLeastScore && !IsClear(places[i]);
        if (!places[i].ambiguous) surest = std::max(surest, places[i].score);
      }
      // Where no tool is sure by itself, one may be by what it leaves to the others.
      for (std::size_t i = 0; i < tools.size() && surest < kLeastScore; ++i) {
        ToolPlace& place = places[i];
        if (!place.ambiguous) continue;
        place.ambiguous = !IsClearTogether(tools[i], place, others_than(i), threshold);
        if (!place.ambiguous) surest = place.score;
      }
      for (std::size_t i = 0; i < tools.size(); ++i) {
        if (places[i].found || places[i].ambiguous || places[i].score < kLeastScore) continue;
        if (places[i].score < std::min(surest, kBeyondDoubt)) continue;
        places[i].found = true;
        places[i].shift = Refine(tools[i], places[i].shift);
        Explain(tools[i], places[i].shift, explained_);
        more = true;
      }
    }
  }
  return places;
}

}  // namespace trammel::tool_offset
