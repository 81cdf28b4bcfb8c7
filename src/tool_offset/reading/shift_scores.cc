#include "tool_offset/reading/shift_scores.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "tool_offset/reading/leg_reader.h"

namespace trammel::tool_offset {
namespace {

/// Sums of a mask along rows or columns, so that a run needs two look-ups.
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
  /// Returns the sum over the `half` cells to either side of a cell along the run, and itself.
  [[nodiscard]] int Around(std::size_t cell, std::size_t half) const {
    return sum_[cell + half * step_] - sum_[cell - (half + 1) * step_];
  }

 private:
  std::size_t step_;
  std::vector<std::uint16_t> sum_;
};

}  // namespace

std::vector<std::int8_t> JudgeLegs(const InkRaster& raster,
                                   const std::vector<std::uint8_t>& explained,
                                   const SheetSettings& settings, bool along_v, double threshold) {
  constexpr double kInked = 0.7;  // share of the judgeable cells
  const auto half =
      static_cast<std::size_t>((settings.leg_length_mm / 2 - kLegEnd_mm) / kInkCell_mm);
  const auto is_ink = [&](std::size_t i) { return raster.strength[i] >= threshold; };
  const RunSums open(raster, along_v, [&](std::size_t i) { return explained[i] == 0; });
  const RunSums open_ink(raster, along_v,
                         [&](std::size_t i) { return explained[i] == 0 && is_ink(i); });
  std::vector<std::int8_t> marks(raster.strength.size(), -kWholeLeg);
  const int run = 2 * static_cast<int>(half) + 1;
  const int margin_along = static_cast<int>(half) + 1;
  const int margin_u = along_v ? 0 : margin_along;
  const int margin_v = along_v ? margin_along : 0;
  ParallelFor(std::max(0, raster.rows - 2 * margin_v), [&](int i) {
    const int row = margin_v + i;
    for (int column = margin_u; column < raster.columns - margin_u; ++column) {
      const std::size_t cell = raster.at(column, row);
      const int known = open.Around(cell, half);
      const int inked = open_ink.Around(cell, half);
      const bool leg = inked >= kInked * known;
      const int weight = known * kWholeLeg / run;
      marks[cell] = static_cast<std::int8_t>(leg ? weight : -weight);
    }
  });
  return marks;
}

namespace {

/// Step between tried shifts, in cells: half a line.
constexpr int kShiftStep = 2;
constexpr double kStep_mm = kShiftStep * kInkCell_mm;

/// Maximum distance of equal places: two lines.
constexpr double kSame_mm = 1;

struct ShiftGrid {
  int half = 0;  ///< shifts to either side
  [[nodiscard]] int side() const { return 2 * half + 1; }
  [[nodiscard]] std::size_t at(int i, int j) const {
    return static_cast<std::size_t>((j + half) * side() + i + half);
  }
};

/// Marks of a comb at each shift, in parts of kWholeLeg.
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

/// Takes the best of the adjacent shifts at each, as the paper may be displaced between combs.
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

/// Scores by shift; -1 where too few legs can be judged.
struct ScoreMap {
  ShiftGrid grid;
  std::vector<double> score;
  std::vector<double> share;

  explicit ScoreMap(const ShiftGrid& shifts)
      : grid(shifts),
        score(static_cast<std::size_t>(shifts.side() * shifts.side()), -1),
        share(score.size(), 0) {}
  /// Visits shifts from -half to half along u and v.
  void ForEach(const auto& visit) const {
    for (int j = -grid.half; j <= grid.half; ++j) {
      for (int i = -grid.half; i <= grid.half; ++i) {
        const std::size_t at = grid.at(i, j);
        visit(Candidate{{i * kStep_mm, j * kStep_mm}, score[at], share[at]});
      }
    }
  }
  /// Returns the best place that differs from all of those.
  [[nodiscard]] Candidate BestBut(const std::vector<Candidate>& others) const {
    Candidate best;
    ForEach([&](const Candidate& here) {
      if (here.score > best.score && std::none_of(others.begin(), others.end(), [&](const auto& o) {
            return Apart_mm(here, o) <= kSame_mm;
          })) {
        best = here;
      }
    });
    return best;
  }
  /// Returns the middle of a plateau as wide as the line.
  [[nodiscard]] SheetPoint Middle(const Candidate& best) const {
    SheetPoint sum;
    double weight = 0;
    ForEach([&](const Candidate& here) {
      if (here.score <= 0.95 * best.score || Apart_mm(here, best) > kSame_mm) return;
      sum.u_mm += here.shift.u_mm;
      sum.v_mm += here.shift.v_mm;
      weight += 1;
    });
    return weight > 0 ? SheetPoint{sum.u_mm / weight, sum.v_mm / weight} : best.shift;
  }
  static double Apart_mm(const Candidate& a, const Candidate& b) {
    return std::hypot(a.shift.u_mm - b.shift.u_mm, a.shift.v_mm - b.shift.v_mm);
  }
};

/// Scores all shifts of a tool.
ScoreMap ScoreShifts(const InkRaster& raster, const SheetPlan& plan, const LegMarks& legs,
                     int tool) {
  /// Least visible part of all legs to identify a position.
  constexpr double kMinJudged = 0.35;
  const ShiftGrid grid{static_cast<int>(std::ceil(kSearch_mm * std::numbers::sqrt2 / kStep_mm))};
  const std::vector<ToolComb> combs = CombsOf(plan, tool);
  std::vector<CombMarks> marks(combs.size());
  ParallelFor(static_cast<int>(combs.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const CombCells cells = CellsOf(raster, plan, combs[k], {});
    marks[k] = BestNearby(MarkComb(raster, legs[cells.along_v ? 0 : 1], cells, grid), grid);
  });
  const double whole =
      2.0 * kWholeLeg * plan.settings.teeth * std::max(1.0, static_cast<double>(combs.size()));
  const double tilt_rad = plan.settings.tilt_deg * std::numbers::pi / 180;
  const double c = std::cos(tilt_rad) * kStep_mm;
  const double s = std::sin(tilt_rad) * kStep_mm;
  ScoreMap map(grid);
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
      if (judged < kMinJudged) continue;
      map.score[at] = sum;
      map.share[at] = (sum + judged) / (2 * judged);
    }
  }
  return map;
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

CombCells CellsOf(const InkRaster& raster, const SheetPlan& plan, const ToolComb& tool_comb,
                  SheetPoint shift) {
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

std::vector<Candidate> FindCandidates(const InkRaster& raster, const SheetPlan& plan,
                                      const LegMarks& legs, int tool) {
  /// Maximum difference from the best score, as other ink may favour a wrong place.
  constexpr double kBehind = 0.5;
  constexpr std::size_t kMax = 10;
  const ScoreMap map = ScoreShifts(raster, plan, legs, tool);
  std::vector<Candidate> seen;
  std::vector<Candidate> places;
  while (places.size() < kMax) {
    const Candidate next = map.BestBut(seen);
    if (next.score <= -1 || (!seen.empty() && seen[0].score - next.score >= kBehind)) break;
    seen.push_back(next);
    const Candidate place{map.Middle(next), next.score, next.share};
    // The flank of a better place belongs to it.
    if (std::any_of(places.begin(), places.end(), [&](const Candidate& better) {
          return ScoreMap::Apart_mm(place, better) <= kSame_mm;
        })) {
      continue;
    }
    places.push_back(place);
  }
  return places;
}

}  // namespace trammel::tool_offset
