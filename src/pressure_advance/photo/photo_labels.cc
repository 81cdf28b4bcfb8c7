#include "pressure_advance/photo/photo_labels.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "pressure_advance/photo/label_sequence.h"
#include "pressure_advance/photo/photo_orientation.h"

namespace trammel::pressure_advance {
namespace {

using vision::Homography;

constexpr vision::DigitStyle kWide{}, kNarrow{true, false}, kMarlin{true, true};
constexpr LabelFormat kEllisFormat{kNarrow, true, 4}, kMarlinFormat{kMarlin, true, 3};
// Bambu Studio prints a sixth character where there is one; it is not looked at.
constexpr LabelFormat kOrcaFormat{kWide, false, 4, 5};

LabelReading Taken(const SequenceReading& reading) {
  LabelReading result;
  result.pressure_advance_s = reading.values_s;
  result.problem = reading.problem;
  result.lead = reading.lead;
  return result;
}

// Reads the labels as they are seen, else as in a mirrored photo.
LabelReading ReadEither(const std::function<SequenceReading(bool mirrored)>& read) {
  const SequenceReading seen = read(false);
  if (!seen.values_s.empty() || seen.as_given) return Taken(seen);
  const SequenceReading turned = read(true);
  // Labels show the side on which they lie before each digit is clear. Those that look better as
  // they are seen are not mirrored, even where they cannot be read.
  const bool read_turned = !turned.values_s.empty() || turned.as_given;
  const bool mirrored =
      turned.score >= (read_turned ? 0 : kLeastLabelScore) + std::max(0.0, seen.score);
  LabelReading result = Taken(mirrored ? turned : seen);
  result.mirrored = mirrored;
  return result;
}

// Labels beside lines in the rectified picture.
struct LinePlaces {
  LabelPlaces places;
  bool at_right = true;         // the lines end there
  bool first_at_bottom = true;  // line
};

// Tool that prints lines, and its labels: places from the lines' ends, middles below the lines.
struct LineTool {
  double pitch_mm, along_mm, below_mm;
  std::vector<LabelFormat> formats;
};

// Returns where the lines end at a rail, top to bottom, also at places without a line.
std::vector<vision::PointPx> EndsAt(const vision::LinePattern& pattern, const vision::Curve& rail,
                                    double middle_px) {
  std::vector<vision::PointPx> ends;
  for (std::size_t i = 0; i < pattern.rungs.size(); ++i) {
    const double x = rail(pattern.rungs[i](middle_px));
    const vision::PointPx end{x, pattern.rungs[i](x)};
    const vision::PointPx last = i == 0 ? end : ends.back();
    const int steps = i == 0 ? 1 : pattern.steps[i - 1];
    for (int k = 1; k <= steps; ++k) {
      const double part = static_cast<double>(k) / steps;
      ends.push_back({last.x + part * (end.x - last.x), last.y + part * (end.y - last.y)});
    }
  }
  return ends;
}

// Lists the ways in which the labels of all tools may lie beside these lines: upright and upside
// down.
std::vector<LinePlaces> WaysOf(const PhotoLines& lines, bool mirrored) {
  const vision::LinePattern& pattern = lines.line_pattern;
  const double w = lines.picture.width - 1.0, h = lines.picture.height - 1.0;
  const auto photo_from_picture =
      vision::TargetFromSource(lines.corners, {{{0, 0}, {w, 0}, {w, h}, {0, h}}});
  if (!photo_from_picture) return {};
  // Labels of Orca's newer versions lie on a tab, 4 mm from its edge, the others on the plate.
  const LineTool tools[] = {{3.5, 3.9, 0.25, {kOrcaFormat}},
                            {5, 2.4, 0, {kMarlinFormat, kEllisFormat}}};
  constexpr double kLength_mm = 79.3;  // between the bars' inner edges; 80 between free ends
  const double mm_x = (pattern.right_inner(h / 2) - pattern.left_inner(h / 2)) / kLength_mm;
  std::vector<LinePlaces> ways;
  for (const LineTool& tool : tools) {
    const double mm_y = pattern.pitch_px / tool.pitch_mm;
    constexpr double kSquare = 1.2;  // the rectified picture has about square px
    if (!(mm_x / mm_y < kSquare && mm_y / mm_x < kSquare)) continue;
    for (const bool at_right : {true, false}) {
      LinePlaces way;
      way.at_right = at_right;
      way.first_at_bottom = at_right != mirrored;
      way.places.formats = tool.formats;
      way.places.along_mm = 1.6;  // ends, bars and tabs differ
      const double along = at_right ? 1 : -1, up = way.first_at_bottom ? 1 : -1;
      auto ends = EndsAt(pattern, at_right ? pattern.right_inner : pattern.left_inner, w / 2);
      if (way.first_at_bottom) std::reverse(ends.begin(), ends.end());
      for (std::size_t k = 0; k < ends.size(); k += 2) {
        constexpr double kHalfCell_mm = 2;
        const Homography picture_from_label{
            {along * mm_x, 0, ends[k].x + along * mm_x * tool.along_mm, 0, -up * mm_y,
             ends[k].y + up * mm_y * (kHalfCell_mm + tool.below_mm), 0, 0, 1}};
        way.places.photo_from_label.push_back(
            vision::Product(*photo_from_picture, picture_from_label));
      }
      ways.push_back(std::move(way));
    }
  }
  return ways;
}

}  // namespace

LabelReading ReadLabels(const BgrView& photo, const ChevronView& view,
                        const std::vector<double>& given_s) {
  const auto count = static_cast<std::size_t>(view.found.count);
  const double spacing_mm = SpacingOf_mm(view);
  // Arms end 21.213 mm from the apexes; the tab begins one bead of the frame above that, the text
  // 1.25 mm above the tab's edge, and the cell's middle is beside the arm's end.
  constexpr double kArmsEnd_mm = 21.213, kTextFrom_mm = 22.98, kHalfCell_mm = 2;
  const double s = 1 / spacing_mm;
  return ReadEither([&](bool mirrored) {
    const double up = mirrored ? -s : s;  // the tab lies at the other side
    LabelPlaces places;
    places.formats = {kEllisFormat, kOrcaFormat};
    for (std::size_t k = 0; k < count; k += 2) {
      const Homography plane_from_label{{0, -s,
                                         static_cast<double>(k) - s * (kArmsEnd_mm - kHalfCell_mm),
                                         -up, 0, -up * kTextFrom_mm, 0, 0, 1}};
      places.photo_from_label.push_back(
          vision::Product(view.found.photo_from_plane, plane_from_label));
    }
    return ReadSequence(photo, {places}, count, given_s);
  });
}

LabelReading ReadLabels(const BgrView& photo, const PhotoLines& lines,
                        const std::vector<double>& given_s) {
  const std::size_t candidates = PlacesOf(lines.line_pattern);
  if (candidates < 4 || WaysOf(lines, false).empty()) {
    LabelReading none;
    none.problem = "the lines' length and distance are of none of the tools that print numbers";
    return none;
  }
  LinePlaces lie;
  LabelReading result = ReadEither([&](bool mirrored) {
    const std::vector<LinePlaces> ways = WaysOf(lines, mirrored);
    std::vector<LabelPlaces> all;
    for (const LinePlaces& way : ways) all.push_back(way.places);
    const SequenceReading reading = ReadSequence(photo, all, candidates, given_s);
    lie = ways[reading.places];
    return reading;
  });
  if (result.pressure_advance_s.empty()) return result;
  const auto [down, right] = SidesOf(lines.corners);
  result.from = lie.first_at_bottom ? down : Opposite(down);
  result.start = lie.at_right ? Opposite(right) : right;
  return result;
}

}  // namespace trammel::pressure_advance
