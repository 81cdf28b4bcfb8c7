#include "tool_offset/tool_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tool_offset/leg_reader.h"
#include "tool_offset/parallel.h"

namespace trammel::tool_offset {
namespace {

/// Cells from one shift that is tried to the next: half a line.
constexpr int kShiftStep = 2;

/// Full marks of a leg that no other ink covers.
constexpr int kWhole = 32;

/// Sums of a mask along rows or columns, so that a run costs two look-ups.
class RunSums {
 public:
  RunSums(const InkRaster& raster, bool along_v, const auto& mask_at)
      : step_(along_v ? static_cast<std::size_t>(raster.columns) : 1),
        sum_(raster.strength.size()) {
    const int lines = along_v ? raster.columns : raster.rows;
    const int cells = along_v ? raster.rows : raster.columns;
    for (int line = 0; line < lines; ++line) {
      std::size_t cell = along_v ? raster.at(line, 0) : raster.at(0, line);
      std::uint16_t sum = 0;
      for (int i = 0; i < cells; ++i, cell += step_) {
        sum = static_cast<std::uint16_t>(sum + (mask_at(cell) ? 1 : 0));
        sum_[cell] = sum;
      }
    }
  }
  /// Over the `half` cells to either side of a cell along the run, and itself.
  [[nodiscard]] int Around(std::size_t cell, std::size_t half) const {
    return sum_[cell + half * step_] - sum_[cell - (half + 1) * step_];
  }

 private:
  std::size_t step_;
  std::vector<std::uint16_t> sum_;
};

/// For a leg centred on each cell: how much of it can be judged (0 … kWhole), negative where it is
/// not there. Beside the raster nothing can be judged for a leg.
std::vector<std::int8_t> JudgeLegs(const InkRaster& raster,
                                   const std::vector<std::uint8_t>& explained,
                                   const SheetSettings& settings, bool along_v, double threshold) {
  constexpr double kInked = 0.7;  // of what can be judged
  constexpr double kStandsOut = 0.3;
  const auto half =
      static_cast<std::size_t>((settings.leg_length_mm / 2 - kLegEnd_mm) / kInkCell_mm);
  const auto aside = static_cast<int>(std::lround(settings.leg_spacing_mm / 2 / kInkCell_mm));
  const auto is_ink = [&](std::size_t i) { return raster.strength[i] >= threshold; };
  const RunSums ink(raster, along_v, is_ink);
  const RunSums open(raster, along_v, [&](std::size_t i) { return explained[i] == 0; });
  const RunSums open_ink(raster, along_v,
                         [&](std::size_t i) { return explained[i] == 0 && is_ink(i); });
  std::vector<std::int8_t> marks(raster.strength.size(), -kWhole);
  const int run = 2 * static_cast<int>(half) + 1;
  const int margin_along = static_cast<int>(half) + 1;
  const int margin_u = along_v ? aside : margin_along;
  const int margin_v = along_v ? margin_along : aside;
  const std::ptrdiff_t side = along_v ? aside : std::ptrdiff_t{aside} * raster.columns;
  ParallelFor(std::max(0, raster.rows - 2 * margin_v), [&](int i) {
    const int row = margin_v + i;
    for (int column = margin_u; column < raster.columns - margin_u; ++column) {
      const std::size_t cell = raster.at(column, row);
      const int known = open.Around(cell, half);
      const int inked = open_ink.Around(cell, half);
      const auto beside = [&](std::ptrdiff_t by) {
        return ink.Around(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(cell) + by), half);
      };
      const bool leg = inked >= kInked * known &&
                       std::min(beside(-side), beside(side)) <= run * (1 - kStandsOut);
      const int weight = known * kWhole / run;
      marks[cell] = static_cast<std::int8_t>(leg ? weight : -weight);
    }
  });
  return marks;
}

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

/// A comb's marks at each shift, in parts of kWhole.
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
        const int mark = within ? legs[raster.at(x, y)] : -kWhole;
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
  Explain(plan.settings.reference_tool, {});
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

void ToolSearch::Explain(int tool, SheetPoint shift) {
  const double half_mm = plan_.settings.line_width_mm / 2 + kInkCell_mm;
  for (const Leg& leg : LegsOfTool(plan_, tool)) {
    PaintLeg(raster_, Shifted(leg, shift), half_mm, explained_);
  }
}

ToolPlace ToolSearch::Look(int tool, const std::array<std::vector<std::int8_t>, 2>& legs) const {
  /// Within this a place is the same as the best one: two lines.
  constexpr double kSame_mm = 1;
  /// Of all legs, so that a place can be told.
  constexpr double kLeastJudged = 0.35;
  constexpr double kStep_mm = kShiftStep * kInkCell_mm;
  const ShiftGrid grid{static_cast<int>(std::ceil(kSearch_mm * std::numbers::sqrt2 / kStep_mm))};
  const std::vector<ToolComb> combs = CombsOf(plan_, tool);
  std::vector<CombMarks> marks(combs.size());
  ParallelFor(static_cast<int>(combs.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const CombCells cells = CellsOf(raster_, plan_, combs[k]);
    marks[k] = BestNearby(MarkComb(raster_, legs[cells.along_v ? 0 : 1], cells, grid), grid);
  });
  const double whole =
      2.0 * kWhole * plan_.settings.teeth * std::max(1.0, static_cast<double>(combs.size()));
  const double tilt_rad = plan_.settings.tilt_deg * std::numbers::pi / 180;
  const double c = std::cos(tilt_rad) * kStep_mm;
  const double s = std::sin(tilt_rad) * kStep_mm;
  std::vector<double> score(static_cast<std::size_t>(grid.side() * grid.side()), -1);
  ToolPlace place;
  std::array<int, 2> best{};
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
      score[at] = sum;
      if (sum <= place.score) continue;
      place.score = sum;
      place.share = (sum + judged) / (2 * judged);
      best = {i, j};
    }
  }
  double weight = 0;
  for (int j = -grid.half; j <= grid.half; ++j) {
    for (int i = -grid.half; i <= grid.half; ++i) {
      const double here = score[grid.at(i, j)];
      if (kStep_mm * std::hypot(i - best[0], j - best[1]) > kSame_mm) {
        place.runner_up = std::max(place.runner_up, here);
      } else if (here > 0.95 * place.score) {
        // A plateau as wide as the line.
        place.shift.u_mm += i * kStep_mm;
        place.shift.v_mm += j * kStep_mm;
        weight += 1;
      }
    }
  }
  if (weight > 0) place.shift = {place.shift.u_mm / weight, place.shift.v_mm / weight};
  return place;
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
  constexpr double kClearly = 0.15;
  // Where nearly all legs that can be judged are there, and others are only hidden.
  constexpr double kNearlyAll = 0.93;
  constexpr double kClearlyOfAll = 0.08;
  constexpr double kBeyondDoubt = 0.7;
  constexpr double kFaintest = 8;  // levels
  const double faint = std::max(kFaintest, 4 * raster_.noise);
  std::vector<ToolPlace> places(tools.size());
  for (const double threshold : {std::max(faint, 0.35 * ink_strength_), faint}) {
    // What was found explains ink, which may show where the others are: the surest first.
    for (bool more = true; more;) {
      more = false;
      if (std::all_of(places.begin(), places.end(), [](const auto& p) { return p.found; })) break;
      const std::array<std::vector<std::int8_t>, 2> legs{
          JudgeLegs(raster_, explained_, plan_.settings, true, threshold),
          JudgeLegs(raster_, explained_, plan_.settings, false, threshold)};
      double surest = 0;
      for (std::size_t i = 0; i < tools.size(); ++i) {
        if (places[i].found) continue;
        places[i] = Look(tools[i], legs);
        const double ahead = places[i].score - places[i].runner_up;
        const bool clear = ahead >= (places[i].share >= kNearlyAll ? kClearlyOfAll : kClearly);
        places[i].ambiguous = places[i].score >= kLeastScore && !clear;
        if (places[i].score >= kLeastScore && clear) surest = std::max(surest, places[i].score);
      }
      for (std::size_t i = 0; i < tools.size(); ++i) {
        if (places[i].found || places[i].ambiguous || places[i].score < kLeastScore) continue;
        if (places[i].score < std::min(surest, kBeyondDoubt)) continue;
        places[i].found = true;
        places[i].shift = Refine(tools[i], places[i].shift);
        Explain(tools[i], places[i].shift);
        more = true;
      }
    }
  }
  return places;
}

}  // namespace trammel::tool_offset
