// Which parts of a picture have been looked at: a note for each cell of some pixels.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "part_alignment/targets/disc_fit.h"

namespace trammel::part_alignment {

class SeenCells {
 public:
  static constexpr std::uint8_t kDone = 255;  ///< of a disc that has been judged

  /// @param cells  memory, kept by the caller.
  SeenCells(int width, int height, std::vector<std::uint8_t>& cells)
      : columns_(width / kCell_px + 1), rows_(height / kCell_px + 1), cells_(cells) {
    cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
  }

  /// Of the nearest cell.
  [[nodiscard]] std::uint8_t& At(double column_px, double row_px) {
    const int x = std::clamp(static_cast<int>(column_px) / kCell_px, 0, columns_ - 1);
    const int y = std::clamp(static_cast<int>(row_px) / kCell_px, 0, rows_ - 1);
    return cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(x)];
  }

  [[nodiscard]] bool IsDone(double column_px, double row_px) {
    return At(column_px, row_px) == kDone;
  }

  /// The cells whose middle is within so many radii of a disc, and the disc's own.
  void MarkDone(const DiscModel& disc, double radii) {
    At(disc.column_px, disc.row_px) = kDone;
    constexpr double kMiddle = 0.5 * (kCell_px - 1);
    // |W d| <= radii along a row: a dx² + 2 b dx dy + c dy² <= radii².
    const double a = disc.wxx * disc.wxx + disc.wxy * disc.wxy;
    const double b = disc.wxy * (disc.wxx + disc.wyy);
    const double det = disc.wxx * disc.wyy - disc.wxy * disc.wxy;
    const double half_y = radii * std::sqrt(a) / det;
    const auto cell = [](double place, int end) {
      return static_cast<int>(
          std::clamp((place - kMiddle) / kCell_px + 1, 0.0, static_cast<double>(end)));
    };
    const int last = cell(disc.row_px + half_y, rows_);
    for (int row = cell(disc.row_px - half_y, rows_); row < last; ++row) {
      const double dy = row * kCell_px + kMiddle - disc.row_px;
      const double middle = disc.column_px - b / a * dy;
      const double half =
          std::sqrt(std::max(0.0, radii * radii / a - det * det * dy * dy / (a * a)));
      const auto cells = cells_.begin() + static_cast<std::ptrdiff_t>(row) * columns_;
      const int begin = cell(middle - half, columns_);
      std::fill(cells + begin, cells + std::max(begin, cell(middle + half, columns_)), kDone);
    }
  }

 private:
  static constexpr int kCell_px = 4;
  int columns_;
  int rows_;
  std::vector<std::uint8_t>& cells_;
};

}  // namespace trammel::part_alignment
