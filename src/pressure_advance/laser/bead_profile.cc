#include "pressure_advance/laser/bead_profile.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "pressure_advance/laser/bead_reach.h"
#include "pressure_advance/laser/bead_section.h"

namespace trammel::pressure_advance {
namespace {

/// Share of the band that may be bridged in one piece.
constexpr double kLongestBridge = 1.0 / 3;

/// Whether a frame shows its bead's whole section.
bool Shown(const PlateHeights& plate, std::size_t frame, const BeadSection& section) {
  const auto rows = static_cast<double>(section.height.size());
  return plate.plate_sigma_px[frame] > 0 && !plate.cut_off[frame] &&
         section.longest_bridge <= kLongestBridge * rows;
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

ProfileSample MeasureFrame(const PlateHeights& plate, const SectionScale& scale, std::size_t frame,
                           const BeadSection& section, const Interval& reach) {
  ProfileSample sample;
  sample.cut_off = plate.cut_off[frame];
  sample.gap = !Shown(plate, frame, section);
  if (sample.gap) {
    return sample;
  }
  double variance = 0;
  double top = 0;
  for (std::size_t i = 0; i < section.height.size(); ++i) {
    const double share = section.Share(i, reach);
    variance += share * share * section.variance[i];
    if (i > 0 && i + 1 < section.height.size()) {
      top = std::max(top, section.Smooth(i));
    }
  }
  const double level_sigma = plate.plate_sigma_px[frame] * (reach.hi - reach.lo);
  variance = variance * plate.row_correlation + level_sigma * level_sigma;
  sample.area = {section.Sum(reach) * scale.length_per_row * scale.height_per_px,
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

/// Scales the areas' sigmas to the scatter from frame to frame: the bead's own texture and speckle
/// are not seen on the plate, from which the rows' sigmas come, and a plate's texture is not on the
/// bead. Second differences are blind to slow changes of the bead.
void ScaleToScatter(std::vector<ProfileSample>& samples) {
  constexpr double kLeast = 0.4;  // neighbours that share noise differ by less than it
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
  const double scale = std::max(kLeast, RobustStandardDeviation(pulls));
  for (ProfileSample& sample : samples) {
    sample.area.sigma *= scale;
  }
}

}  // namespace

std::vector<ProfileSample> MeasureBead(const PlateHeights& plate, const SectionScale& scale) {
  std::vector<ProfileSample> samples;
  std::vector<BeadSection> sections;
  std::vector<bool> tells;
  for (std::size_t f = 0; f < plate.heights.frames; ++f) {
    sections.push_back(CutSection(plate, f));
    // A swell is summed over all of its wider band.
    tells.push_back(Shown(plate, f, sections[f]) && plate.band.half(f) <= plate.band.half_width);
  }
  const std::vector<Interval> reach = FindReach(sections, tells, plate.noise_px);
  for (std::size_t f = 0; f < plate.heights.frames; ++f) {
    samples.push_back(MeasureFrame(plate, scale, f, sections[f], reach[f]));
  }
  ScaleToScatter(samples);
  return samples;
}

}  // namespace trammel::pressure_advance
