#include "tool_offset/reading/leg_marks.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "tool_offset/reading/leg_reader.h"

namespace trammel::tool_offset {
namespace {

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

}  // namespace

std::vector<std::int8_t> JudgeLegs(const InkRaster& raster,
                                   const std::vector<std::uint8_t>& explained,
                                   const SheetSettings& settings, bool along_v, double threshold) {
  constexpr double kInked = 0.7;  // of what can be judged
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

}  // namespace trammel::tool_offset
