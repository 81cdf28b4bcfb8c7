#include "pressure_advance/laser/bead_profile.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

/// Share of the band that may be bridged in one piece.
constexpr double kLongestBridge = 1.0 / 3;

/// The band's rows of one frame with unseen rows bridged.
struct Section {
  std::vector<double> height;
  std::vector<double> variance;
  double first_weight = 1;  ///< the part of the first row that lies within the band
  double last_weight = 1;
  int longest_bridge = 0;
};

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

Section CutSection(const PlateHeights& plate, std::size_t frame) {
  const double lo = plate.band.centre(frame) - plate.band.half(frame);
  const double hi = plate.band.centre(frame) + plate.band.half(frame);
  const int first = static_cast<int>(std::floor(lo + 0.5));
  const int last = static_cast<int>(std::floor(hi + 0.5));
  Section section;
  section.first_weight = first + 0.5 - lo;
  section.last_weight = hi - (last - 0.5);
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

/// Where the heights cross `level`, outermost on both sides, in rows; 0 where nothing rises so far.
double WidthAt(const std::vector<double>& height, double level) {
  const auto above = [&](std::size_t i) { return height[i] > level; };
  std::size_t first = 0;
  while (first < height.size() && !above(first)) ++first;
  if (first == height.size()) {
    return 0;
  }
  std::size_t last = height.size() - 1;
  while (!above(last)) --last;
  double width = static_cast<double>(last - first);
  if (first > 0) {
    width += (height[first] - level) / (height[first] - height[first - 1]);
  }
  if (last + 1 < height.size()) {
    width += (height[last] - level) / (height[last] - height[last + 1]);
  }
  return width;
}

ProfileSample MeasureFrame(const PlateHeights& plate, const SectionScale& scale,
                           std::size_t frame) {
  ProfileSample sample;
  const Section section = CutSection(plate, frame);
  const auto rows = static_cast<double>(section.height.size());
  sample.cut_off = plate.cut_off[frame];
  if (plate.plate_sigma_px[frame] <= 0 || sample.cut_off ||
      section.longest_bridge > kLongestBridge * rows) {
    sample.gap = true;
    return sample;
  }
  double area = 0;
  double variance = 0;
  double top = 0;
  for (std::size_t i = 0; i < section.height.size(); ++i) {
    const double weight = i == 0                           ? section.first_weight
                          : i + 1 == section.height.size() ? section.last_weight
                                                           : 1;
    area += weight * section.height[i];
    variance += weight * weight * section.variance[i];
    if (i > 0 && i + 1 < section.height.size()) {
      top = std::max(top, (section.height[i - 1] + section.height[i] + section.height[i + 1]) / 3);
    }
  }
  const double level_sigma = plate.plate_sigma_px[frame] * 2 * plate.band.half(frame);
  variance = variance * plate.row_correlation + level_sigma * level_sigma;
  sample.area = {area * scale.length_per_row * scale.height_per_px,
                 std::sqrt(variance) * scale.length_per_row * scale.height_per_px};
  const double top_sigma = plate.noise_px * std::sqrt(std::min(1.0, plate.row_correlation / 3));
  sample.height = {top * scale.height_per_px, top_sigma * scale.height_per_px};
  // Below three sigmas there is no bead whose edges could be told from noise.
  const double level = std::max(0.2 * top, 3 * plate.noise_px);
  sample.width.value = WidthAt(section.height, level) * scale.length_per_row;
  // Each edge is where a flank of about the bead's height per bead's height crosses the level.
  sample.width.sigma = scale.length_per_row * std::sqrt(2.0) * std::max(0.5, plate.noise_px);
  return sample;
}

/// Scales the areas' sigmas up to the scatter from frame to frame: the bead's own texture and
/// speckle are not seen on the plate, from which the rows' sigmas come. Second differences are
/// blind to slow changes of the bead.
void RaiseToScatter(std::vector<ProfileSample>& samples) {
  std::vector<double> pulls;
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const Seen& a = samples[i - 1].area;
    const Seen& b = samples[i].area;
    const Seen& c = samples[i + 1].area;
    if (a.seen() && b.seen() && c.seen()) {
      pulls.push_back((a.value - 2 * b.value + c.value) /
                      std::sqrt(a.sigma * a.sigma + 4 * b.sigma * b.sigma + c.sigma * c.sigma));
    }
  }
  if (pulls.size() < 8) {
    return;
  }
  const double scale = std::max(1.0, RobustStandardDeviation(pulls));
  for (ProfileSample& sample : samples) {
    sample.area.sigma *= scale;
  }
}

}  // namespace

std::vector<ProfileSample> MeasureBead(const PlateHeights& plate, const SectionScale& scale) {
  std::vector<ProfileSample> samples;
  samples.reserve(plate.heights.frames);
  for (std::size_t f = 0; f < plate.heights.frames; ++f) {
    samples.push_back(MeasureFrame(plate, scale, f));
  }
  RaiseToScatter(samples);
  return samples;
}

}  // namespace trammel::pressure_advance
