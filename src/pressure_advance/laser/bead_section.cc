#include "pressure_advance/laser/bead_section.h"

#include <algorithm>
#include <cmath>

namespace trammel::pressure_advance {
namespace {

struct Row {
  double height = 0;
  double variance = 0;
  bool seen = false;
};

/// Rows beyond the picture belong to the plate.
Row RowAt(const HeightMap& heights, std::size_t frame, int row) {
  if (row < 0 || row >= static_cast<int>(heights.rows)) {
    return {0, 0, true};
  }
  const std::size_t i = heights.index(frame, static_cast<std::size_t>(row));
  const double sigma = heights.sigma_px[i];
  return {heights.height_px[i], sigma * sigma, sigma > 0};
}

}  // namespace

double BeadSection::Share(std::size_t i, const Interval& range) const {
  const double row = first_row + static_cast<double>(i);
  return std::clamp(std::min(row + 0.5, range.hi) - std::max(row - 0.5, range.lo), 0.0, 1.0);
}

double BeadSection::Sum(const Interval& range) const {
  double sum = 0;
  for (std::size_t i = 0; i < height.size(); ++i) sum += Share(i, range) * height[i];
  return sum;
}

double BeadSection::Smooth(std::size_t i) const {
  const std::size_t begin = i > 0 ? i - 1 : 0;
  const std::size_t end = std::min(i + 2, height.size());
  double sum = 0;
  for (std::size_t k = begin; k < end; ++k) sum += height[k];
  return sum / static_cast<double>(end - begin);
}

BeadSection CutSection(const PlateHeights& plate, std::size_t frame) {
  const double centre = plate.band.centre(frame);
  const double half = plate.band.half(frame);
  const int first = static_cast<int>(std::floor(centre - half + 0.5));
  const int last = static_cast<int>(std::floor(centre + half + 0.5));
  BeadSection section;
  section.first_row = first - centre;
  section.band = {-half, half};
  for (int r = first; r <= last; ++r) {
    const Row row = RowAt(plate.heights, frame, r);
    if (row.seen) {
      section.height.push_back(row.height);
      section.variance.push_back(row.variance);
      continue;
    }
    int below = r;
    int above = r;
    Row left = row;
    Row right = row;
    while (!left.seen) left = RowAt(plate.heights, frame, --below);
    while (!right.seen) right = RowAt(plate.heights, frame, ++above);
    // A bridge that leaves the band rests on the plate at the band's edge.
    if (below < first) left = {0, right.variance, true};
    if (above > last) right = {0, left.variance, true};
    below = std::max(below, first - 1);
    above = std::min(above, last + 1);
    const double t = static_cast<double>(r - below) / (above - below);
    section.height.push_back((1 - t) * left.height + t * right.height);
    section.variance.push_back((1 - t) * left.variance + t * right.variance);
    section.longest_bridge = std::max(section.longest_bridge, above - below - 1);
  }
  return section;
}

}  // namespace trammel::pressure_advance
