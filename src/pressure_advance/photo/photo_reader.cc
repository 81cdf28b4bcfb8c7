#include "pressure_advance/photo/photo_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "pressure_advance/photo/photo_lines.h"
#include "pressure_advance/photo/photo_mark.h"
#include "pressure_advance/photo/photo_orientation.h"
#include "pressure_advance/photo/photo_signs.h"
#include "vision/bead_width.h"
#include "vision/image.h"

namespace trammel::pressure_advance {
namespace {

std::string CheckOptions(const PhotoOptions& options) {
  if (options.pressure_advance_s.size() < 2) {
    return fmt::format("the PA list has {} values; a photo of a pattern needs at least 2",
                       options.pressure_advance_s.size());
  }
  constexpr std::size_t kMaxLines = 500;
  if (options.pressure_advance_s.size() > kMaxLines) {
    return fmt::format("the PA list has {} values; a photo is read with at most {}",
                       options.pressure_advance_s.size(), kMaxLines);
  }
  for (const double value : options.pressure_advance_s) {
    if (!std::isfinite(value)) return fmt::format("the PA list holds {}, not a number", value);
  }
  const double before = options.slow_before, after = options.slow_after;
  if (!(before > 0 && after > 0 && before + after < 1)) {
    return fmt::format(
        "the slow parts of a line are given as {} and {} of its length; both must be above 0 and "
        "together below 1",
        before, after);
  }
  return {};
}

std::string CheckPhoto(int width_px, int height_px) {
  constexpr int kSmallest_px = 100;
  if (std::min(width_px, height_px) < kSmallest_px) {
    return fmt::format("the photo has {} x {} px; at least {} each way are needed", width_px,
                       height_px, kSmallest_px);
  }
  return {};
}

std::vector<LineProfile> Profiles(const vision::BeadWidths& widths,
                                  const std::vector<double>& pressure_advance_s) {
  std::vector<LineProfile> profiles;
  for (std::size_t line = 0; line < widths.lines.size(); ++line) {
    LineProfile profile;
    profile.pressure_advance_s = pressure_advance_s[line];
    profile.cross_section_unit = CrossSectionUnit::kPixel;
    profile.position_unit = PositionUnit::kLineLength;
    const std::vector<vision::BeadReading>& readings = widths.lines[line];
    std::size_t gaps = 0, plain = 0, seen = 0;
    for (std::size_t i = 0; i < readings.size(); ++i) {
      ProfileSample sample;
      sample.position = (static_cast<double>(i) + 0.5) / static_cast<double>(readings.size());
      sample.gap = !(readings[i].sigma_px > 0);
      gaps += readings[i].seen && sample.gap;
      plain += readings[i].seen && sample.gap && readings[i].width_px > 0;
      seen += readings[i].seen;
      if (!sample.gap) {
        sample.width = {std::max(0.0, readings[i].width_px), readings[i].sigma_px};
      }
      profile.samples.push_back(sample);
    }
    constexpr double kMaxGaps = 0.5;
    if (static_cast<double>(plain) > kMaxGaps * static_cast<double>(seen)) {
      profile.unusable = fmt::format(
          "the plate is of one even colour, without any grain, along {} of {} places of this line: "
          "a drawing or a slicer's preview, or an overexposed photo; take a photo of the print",
          plain, seen);
    } else if (static_cast<double>(gaps) > kMaxGaps * static_cast<double>(seen)) {
      profile.unusable = fmt::format(
          "filament and plate look alike along {} of {} places of this line: glare or shadow", gaps,
          seen);
    }
    profiles.push_back(std::move(profile));
  }
  return profiles;
}

void Reverse(std::vector<LineProfile>& profiles) {
  for (LineProfile& profile : profiles) {
    std::reverse(profile.samples.begin(), profile.samples.end());
    for (ProfileSample& sample : profile.samples) sample.position = 1 - sample.position;
  }
}

// Orientation of the lines in the rectified picture.
struct Orientation {
  bool first_at_bottom = true;
  bool reversed = false;  // printed from right to left
};

void FlipPicture(Frame& picture, bool left_right, bool top_bottom) {
  Frame flipped(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) {
    const std::uint8_t* from = picture.row(top_bottom ? picture.height - 1 - y : y);
    std::uint8_t* to = flipped.row(y);
    for (int x = 0; x < picture.width; ++x) {
      const std::uint8_t* pixel = from + 3 * (left_right ? picture.width - 1 - x : x);
      std::copy(pixel, pixel + 3, to + 3 * x);
    }
  }
  picture = std::move(flipped);
}

std::vector<TracedLine> Traces(const vision::BeadWidths& widths,
                               const std::vector<LineProfile>& profiles, const Frame& picture,
                               bool left_right, bool top_bottom) {
  std::vector<TracedLine> traces;
  for (std::size_t i = 0; i < widths.lines.size(); ++i) {
    TracedLine trace;
    trace.pressure_advance_s = profiles.at(i).pressure_advance_s;
    for (const vision::BeadReading& reading : widths.lines[i]) {
      trace.x_px.push_back(left_right ? picture.width - 1 - reading.x_px : reading.x_px);
      trace.centre_px.push_back(top_bottom ? picture.height - 1 - reading.centre_px
                                           : reading.centre_px);
      trace.width_px.push_back(std::max(0.0, reading.width_px));
    }
    if (left_right) {
      std::reverse(trace.x_px.begin(), trace.x_px.end());
      std::reverse(trace.centre_px.begin(), trace.centre_px.end());
      std::reverse(trace.width_px.begin(), trace.width_px.end());
    }
    traces.push_back(std::move(trace));
  }
  return traces;
}

std::string CheckSharpness(const vision::LinePattern& line_pattern, double blur_px) {
  constexpr double kSmallestBead_px = 3;
  if (line_pattern.bead_px < kSmallestBead_px) {
    return fmt::format(
        "the lines are {:.1f} px wide in the photo; at least {} px are needed: go nearer or use a "
        "sharper camera",
        line_pattern.bead_px, kSmallestBead_px);
  }
  // Sigma over the bead's width, both as seen: a bead 4.5 sigma wide. Beyond that the ratio remains
  // about 0.25, since a wider blur also widens the seen bead.
  constexpr double kMaxBlur = 0.22;
  if (blur_px > kMaxBlur * line_pattern.bead_px) {
    return fmt::format(
        "the photo is blurred: edges are {:.1f} px wide (1 sigma) on lines of {:.1f} px, at most "
        "{} of a line's width can be read",
        blur_px, line_pattern.bead_px, kMaxBlur);
  }
  return {};
}

// Writes the measurements, in the order of the list and with the print direction to the right.
void Deliver(PhotoLines& seen, const vision::BeadWidths& widths, const Orientation& lie,
             PhotoMeasurement& measurement) {
  if (lie.reversed) Reverse(measurement.profiles);
  measurement.view.lines =
      Traces(widths, measurement.profiles, seen.picture, lie.reversed, !lie.first_at_bottom);
  FlipPicture(seen.picture, lie.reversed, !lie.first_at_bottom);
}

// Reading of the lines with the first one at one side.
struct SideReading {
  LineNames names;
  Orientation lie;
  vision::BeadWidths widths;  // in list order
  std::vector<LineProfile> profiles;
  OrientationReading orientation;

  // Empty if the lines are usable in this order, unless they are upside down.
  [[nodiscard]] const std::string& refusal() const {
    return names.refusal.empty() ? orientation.refusal : names.refusal;
  }
  [[nodiscard]] bool usable() const { return refusal().empty() && !orientation.upside_down; }
  // The other side is tried only after a contradiction by the lines, or positions that do not fit.
  [[nodiscard]] bool other_side_may_do() const {
    return orientation.upside_down || !names.refusal.empty();
  }
};

SideReading ReadFrom(PhotoSide from, const PhotoLines& seen, const vision::BeadWidths& widths,
                     const PhotoOptions& options, bool order_on_trust,
                     std::span<const ShownPart> parts) {
  const vision::Quad& c = seen.corners;  // top left, top right, bottom right, bottom left
  SideReading side;
  side.lie.first_at_bottom = Towards(HeadingBetween(c[0], c[1], c[3], c[2]), from) > 0;
  side.names = NameLines(seen.line_pattern, options.pressure_advance_s, side.lie.first_at_bottom);
  if (!side.names.refusal.empty()) return side;
  side.widths = widths;
  if (side.lie.first_at_bottom) {
    std::reverse(side.widths.lines.begin(), side.widths.lines.end());
  }
  side.profiles = Profiles(side.widths, side.names.pressure_advance_s);
  side.orientation = ReadOrientation(side.profiles, options, HeadingBetween(c[0], c[3], c[1], c[2]),
                                     from, order_on_trust, parts);
  side.lie.reversed = side.orientation.reversed;
  return side;
}

// Computes the visible part of a line, in print direction.
Interval ShownOf(const std::vector<vision::BeadReading>& readings, bool reversed) {
  const auto is_seen = [](const vision::BeadReading& reading) { return reading.seen; };
  const auto n = static_cast<double>(readings.size());
  const auto hidden_left = static_cast<double>(
      std::find_if(readings.begin(), readings.end(), is_seen) - readings.begin());
  const auto hidden_right = static_cast<double>(
      std::find_if(readings.rbegin(), readings.rend(), is_seen) - readings.rbegin());
  return {(reversed ? hidden_right : hidden_left) / n,
          1 - (reversed ? hidden_left : hidden_right) / n};
}

// Marks lines that leave the photo beside a speed change, and omits those that show neither.
void MarkCutLines(const SideReading& side, const PhotoOptions& options,
                  std::vector<LineProfile>& profiles) {
  constexpr double kBefore = 0.03;     // line lengths: half of a bulge
  constexpr double kShareAfter = 0.7;  // of the slow part after the deceleration
  constexpr int kFewestAfter = 5;      // lines that show it: they tell the others' level there
  constexpr double kBeside = 0.35;     // of the fast part: region of each speed change
  const auto& segments = side.orientation.segments;
  const double rise = segments ? segments->fast_begin : options.slow_before;
  const double fall = segments ? segments->fast_end : 1 - options.slow_after;
  const double max_of_it = fall + kShareAfter * options.slow_after;
  std::vector<Interval> shown;
  int after = 0;
  for (const std::vector<vision::BeadReading>& readings : side.widths.lines) {
    shown.push_back(ShownOf(readings, side.lie.reversed));
    after += shown.back().hi == 1 || shown.back().hi >= max_of_it;
  }
  const double min_end = after >= kFewestAfter ? fall : max_of_it;
  for (std::size_t line = 0; line < profiles.size(); ++line) {
    const auto [begin, end] = shown[line];
    LineProfile& profile = profiles[line];
    if (begin > 0 || end < 1) {
      constexpr double kAll = 2;  // beyond both ends of a line
      profile.shown = {begin > 0 ? begin : -kAll, end < 1 ? end : kAll};
    }
    const bool begins = begin == 0 || begin <= rise - kBefore;
    const bool ends = end == 1 || end >= min_end;
    profile.shows_acceleration = begins && end >= rise + kBeside * (fall - rise);
    profile.shows_deceleration = ends && begin <= fall - kBeside * (fall - rise);
    if (!profile.shows_acceleration && !profile.shows_deceleration && profile.unusable.empty()) {
      profile.unusable = fmt::format(
          "the photo shows this line from {:.2f} to {:.2f} of its length, too little around its "
          "speed changes",
          begin, end);
    }
  }
}

// Moves the ends of lines that leave the photo to the positions implied by the speed changes.
void PlaceUnseenEnds(const ShownPart& shown, vision::LinePattern& line_pattern) {
  const double middle = line_pattern.left_inner.centre;
  const double length = line_pattern.right_inner(middle) - line_pattern.left_inner(middle);
  const double per_line = length / (shown.end - shown.begin);
  line_pattern.left_inner.c0 -= shown.begin * per_line;
  line_pattern.right_inner.c0 += (1 - shown.end) * per_line;
}

// Returns the options, with the sides from the printed mark if none are given.
PhotoOptions WithMark(const PhotoLines& seen, const PhotoOptions& given,
                      PhotoMeasurement& measurement) {
  PhotoOptions options = given;
  if (!given.corner_mark || (given.from && given.start)) return options;
  const std::optional<MarkedCorner> mark = FindMark(seen.contrast, seen.line_pattern);
  if (!mark) return options;
  const auto [down, right] = SidesOf(seen.corners);
  const PhotoSide first = mark->bottom ? down : Opposite(down);
  const PhotoSide start = mark->right ? right : Opposite(right);
  options.from = given.from.value_or(first);
  options.start = given.start.value_or(start);
  measurement.marked = true;
  measurement.notices.push_back(fmt::format(
      "the printed mark says: the first line lies at the {} of the photo, the lines start at the "
      "{}",
      ToString(first), ToString(start)));
  return options;
}

// Returns the options, with the sides from the marks and numbers that other tools print.
PhotoOptions WithSigns(const PhotoLines& seen, const PhotoOptions& given) {
  PhotoOptions options = given;
  if (given.framed || (given.from && given.start)) return options;
  const PrintedSigns signs =
      FindPrintedSigns(seen.contrast, seen.line_pattern, given.slow_before, given.slow_after);
  const auto [down, right] = SidesOf(seen.corners);
  if (!given.from && signs.last_at_bottom) {
    // The tools' last line has the highest value; a pattern printed upside down has it in front.
    const bool rising = given.pressure_advance_s.front() < given.pressure_advance_s.back();
    options.from = *signs.last_at_bottom == rising ? Opposite(down) : down;
  }
  if (!given.start && signs.end_at_right) {
    options.start = *signs.end_at_right ? Opposite(right) : right;
  }
  return options;
}

// Measures profiles from the frame and its rungs, in the order of the PA list.
void MeasureLines(PhotoLines& seen, const PhotoOptions& given, PhotoMeasurement& measurement) {
  const PhotoOptions options = WithSigns(seen, WithMark(seen, given, measurement));
  const vision::Quad& c = seen.corners;  // top left, top right, bottom right, bottom left
  const Heading down = HeadingBetween(c[0], c[1], c[3], c[2]);
  const PhotoSide usual = options.from.value_or(UsualSide(down));
  if (!IsAlong(down, usual)) {
    measurement.refusal = fmt::format(
        "the lines follow each other towards {} in this photo, so the first cannot lie at the {}",
        SidesAlong(down), ToString(usual));
    return;
  }
  const bool usual_on_trust = options.from || (options.framed && usual == PhotoSide::kBottom);
  PhotoSide from = usual;
  SideReading side;
  std::string first_refusal;
  vision::BeadWidths widths;
  std::vector<ShownPart> parts =
      PossibleParts(seen.line_pattern.left_seen, seen.line_pattern.right_seen);
  for (const bool placed : {false, true}) {
    widths = vision::MeasureBeadWidths(seen.contrast, seen.line_pattern);
    from = usual;
    side = ReadFrom(from, seen, widths, options, usual_on_trust, parts);
    first_refusal = side.refusal();
    if (!options.from && side.other_side_may_do()) {
      from = Opposite(usual);
      side = ReadFrom(from, seen, widths, options, false, parts);
    }
    if (placed || parts.size() == 1 || !side.usable()) break;
    PlaceUnseenEnds(side.orientation.shown, seen.line_pattern);
    parts = {{}};
  }
  measurement.blur = widths.blur_px / seen.line_pattern.bead_px;
  if (side.names.refusal.empty()) {
    measurement.refusal = CheckSharpness(seen.line_pattern, widths.blur_px);
    if (!measurement.refusal.empty()) return;
    // Lines that cannot be measured show no side either.
    if (std::ranges::none_of(side.profiles, &std::string::empty, &LineProfile::unusable)) {
      measurement.refusal =
          fmt::format("no line can be measured: {}", side.profiles.front().unusable);
      return;
    }
  }
  if (!side.usable()) {
    measurement.refusal = !first_refusal.empty() ? first_refusal : side.refusal();
    if (measurement.refusal.empty()) {
      measurement.refusal = fmt::format(
          "the lines contradict either order of the PA list; give the side at which the first one "
          "lies (--from {} or {})",
          ToString(usual), ToString(Opposite(usual)));
    }
    return;
  }
  if (!side.names.notice.empty()) measurement.notices.push_back(side.names.notice);
  MarkCutLines(side, options, side.profiles);
  measurement.profiles = std::move(side.profiles);
  measurement.segments = side.orientation.segments;
  measurement.first_line = from;
  Deliver(seen, side.widths, side.lie, measurement);
}

}  // namespace

double PictureSigma(double blur) {
  constexpr double kPerSquare = 0.4;
  return kPerSquare * blur * blur;
}

std::string CheckPhotoInput(int width_px, int height_px, const PhotoOptions& options) {
  std::string problem = CheckOptions(options);
  return problem.empty() ? CheckPhoto(width_px, height_px) : problem;
}

PhotoMeasurement MeasurePhotoLines(PhotoLines&& seen, const PhotoOptions& options) {
  PhotoMeasurement measurement;
  if (!seen.problem.empty()) {
    measurement.refusal = std::move(seen.problem);
    return measurement;
  }
  MeasureLines(seen, options, measurement);
  measurement.view.rectified = std::move(seen.picture);
  return measurement;
}

}  // namespace trammel::pressure_advance
