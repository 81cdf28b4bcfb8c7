#include "pressure_advance/laser/laser_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/check.h"
#include "base/statistics.h"
#include "pressure_advance/laser/bead_area.h"
#include "pressure_advance/laser/plate.h"
#include "pressure_advance/timing/sweep_positions.h"

namespace trammel::pressure_advance {

void ShareScatter(std::span<LineProfile> lines) {
  std::vector<double> typical;
  for (const LineProfile& line : lines) {
    std::vector<double> sigmas;
    for (const ProfileSample& sample : line.samples) {
      if (sample.area.seen()) sigmas.push_back(sample.area.sigma);
    }
    if (!sigmas.empty()) typical.push_back(Median(sigmas));
  }
  if (typical.empty()) return;
  const double shared = Median(typical);
  constexpr double kMax = 1.5;
  for (LineProfile& line : lines) {
    for (ProfileSample& sample : line.samples) {
      if (!sample.area.seen()) continue;
      const double half_way = std::sqrt(shared / sample.area.sigma);
      sample.area.sigma *= std::clamp(half_way, 1 / kMax, kMax);
    }
  }
}

namespace {

/// Maximum share of the band that may be interpolated in one piece.
constexpr double kLongestBridge = 1.0 / 3;

/// True if a frame shows its bead's whole section.
bool Shown(const PlateHeights& plate, std::size_t frame, const BeadSection& section) {
  const auto rows = static_cast<double>(section.height.size());
  return plate.plate_sigma_px[frame] > 0 && !plate.cut_off[frame] &&
         section.longest_bridge <= kLongestBridge * rows;
}

/// Computes the width at `level` between the outermost crossings, in rows; 0 if nothing rises so
/// high.
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

// Lengths per pixel of the height map.
struct SectionScale {
  double length_per_row = 1;  // along the stripe
  double height_per_px = 1;   // of the surface, per pixel of shift
};

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
  // Below three sigmas a bead's edges cannot be distinguished from noise.
  const double level = std::max(0.2 * top, 3 * plate.noise_px);
  sample.width.value = WidthAt(section.height, level) * scale.length_per_row;
  // Each edge is the crossing of the level by a flank with a slope of about one bead height per
  // bead height.
  sample.width.sigma = scale.length_per_row * std::sqrt(2.0) * std::max(0.5, plate.noise_px);
  return sample;
}

/// Scales the areas' sigmas to the scatter from frame to frame: the rows' sigmas come from the
/// plate, which does not show the bead's own texture and speckle, nor the bead the plate's texture.
/// Second differences ignore slow changes of the bead.
void ScaleToScatter(std::vector<ProfileSample>& samples) {
  constexpr double kMin = 0.4;  // neighbours that share noise differ by less than it
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
  const double scale = std::max(kMin, RobustStandardDeviation(pulls));
  for (ProfileSample& sample : samples) {
    sample.area.sigma *= scale;
  }
}

// Width, height and area of the bead, one sample per frame; position is left at 0.
//
// The area is the sum of the heights over the rows that a bead of its size covers (FindReach), or
// over all of its band where a swell stands clearly beyond the others', positive and negative
// alike: so noise hardly biases it, it stays linear down to a bead of nothing, and a broken bead
// reads 0. A frame where more than a third of the band is unseen in one piece is a gap, and so is
// one whose bead reaches out of the picture.
std::vector<ProfileSample> MeasureBead(const PlateHeights& plate, const SectionScale& scale) {
  std::vector<ProfileSample> samples;
  std::vector<BeadSection> sections;
  std::vector<bool> tells;
  for (std::size_t f = 0; f < plate.heights.frames; ++f) {
    sections.push_back(CutSection(plate, f));
    // A swell is summed over its whole wider band.
    tells.push_back(Shown(plate, f, sections[f]) && plate.band.half(f) <= plate.band.half_width);
  }
  const std::vector<Interval> reach = FindReach(sections, tells, plate.noise_px);
  for (std::size_t f = 0; f < plate.heights.frames; ++f) {
    samples.push_back(MeasureFrame(plate, scale, f, sections[f], reach[f]));
  }
  ScaleToScatter(samples);
  return samples;
}

/// Mean over all frames and pixels, per colour, for messages.
struct Light {
  double mean = 0;
  int brightest = 0;
  int darkest = 255;
};

Light MeasureLight(std::span<const Frame> frames, std::span<const std::size_t> order) {
  Light light;
  double sum = 0;
  double count = 0;
  for (const std::size_t index : order) {
    const Frame& frame = frames[index];
    for (std::size_t i = 2; i < frame.bgr.size(); i += 3) {
      sum += frame.bgr[i];
      light.brightest = std::max(light.brightest, int{frame.bgr[i]});
      light.darkest = std::min(light.darkest, int{frame.bgr[i]});
      count += 1;
    }
  }
  light.mean = count > 0 ? sum / count : 0;
  return light;
}

/// Explains frames that do not differ: no picture at all, or always the same one.
std::string FrozenFault(std::span<const Frame> frames, std::span<const std::size_t> order) {
  const Light light = MeasureLight(frames, order);
  constexpr int kPlain = 10;  // of 255: a blank picture
  if (light.brightest - light.darkest >= kPlain) {
    return fmt::format("all {} frames are the same picture; the camera or the machine did not move",
                       order.size());
  }
  return fmt::format(
      "no laser line: all {} frames are plain {} (red {} … {}); check that the laser is on, the "
      "exposure, and the camera",
      order.size(),
      light.mean < 64    ? "black"
      : light.mean > 192 ? "white"
                         : "grey",
      light.darkest, light.brightest);
}

/// Adds a frame unless it is past the ends of the line.
void Keep(std::size_t frame, double position_mm, const Scan& scan, SweepReading& reading) {
  // A hundredth of a frame's step past the end is rounding.
  const double slack_mm = 0.01 * scan.scan_speed_mm_s / scan.frames_per_s;
  if (position_mm < -slack_mm || position_mm > scan.motion.length_mm.value_or(0) + slack_mm) {
    ++reading.off_line_frames;
    return;
  }
  reading.frame.push_back(frame);
  reading.heights.position_mm.push_back(position_mm);
}

/// Chooses the frames to score: in motion and on the line, in print direction.
void ChooseFrames(std::span<const Frame> frames, const Scan& scan, const ScanLine& line,
                  SweepReading& reading) {
  const std::vector<std::size_t> placed = PlacedFrames(line, frames.size());
  const StillFrames still = FindStillFrames(frames, placed);
  if (still.all) {
    reading.profile.unusable = FrozenFault(frames, placed);
    return;
  }
  if (line.frame_positions_mm.empty()) {
    reading.still_frames = still.first + still.last;
    const std::vector<double> position = SweepPositions(scan, line, frames.size(), still.first);
    for (std::size_t i = still.first; i + still.last < frames.size(); ++i) {
      Keep(i, position[i], scan, reading);
    }
  } else {
    // The positions already exclude frames at rest, by the machine's report.
    reading.unplaced_frames = frames.size() - placed.size();
    for (const std::size_t i : placed) {
      Keep(i, *line.frame_positions_mm[i], scan, reading);
    }
  }
  if (SweepsBackwards(line)) {
    std::reverse(reading.frame.begin(), reading.frame.end());
    std::reverse(reading.heights.position_mm.begin(), reading.heights.position_mm.end());
  }
}

/// Returns frames spread over the sweep, from which the stripe's appearance is estimated.
std::vector<BgrView> ModelFrames(std::span<const Frame> frames,
                                 const std::vector<std::size_t>& chosen,
                                 const LaserReaderOptions& options) {
  std::vector<BgrView> views;
  const std::size_t count = std::min(options.model_frames, chosen.size());
  for (std::size_t i = 0; i < count; ++i) {
    views.push_back(frames[chosen[(2 * i + 1) * chosen.size() / (2 * count)]].view());
  }
  return views;
}

/// Finds the line in every chosen frame; columns become heights above column 0.
HeightMap FindLines(std::span<const Frame> frames, SweepReading& reading,
                    const LaserReaderOptions& options, double sign,
                    vision::LaserLineWorkspace& workspace) {
  HeightMap lines;
  lines.frames = reading.frame.size();
  lines.rows = static_cast<std::size_t>(frames[reading.frame[0]].height);
  lines.position_mm = reading.heights.position_mm;
  lines.height_px.resize(lines.frames * lines.rows);
  lines.sigma_px.resize(lines.frames * lines.rows);
  vision::LaserLine line;
  for (std::size_t f = 0; f < lines.frames; ++f) {
    vision::FindLaserLine(frames[reading.frame[f]].view(), reading.stripe, options.line, workspace,
                          line);
    for (std::size_t r = 0; r < lines.rows; ++r) {
      lines.height_px[lines.index(f, r)] = static_cast<float>(sign * line.centre_px[r]);
      lines.sigma_px[lines.index(f, r)] = line.sigma_px[r];
    }
  }
  return lines;
}

/// Returns why the sweep shows no laser; empty if it does.
std::string LaserFault(const HeightMap& lines, const SweepReading& reading,
                       const LaserReaderOptions& options, std::span<const Frame> frames) {
  const vision::StripeModel& stripe = reading.stripe;
  std::size_t lit = 0;
  for (std::size_t f = 0; f < lines.frames; ++f) {
    std::size_t found = 0;
    for (std::size_t r = 0; r < lines.rows; ++r) {
      found += lines.sigma_px[lines.index(f, r)] > 0 ? 1 : 0;
    }
    lit += 2 * found >= lines.rows ? 1 : 0;
  }
  const bool steady = stripe.scatter_px < 1.5F * stripe.sigma_px;
  if (2 * lit >= lines.frames && stripe.contrast >= options.min_contrast && steady) {
    return {};
  }
  std::string wide = FaultOfWidth(reading.observation, frames[reading.frame[0]].width);
  if (!wide.empty()) return wide;
  const Light light = MeasureLight(frames, reading.frame);
  return fmt::format(
      "no laser line: seen in {} of {} frames, {:.1f} times the noise beside it (at least {:.1f} "
      "needed), {:.1f} px from row to row; red is {:.0f} on average, {} … {}; check that the laser "
      "is on, the exposure, and crop_px",
      lit, lines.frames, stripe.contrast, options.min_contrast,
      std::min(stripe.scatter_px, 9999.0F), light.mean, light.darkest, light.brightest);
}

/// Marks frames whose bead reaches the picture's edge, where the line is cut off.
void MarkCutTops(const HeightMap& lines, const SweepReading& reading, double sign, int width,
                 PlateHeights& plate) {
  constexpr int kFewestRows = 3;  // fewer are glints
  const double margin = 1.5 * reading.stripe.sigma_px;
  const double highest = sign > 0 ? width - 1 - margin : -margin;
  for (std::size_t f = 0; f < lines.frames; ++f) {
    int rows = 0;
    for (std::size_t r = 0; r < lines.rows; ++r) {
      const std::size_t i = lines.index(f, r);
      if (lines.sigma_px[i] > 0 && lines.height_px[i] > highest && !OnPlate(plate.band, f, r)) {
        ++rows;
      }
    }
    if (rows >= kFewestRows) plate.cut_off[f] = true;
  }
}

SectionScale ScaleOf(const Scan& scan) {
  const double tangent = std::tan(scan.laser_angle_rad);
  const double mm_per_px = scan.px_per_mm ? 1 / *scan.px_per_mm : 1;
  return {mm_per_px, mm_per_px / tangent};
}

/// Fills samples in print order; skips a frame at the position of the one before it.
void FillSamples(std::vector<ProfileSample> samples, const HeightMap& heights,
                 LineProfile& profile) {
  for (std::size_t f = 0; f < samples.size(); ++f) {
    samples[f].position = heights.position_mm[f];
    if (profile.samples.empty() || samples[f].position > profile.samples.back().position) {
      profile.samples.push_back(samples[f]);
    }
  }
}

}  // namespace

void TurnUpright(const BgrView& view, AxisDirection height_direction, Frame& upright) {
  const bool transpose = !AlongX(height_direction);
  const int width = transpose ? view.height : view.width;
  const int height = transpose ? view.width : view.height;
  if (upright.width != width || upright.height != height) {
    upright = Frame(width, height);
  }
  for (int y = 0; y < height; ++y) {
    std::uint8_t* out = upright.row(y);
    if (!transpose) {
      std::copy_n(view.row(y), 3 * static_cast<std::size_t>(width), out);
      continue;
    }
    for (int x = 0; x < width; ++x) {
      std::copy_n(view.row(x) + std::ptrdiff_t{3} * y, 3, out + std::ptrdiff_t{3} * x);
    }
  }
}

SweepReading ReadSweep(std::span<const Frame> frames, const Scan& scan, const ScanLine& line,
                       const LaserReaderOptions& options, vision::LaserLineWorkspace& workspace) {
  TRAMMEL_CHECK(!frames.empty(), "a sweep without frames");
  SweepReading reading;
  LineProfile& profile = reading.profile;
  profile.pressure_advance_s = line.pressure_advance_s;
  profile.heading = Sign(line.print_direction.value_or(AxisDirection::kPlusX));
  profile.cross_section_unit =
      scan.px_per_mm ? CrossSectionUnit::kMillimetre : CrossSectionUnit::kPixel;
  profile.position_unit = PositionUnit::kMillimetre;
  ChooseFrames(frames, scan, line, reading);
  if (!profile.unusable.empty()) {
    return reading;
  }
  if (reading.frame.size() < options.fewest_frames) {
    profile.unusable = fmt::format(
        "only {} of {} frames show the line ({} standing still, {} without a position, {} past its "
        "ends); at least {} are needed: check {}",
        reading.frame.size(), frames.size(), reading.still_frames, reading.unplaced_frames,
        reading.off_line_frames, options.fewest_frames,
        line.frame_positions_mm.empty() ? "scan_speed_mm_s, frames_per_s and line_start_mm"
                                        : "frame_positions_mm");
    return reading;
  }
  const std::vector<BgrView> model_frames = ModelFrames(frames, reading.frame, options);
  reading.stripe = vision::LearnStripe(model_frames, options.line, workspace);
  reading.observation = SeeStripe(model_frames);
  const HeightMap lines =
      FindLines(frames, reading, options, Sign(scan.height_direction), workspace);
  profile.unusable = LaserFault(lines, reading, options, frames);
  if (!profile.unusable.empty()) {
    return reading;
  }
  PlateHeights plate = FindPlate(lines);
  profile.unusable = plate.fault;
  if (!profile.unusable.empty()) {
    return reading;
  }
  MarkCutTops(lines, reading, Sign(scan.height_direction), frames[reading.frame[0]].width, plate);
  reading.cut_off_frames =
      static_cast<std::size_t>(std::count(plate.cut_off.begin(), plate.cut_off.end(), true));
  FillSamples(MeasureBead(plate, ScaleOf(scan)), plate.heights, profile);
  reading.heights = std::move(plate.heights);
  return reading;
}

}  // namespace trammel::pressure_advance
