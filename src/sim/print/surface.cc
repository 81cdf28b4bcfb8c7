#include "sim/print/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::sim {
namespace {

constexpr double kLowestFill = 0.5;     // superellipse with exponent 1
constexpr double kHighestFill = 0.989;  // exponent 12

double Superellipse(double exponent, double t) {
  return std::pow(std::max(0.0, 1 - std::pow(t, exponent)), 1 / exponent);
}

// Returns the share of the enclosing rectangle filled by the superellipse.
double FillOf(double exponent) {
  return std::exp(2 * LogGamma(1 + 1 / exponent) - LogGamma(1 + 2 / exponent));
}

// Integrals of the height over the half-width from the middle, tabulated for all fills: two powers
// per cell would dominate the rasteriser's time.
class SectionTable {
 public:
  SectionTable() {
    for (int fill = 0; fill < kFills; ++fill) {
      const double wanted = kLowestFill + (kHighestFill - kLowestFill) * fill / (kFills - 1);
      double lo = 1;
      double hi = 12.2;
      for (int i = 0; i < 40; ++i) {
        const double middle = (lo + hi) / 2;
        (FillOf(middle) < wanted ? lo : hi) = middle;
      }
      // In the last steps, at the steep edge, the sum of trapezoids is too small: the missing part
      // of the fill is spread over all.
      std::array<double, kSteps + 1> sum{};
      for (int i = 0; i < kSteps; ++i) {
        const auto at = static_cast<std::size_t>(i);
        sum[at + 1] = sum[at] + (Superellipse(lo, static_cast<double>(i) / kSteps) +
                                 Superellipse(lo, (i + 1.0) / kSteps)) /
                                    (2 * kSteps);
      }
      for (std::size_t i = 0; i <= kSteps; ++i) {
        table_[static_cast<std::size_t>(fill)][i] =
            static_cast<float>(sum[i] * FillOf(lo) / sum[kSteps]);
      }
    }
  }

  /// Returns the integral of the height relative to the top, from the middle to -1 <= t <= 1 of the
  /// half-width.
  [[nodiscard]] double IntegralTo(double fill, double t) const {
    const double scaled = (fill - kLowestFill) / (kHighestFill - kLowestFill) * (kFills - 1);
    const double clamped = std::clamp(scaled, 0.0, kFills - 1.0);
    const auto row = std::min(static_cast<std::size_t>(clamped), std::size_t{kFills - 2});
    const double between = clamped - static_cast<double>(row);
    return std::copysign(
        (1 - between) * InRow(row, std::abs(t)) + between * InRow(row + 1, std::abs(t)), t);
  }

 private:
  static constexpr int kFills = 128;
  static constexpr int kSteps = 256;

  [[nodiscard]] double InRow(std::size_t row, double t) const {
    const double at = std::min(t, 1.0) * kSteps;
    const auto left = std::min(static_cast<std::size_t>(at), std::size_t{kSteps - 1});
    const double share = at - static_cast<double>(left);
    return (1 - share) * static_cast<double>(table_[row][left]) +
           share * static_cast<double>(table_[row][left + 1]);
  }

  std::array<std::array<float, kSteps + 1>, kFills> table_{};
};

// True if a node is within the bead; one on its edge is not.
bool Within(double off, double half) {
  constexpr double kRoundingMm = 1e-9;
  return off < half - kRoundingMm;
}

// Returns the height of a node `off` from the middle: the section's mean over the interval nearest
// to the node, so that the nodes together have the section's area. The last one within the bead
// includes the part beyond it, since no node beyond the edge is covered.
double NodeHeight(const SectionTable& shape, double fill, double off, double half, double spacing) {
  const double lo = off - spacing / 2;
  const double hi = Within(off + spacing, half) ? off + spacing / 2 : half;
  return (shape.IntegralTo(fill, hi / half) - shape.IntegralTo(fill, lo / half)) * half / spacing;
}

constexpr double kOverlapInCells = 0.6;

bool Present(const BeadSample& sample) { return sample.width_mm > 0 && sample.height_mm > 0; }

// Raises the relief to the bead between two samples. The stretch extends a little beyond its ends,
// so that no node is missed between two stretches; a rounded end extends half a width.
void Stamp(Relief& relief, const SectionTable& shape, const BeadSample& a, const BeadSample& b,
           bool round_a, bool round_b) {
  const double reach = std::max(a.width_mm, b.width_mm) / 2;
  const double base = std::max(a.base_mm, b.base_mm);
  const double cell = relief.cell_mm;
  const double dx = b.x_mm - a.x_mm;
  const double dy = b.y_mm - a.y_mm;
  const double length = std::hypot(dx, dy);
  // Distance between nodes of a row or column, whichever cuts the bead, across it.
  const double spacing = length > 0 ? cell * std::max(std::abs(dx), std::abs(dy)) / length : cell;
  const auto first = [&](double lo, double origin) {
    return static_cast<int>(std::max(0.0, std::ceil((lo - reach - origin) / cell)));
  };
  const auto last = [&](double hi, double origin, int count) {
    return static_cast<int>(std::min(count - 1.0, std::floor((hi + reach - origin) / cell)));
  };
  const int column_end = last(std::max(a.x_mm, b.x_mm), relief.origin_x_mm, relief.columns);
  const int row_end = last(std::max(a.y_mm, b.y_mm), relief.origin_y_mm, relief.rows);
  for (int row = first(std::min(a.y_mm, b.y_mm), relief.origin_y_mm); row <= row_end; ++row) {
    float* heights = relief.height_mm.data() +
                     static_cast<std::size_t>(row) * static_cast<std::size_t>(relief.columns);
    const double y = relief.origin_y_mm + row * cell - a.y_mm;
    for (int column = first(std::min(a.x_mm, b.x_mm), relief.origin_x_mm); column <= column_end;
         ++column) {
      const double x = relief.origin_x_mm + column * cell - a.x_mm;
      const double along = length > 0 ? (x * dx + y * dy) / length : 0;
      const double beyond = std::max(-along, along - length);
      if (beyond > kOverlapInCells * cell && !(along < 0 ? round_a : round_b)) continue;
      const double t = length > 0 ? std::clamp(along / length, 0.0, 1.0) : 0;
      const double width = a.width_mm + t * (b.width_mm - a.width_mm);
      const double height = a.height_mm + t * (b.height_mm - a.height_mm);
      const double off = std::sqrt((x - t * dx) * (x - t * dx) + (y - t * dy) * (y - t * dy));
      if (!Within(off, width / 2) || height <= 0) continue;
      const double area = a.area_mm2 + t * (b.area_mm2 - a.area_mm2);
      const double z = height * NodeHeight(shape, area / (width * height), off, width / 2, spacing);
      heights[column] = std::max(heights[column], static_cast<float>(base + z));
    }
  }
}

// True if a bead ends at a sample, or bends so much in prints of several layers that its outer side
// would be left open.
bool IsRounded(std::span<const BeadSample> samples, std::size_t i, bool layered, double cell_mm) {
  if (i == 0 || i + 1 == samples.size()) return true;
  if (!layered) return false;
  const BeadSample& at = samples[i];
  const double ax = at.x_mm - samples[i - 1].x_mm;
  const double ay = at.y_mm - samples[i - 1].y_mm;
  const double bx = samples[i + 1].x_mm - at.x_mm;
  const double by = samples[i + 1].y_mm - at.y_mm;
  const double turn = std::atan2(std::abs(ax * by - ay * bx), ax * bx + ay * by);
  return turn * at.width_mm / 2 > kOverlapInCells * cell_mm;
}

}  // namespace

bool IsLayered(const Bed& bed) {
  return std::any_of(bed.strands.begin(), bed.strands.end(), [](const Strand& strand) {
    return !strand.samples.empty() && strand.samples.front().base_mm > 0;
  });
}

double Relief::TopBetween(double y_lo_mm, double y_hi_mm) const {
  const double lo = std::floor((y_lo_mm - origin_y_mm) / cell_mm);
  const double hi = std::ceil((y_hi_mm - origin_y_mm) / cell_mm);
  float top = 0;
  for (double row = std::max(lo, 0.0); row <= std::min(hi, rows - 1.0); row += 1) {
    top = std::max(top, row_top_mm[static_cast<std::size_t>(row)]);
  }
  return static_cast<double>(top);
}

void UpdateRowTops(Relief& relief) {
  relief.row_top_mm.resize(static_cast<std::size_t>(relief.rows));
  for (int row = 0; row < relief.rows; ++row) {
    const float* heights = relief.row(row);
    relief.row_top_mm[static_cast<std::size_t>(row)] =
        *std::max_element(heights, heights + relief.columns);
  }
}

Relief RasterizeBed(const Bed& bed, const BedRegion& region, double cell_mm) {
  // Nodes are at whole multiples of the cell, so that overlapping regions agree on every node.
  const double x0 = std::floor(region.min_x_mm / cell_mm) * cell_mm;
  const double y0 = std::floor(region.min_y_mm / cell_mm) * cell_mm;
  const double columns = std::ceil((region.max_x_mm - x0) / cell_mm) + 1;
  const double rows = std::ceil((region.max_y_mm - y0) / cell_mm) + 1;
  TRAMMEL_CHECK(
      cell_mm >= 0.002 && cell_mm <= 1 && columns >= 2 && rows >= 2 && columns * rows <= 40e6,
      "cell = {} mm, {} x {} cells", cell_mm, columns, rows);
  Relief relief{x0, y0, cell_mm, static_cast<int>(columns), static_cast<int>(rows), {}, {}};
  relief.height_mm.assign(static_cast<std::size_t>(columns * rows), 0.0F);
  static const SectionTable shape;
  const bool layered = IsLayered(bed);
  for (const Strand& strand : bed.strands) {
    const std::size_t count = strand.samples.size();
    for (std::size_t i = 0; i + 1 < count; ++i) {
      const BeadSample& a = strand.samples[i];
      const BeadSample& b = strand.samples[i + 1];
      if (!Present(a) && !Present(b)) continue;
      Stamp(relief, shape, a, b, IsRounded(strand.samples, i, layered, cell_mm),
            IsRounded(strand.samples, i + 1, layered, cell_mm));
    }
  }
  UpdateRowTops(relief);
  return relief;
}

}  // namespace trammel::sim
