#include "pressure_advance/laser/bead_area.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/statistics.h"
#include "geometry/robust_line.h"

namespace trammel::pressure_advance {
namespace {

struct Row {
  double height = 0;
  double variance = 0;
  bool seen = false;
};

/// Rows beyond the picture count as plate.
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
    // An interpolation that leaves the band ends on the plate at the band's edge.
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

namespace {

constexpr std::size_t kFewestFrames = 12;
constexpr double kFlankLevel = 0.3;   ///< of the bead's height, where the flank is located
constexpr double kFlankNoise = 2;     ///< sigmas of a row that a flank stands above at least
constexpr double kMarginRows = 1.5;   ///< flank position to foot of the flank
constexpr double kNarrowestRows = 4;  ///< per half bead
constexpr double kFollowedRows = 2;   ///< beyond its line, from where a flank is followed
constexpr double kMinSpread = 0.1;    ///< spread of areas required to correct flanks
constexpr double kMinArea = 0.1;      ///< over the median, down to which a flank is followed
constexpr double kMaxArea = 3;        ///< and up to which

/// Finds the level crossings of the bead's flanks, descending from the band's centre; none if the
/// centre is not above the level.
std::optional<Interval> FlanksOf(const BeadSection& section, double noise_px) {
  const auto count = static_cast<std::ptrdiff_t>(section.height.size());
  std::vector<double> smooth;
  for (std::size_t i = 0; i < section.height.size(); ++i) smooth.push_back(section.Smooth(i));
  const auto at = [&](std::ptrdiff_t i) {  // the plate beyond the band
    return i >= 0 && i < count ? smooth[static_cast<std::size_t>(i)] : 0;
  };
  const auto centre = static_cast<std::ptrdiff_t>(std::lround(-section.first_row));
  double top = 0;
  for (std::ptrdiff_t i = centre - count / 4; i <= centre + count / 4; ++i) {
    top = std::max(top, at(i));
  }
  const double level = std::max(kFlankLevel * top, kFlankNoise * noise_px);
  if (!(at(centre) > level)) return std::nullopt;
  const auto walk = [&](std::ptrdiff_t step) {
    std::ptrdiff_t i = centre;
    while (at(i) > level) i += step;
    const double beyond = (level - at(i)) / (at(i - step) - at(i));  // in rows, back to the level
    return section.first_row + static_cast<double>(i) - static_cast<double>(step) * beyond;
  };
  return Interval{walk(-1), walk(1)};
}

/// Flank's distance from the centre over the area, which never falls, nor rises faster than the
/// area itself.
class FlankLine {
 public:
  /// @param points  (area, distance), in rising order.
  explicit FlankLine(const std::vector<std::pair<double, double>>& points) {
    std::vector<double> x, y, scratch;
    for (const auto& [area, distance] : points) {
      x.push_back(area);
      y.push_back(distance);
    }
    median_area_ = Median(x);
    const double steepest = std::max(0.0, Median(y)) / median_area_;
    if (x.back() - x.front() > kMinSpread * median_area_) {
      slope_ = std::clamp(geometry::FitRobustLine(x, y, scratch).slope, 0.0, steepest);
    }
    for (std::size_t i = 0; i < x.size(); ++i) y[i] -= slope_ * x[i];
    offset_ = Median(y);
  }

  [[nodiscard]] double at(double area) const {
    return offset_ + slope_ * std::clamp(area, kMinArea * median_area_, kMaxArea * median_area_);
  }

 private:
  double median_area_ = 0;
  double offset_ = 0;
  double slope_ = 0;
};

/// Returns one end of a range: the line's flank, or the bead's own if that extends further, plus
/// the margin, within the band.
double EndOf(double line, std::optional<double> own, double band) {
  double end = line;
  if (own && *own > line + kFollowedRows) end = *own;
  return std::min(std::max(end + kMarginRows, kNarrowestRows), band);
}

}  // namespace

std::vector<Interval> FindReach(std::span<const BeadSection> sections,
                                const std::vector<bool>& tells, double noise_px) {
  std::vector<Interval> reach;
  std::vector<std::optional<Interval>> flanks;
  for (std::size_t f = 0; f < sections.size(); ++f) {
    reach.push_back(sections[f].band);
    flanks.push_back(tells[f] ? FlanksOf(sections[f], noise_px) : std::nullopt);
  }
  std::vector<std::pair<double, double>> low, high;
  for (std::size_t f = 0; f < sections.size(); ++f) {
    const double area = sections[f].Sum(reach[f]);
    if (!flanks[f] || !(area > 0)) continue;
    low.emplace_back(area, -flanks[f]->lo);
    high.emplace_back(area, flanks[f]->hi);
  }
  if (low.size() < kFewestFrames) return reach;
  std::sort(low.begin(), low.end());
  std::sort(high.begin(), high.end());
  const FlankLine low_line(low);
  const FlankLine high_line(high);
  // The whole band's area, which the plate makes noisy, is good enough as an initial size.
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t f = 0; f < sections.size(); ++f) {
      if (!tells[f]) continue;
      const Interval& band = sections[f].band;
      const double area = sections[f].Sum(reach[f]);
      std::optional<double> own_low, own_high;
      if (flanks[f]) {
        own_low = -flanks[f]->lo;
        own_high = flanks[f]->hi;
      }
      reach[f] = {-EndOf(low_line.at(area), own_low, -band.lo),
                  EndOf(high_line.at(area), own_high, band.hi)};
    }
  }
  return reach;
}

}  // namespace trammel::pressure_advance
