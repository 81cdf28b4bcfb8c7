#include "pressure_advance/photo/chevron_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/statistics.h"
#include "vision/filament_contrast.h"

namespace trammel::pressure_advance {
namespace {

using vision::GrayImage;
using vision::Homography;

constexpr double kLeft = 6.8;    // spacings of the plane before the first apex
constexpr double kRight = 1.2;   // and behind the last
constexpr double kAround = 6.4;  // on either side of the apexes
constexpr double kMaxSpacing_px = 100;
constexpr double kMinSpacing_px = 24;  // a band of 10 px

// Part of each arm that tells its straight edges, in spacings from the apexes' row: 5 to 14 mm
// along the arm of a pattern with a spacing of 3.6 mm.
constexpr double kStraightBegin = 1.0, kStraightEnd = 2.75;

// Marks the middles of the bands 1, of the spaces between them 0, all other 0.5.
GrayImage Template(const ChevronView& view) {
  constexpr double kBand = 0.1, kSpace = 0.4;  // from the band's middle
  GrayImage filament(view.picture.width, view.picture.height);
  for (int y = 0; y < filament.height; ++y) {
    const double from_apex = std::abs(y - view.apex_y_px) / view.spacing_px;
    for (int x = 0; x < filament.width; ++x) {
      const double place = (x - view.first_x_px) / view.spacing_px + from_apex;
      const double whole = std::clamp(std::round(place), 0.0, view.found.count - 1.0);
      const double away = std::abs(place - whole);
      const bool arm = from_apex > 0.5 && from_apex < kStraightEnd + 1;
      filament.row(y)[x] = arm && away < kBand                  ? 1.0F
                           : arm && away > kSpace && away < 0.6 ? 0.0F
                                                                : 0.5F;
    }
  }
  return filament;
}

// Returns the mean along both arms of a place; nothing if the photo shows less than half of it.
std::optional<double> MeanAt(const ChevronView& view, const GrayImage& image, double place,
                             double from, double to) {
  double sum = 0;
  int count = 0, all = 0;
  for (const double side : {-1.0, 1.0}) {
    for (double t = from; t <= to; t += 0.1) {
      const int y = static_cast<int>(std::lround(view.apex_y_px + side * t * view.spacing_px));
      const int x = static_cast<int>(std::lround(view.first_x_px + (place - t) * view.spacing_px));
      ++all;
      if (x < 0 || y < 0 || x >= image.width || y >= image.height) continue;
      if (!view.Shows(x, y)) continue;
      sum += image.row(y)[x];
      ++count;
    }
  }
  if (2 * count < all) return std::nullopt;
  return sum / count;
}

void RectifyFrom(const BgrView& photo, ChevronView& view) {
  const auto& found = view.found;
  const double width = kLeft + (found.count - 1) + kRight;
  const double middle = (found.count - 1) / 2.0;
  const Homography& h = found.photo_from_plane;
  const double natural = std::max(vision::Distance_px(h({middle, 0}), h({middle + 1, 0})),
                                  vision::Distance_px(h({middle, 0}), h({middle, 1})));
  view.spacing_px = std::clamp(natural, kMinSpacing_px, kMaxSpacing_px);
  const double s = 1 / view.spacing_px;
  const Homography plane_from_picture{{s, 0, -kLeft, 0, s, -kAround, 0, 0, 1}};
  view.photo_from_picture = vision::Product(h, plane_from_picture);
  view.photo_width_px = photo.width;
  view.photo_height_px = photo.height;
  view.picture =
      vision::Rectify(photo, view.photo_from_picture, static_cast<int>(width * view.spacing_px) + 1,
                      static_cast<int>(2 * kAround * view.spacing_px) + 1);
  view.first_x_px = kLeft * view.spacing_px;
  view.apex_y_px = kAround * view.spacing_px;
}

// Levels of plate and filament at one arm of one chevron.
struct Levels {
  double plate = 0;
  double filament = 100;
};

// Row of an arm: `side` -1 above the apexes, 1 below.
int RowOf(const ChevronView& view, int side, double t) {
  return static_cast<int>(std::lround(view.apex_y_px + side * t * view.spacing_px));
}

double ColumnOf(const ChevronView& view, int chevron, double row, double off) {
  const double t = std::abs(row - view.apex_y_px) / view.spacing_px;
  return view.first_x_px + (chevron + off - t) * view.spacing_px;
}

float At(const GrayImage& image, double x, int y) {
  const int at = std::clamp(static_cast<int>(std::floor(x)), 0, image.width - 2);
  const float* row = image.row(std::clamp(y, 0, image.height - 1));
  const auto part = static_cast<float>(std::clamp(x - at, 0.0, 1.0));
  return row[at] + part * (row[at + 1] - row[at]);
}

Levels LevelsOf(const ChevronView& view, const GrayImage& mixed, int chevron, int side) {
  std::vector<double> plate, filament;
  for (double t = kStraightBegin; t < kStraightEnd; t += 0.05) {
    const int y = RowOf(view, side, t);
    for (const double off : {-0.06, 0.0, 0.06}) {
      plate.push_back(At(mixed, ColumnOf(view, chevron, y, -0.5 + off), y));
      plate.push_back(At(mixed, ColumnOf(view, chevron, y, 0.5 + off), y));
      filament.push_back(At(mixed, ColumnOf(view, chevron, y, off), y));
    }
  }
  return {Median(plate), Median(filament)};
}

// Converts the mixed colours to 0 on plate … 1 on filament, by each arm's own levels. Texture on
// either side of the edges saturates; the edges themselves keep their blur.
GrayImage Fill(const ChevronView& view, const GrayImage& mixed) {
  constexpr float kBegin = 0.2F, kEnd = 0.8F;
  const int count = view.found.count;
  std::array<std::vector<Levels>, 2> levels;
  for (int chevron = 0; chevron < count; ++chevron) {
    levels[0].push_back(LevelsOf(view, mixed, chevron, -1));
    levels[1].push_back(LevelsOf(view, mixed, chevron, 1));
  }
  GrayImage fill(mixed.width, mixed.height);
  for (int y = 0; y < fill.height; ++y) {
    const double from_apex = (y - view.apex_y_px) / view.spacing_px;
    for (int x = 0; x < fill.width; ++x) {
      const double place = (x - view.first_x_px) / view.spacing_px + std::abs(from_apex);
      const int k = static_cast<int>(std::clamp(std::round(place), 0.0, count - 1.0));
      // Around the apexes both arms' levels count.
      const double below = std::clamp(0.5 + from_apex / 0.4, 0.0, 1.0);
      const auto mean = [&](double Levels::*level) {
        return (1 - below) * levels[0][k].*level + below * levels[1][k].*level;
      };
      const double plate = mean(&Levels::plate), filament = mean(&Levels::filament);
      const double range = std::max(filament - plate, 1.0);
      const auto share = static_cast<float>((mixed.row(y)[x] - plate) / range);
      fill.row(y)[x] = std::clamp((share - kBegin) / (kEnd - kBegin), 0.0F, 1.0F);
    }
  }
  return fill;
}

// Returns the column where the fill passes one half, from plate (at `from`) to filament.
std::optional<double> HalfCrossing(const GrayImage& fill, int y, double from, double to) {
  const double step = to > from ? 0.5 : -0.5;
  double before = At(fill, from, y);
  if (before >= 0.5) return std::nullopt;
  for (double x = from + step; (to - x) * step > 0; x += step) {
    const double here = At(fill, x, y);
    if (here >= 0.5) return x - step * (here - 0.5) / (here - before);
    before = here;
  }
  return std::nullopt;
}

// Straight line x = c0 + c1 y through the points, robust.
struct Line {
  double c0 = 0, c1 = 0;
  [[nodiscard]] double operator()(double y) const { return c0 + c1 * y; }
};

// Fits by Tukey's biweight. geometry::FitRobustLine, through pairs of points, scatters too much to
// be continued to the apex.
Line FitLine(const std::vector<double>& y, const std::vector<double>& x) {
  constexpr int kRounds = 6;
  constexpr double kMinScatter_px = 0.05, kOutlier = 4;
  Line line;
  std::vector<double> weight(x.size(), 1), off(x.size());
  for (int round = 0; round < kRounds; ++round) {
    double w = 0, sx = 0, sy = 0, sxy = 0, syy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      w += weight[i];
      sx += weight[i] * x[i];
      sy += weight[i] * y[i];
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
      sxy += weight[i] * (x[i] - sx / w) * (y[i] - sy / w);
      syy += weight[i] * (y[i] - sy / w) * (y[i] - sy / w);
    }
    line.c1 = syy > 0 ? sxy / syy : 0;
    line.c0 = (sx - line.c1 * sy) / w;
    for (std::size_t i = 0; i < x.size(); ++i) off[i] = x[i] - line(y[i]);
    const double scatter = std::max(kMinScatter_px, RobustStandardDeviation(off));
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double r = off[i] / (kOutlier * scatter);
      weight[i] = std::abs(r) < 1 ? std::pow(1 - r * r, 2) : 0;
    }
  }
  return line;
}

// Edges of one arm: columns over the rows' distance from the apexes' row (signed, px).
struct Arm {
  Line inner, outer;
  bool seen = false;
};

// Returns the band's edges in the mean section of an arm, in spacings from its middle along x.
std::optional<std::pair<double, double>> MeanEdges(const ChevronView& view, int chevron, int side) {
  constexpr int kHalf = 25;  // places on either side, of 1/50 spacing
  std::array<double, 2 * kHalf + 1> section{};
  const int begin = RowOf(view, side, kStraightBegin), end = RowOf(view, side, kStraightEnd);
  for (int y = begin; side * (end - y) >= 0; y += side) {
    for (int i = -kHalf; i <= kHalf; ++i) {
      section[i + kHalf] += At(view.fill, ColumnOf(view, chevron, y, i / (2.0 * kHalf)), y);
    }
  }
  const double level = (std::abs(end - begin) + 1) / 2.0;
  if (section.front() >= level || section.back() >= level) return std::nullopt;
  const auto from_left =
      std::find_if(section.begin(), section.end(), [&](double value) { return value >= level; });
  if (from_left == section.end()) return std::nullopt;
  const auto from_right =
      std::find_if(section.rbegin(), section.rend(), [&](double value) { return value >= level; });
  const auto place = [&](std::ptrdiff_t index) {
    return static_cast<double>(index - kHalf) / (2.0 * kHalf);
  };
  return std::pair(place(from_left - section.begin()), place(section.rend() - from_right - 1));
}

Arm EdgesOf(const ChevronView& view, int chevron, int side) {
  Arm arm;
  const auto mean = MeanEdges(view, chevron, side);
  if (!mean) return arm;
  std::vector<double> y_inner, inner, y_outer, outer;
  const int begin = RowOf(view, side, kStraightBegin), end = RowOf(view, side, kStraightEnd);
  for (int y = begin; side * (end - y) >= 0; y += side) {
    constexpr double kReach = 0.12;  // spacings: a string or a speck farther off does not matter
    const auto crossing = [&](double edge, double outwards) {
      return HalfCrossing(view.fill, y, ColumnOf(view, chevron, y, edge + outwards * kReach),
                          ColumnOf(view, chevron, y, edge - outwards * kReach));
    };
    if (const auto x = crossing(mean->first, -1)) {
      y_inner.push_back(y - view.apex_y_px);
      inner.push_back(*x);
    }
    if (const auto x = crossing(mean->second, 1)) {
      y_outer.push_back(y - view.apex_y_px);
      outer.push_back(*x);
    }
  }
  const auto rows = static_cast<std::size_t>(std::abs(end - begin) + 1);
  if (2 * inner.size() < rows || 2 * outer.size() < rows) return arm;
  arm.inner = FitLine(y_inner, inner);
  arm.outer = FitLine(y_outer, outer);
  arm.seen = true;
  return arm;
}

// Returns the distance from the apexes' row at which the spaces between the bands end.
std::optional<double> FrameOf(const ChevronView& view) {
  std::vector<double> distances;
  for (int chevron = 0; chevron + 1 < view.found.count; ++chevron) {
    for (const int side : {-1, 1}) {
      const int limit = view.picture.height - 1;
      int begin = 0;  // of the filled stretch that is long enough for a frame
      for (int y = RowOf(view, side, 2.5); y > 0 && y < limit; y += side) {
        const bool filled = At(view.fill, ColumnOf(view, chevron, y, 0.5), y) > 0.5;
        if (!filled) begin = 0;
        if (filled && begin == 0) begin = y;
        constexpr double kFrame = 0.15;
        if (begin != 0 && std::abs(y - begin) > kFrame * view.spacing_px) {
          distances.push_back(std::abs(begin - view.apex_y_px) / view.spacing_px);
          break;
        }
      }
    }
  }
  if (static_cast<int>(distances.size()) < view.found.count) return std::nullopt;
  constexpr double kAlike = 0.2;
  const double middle = Median(distances);
  const auto far = std::count_if(distances.begin(), distances.end(),
                                 [&](double d) { return std::abs(d - middle) > kAlike; });
  if (3 * far > static_cast<std::ptrdiff_t>(distances.size())) return std::nullopt;
  return middle;
}

// Returns the filled length of a row, px.
double SumRow(const ChevronView& view, int chevron, int y) {
  constexpr int kPerPixel = 2;
  const double from = ColumnOf(view, chevron, y, -0.5), to = ColumnOf(view, chevron, y, 0.5);
  const int n = static_cast<int>((to - from) * kPerPixel);
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += At(view.fill, from + (i + 0.5) * (to - from) / n, y);
  return sum * (to - from) / n;
}

}  // namespace

bool ChevronView::Shows(double x_px, double y_px) const {
  const vision::PointPx at = photo_from_picture({x_px, y_px});
  return at.x >= 0 && at.y >= 0 && at.x <= photo_width_px - 1 && at.y <= photo_height_px - 1;
}

ChevronView ViewChevrons(PhotoSearch& photo) {
  ChevronView view;
  const BgrView seen = photo.picture().view();
  constexpr int kSmallest_px = 64;
  if (std::min(seen.width, seen.height) < kSmallest_px) {
    view.problem = fmt::format("the photo has {} x {} px", seen.width, seen.height);
    return view;
  }
  if (const auto found = vision::FindChevrons(seen, photo.Combs())) {
    return ViewChevrons(seen, *found);
  }
  view.problem =
      "no nested corners are seen. All of the pattern must be in the picture, sharp and without "
      "glare";
  return view;
}

namespace {

// Returns how much higher a place is than the places half a spacing beside it; nothing if the photo
// does not show them. A shadow changes all three alike.
std::optional<double> RiseAt(const ChevronView& view, const GrayImage& mixed, double place) {
  const auto band = MeanAt(view, mixed, place, 1, 3);
  const auto before = MeanAt(view, mixed, place - 0.5, 1, 3);
  const auto behind = MeanAt(view, mixed, place + 0.5, 1, 3);
  if (!band || !before || !behind) return std::nullopt;
  return *band - std::max(*before, *behind);
}

// Counts the bands again by their filament: returns the first and the last with filament between
// plate. `found` may hold spaces beyond the pattern, which light and dark alternate with, too.
std::pair<int, int> BandsOf(const ChevronView& view, const GrayImage& mixed) {
  std::vector<double> rises;
  for (int k = 0; k < view.found.count; ++k) rises.push_back(RiseAt(view, mixed, k).value_or(0));
  constexpr double kLeast = 0.3;  // of the usual one: half in a shadow
  const double least = kLeast * Median(rises);
  std::pair<int, int> longest{0, -1};
  constexpr int kBeyond = 3;
  for (int k = -kBeyond, begin = k; k < view.found.count + kBeyond; ++k) {
    if (!(RiseAt(view, mixed, k).value_or(0) > least)) begin = k + 1;
    if (k - begin > longest.second - longest.first) longest = {begin, k};
  }
  return longest;
}

}  // namespace

namespace {

// Moves chevron 0 by `places` and rectifies again.
void Renumber(const BgrView& photo, double places, int count, ChevronView& view) {
  view.found.photo_from_plane =
      vision::Product(view.found.photo_from_plane, Homography{{1, 0, places, 0, 1, 0, 0, 0, 1}});
  view.found.count = count;
  RectifyFrom(photo, view);
}

// Colours mixed so that the bands are higher than the spaces; nothing if both look alike.
std::optional<GrayImage> MixBands(const ChevronView& view) {
  const auto weights = vision::FindContrast(view.picture.view(), Template(view),
                                            static_cast<int>(4 * view.spacing_px) | 1);
  if (!weights) return std::nullopt;
  return vision::Mix(view.picture.view(), *weights);
}

// Returns the level between a band and the space beside it.
std::optional<double> LevelBetween(const ChevronView& view, const GrayImage& mixed, double band,
                                   double space) {
  const auto high = MeanAt(view, mixed, band, 1, 3), low = MeanAt(view, mixed, space, 1, 3);
  if (!high || !low) return std::nullopt;
  return (*high + *low) / 2;
}

// True if plate, wider than between the bands, is seen before the first or behind the last one, and
// filament on neither side.
bool PlateBeyond(const ChevronView& view, const GrayImage& mixed) {
  const int last = view.found.count - 1;
  const auto before = MeanAt(view, mixed, -1.1, 0.3, 2.5);
  const auto behind = MeanAt(view, mixed, last + 1.1, 1.5, 3.5);
  const auto first_level = LevelBetween(view, mixed, 0, 0.5);
  const auto last_level = LevelBetween(view, mixed, last, last - 0.5);
  return (before || behind) && (!before || (first_level && *before < *first_level)) &&
         (!behind || (last_level && *behind < *last_level));
}

// Takes the stripes at whole places for bands, counts them, and separates filament from plate.
// False if these are the spaces between the bands, or not all is seen.
bool SeparateBands(const BgrView& photo, ChevronView& view) {
  auto mixed = MixBands(view);
  if (!mixed) return false;
  const auto [first, last] = BandsOf(view, *mixed);
  constexpr int kFewest = 6;
  if (last - first + 1 < kFewest) return false;
  if (first != 0 || last != view.found.count - 1) {
    Renumber(photo, first, last - first + 1, view);
    mixed = MixBands(view);
    if (!mixed) return false;
  }
  if (!PlateBeyond(view, *mixed)) return false;
  view.fill = Fill(view, *mixed);
  view.frame = FrameOf(view);
  return true;
}

}  // namespace

ChevronView ViewChevrons(const BgrView& photo, const vision::FoundChevrons& found) {
  for (const double shift : {0.0, -0.5}) {
    ChevronView view;
    view.found = found;
    Renumber(photo, shift, found.count + (shift != 0 ? 1 : 0), view);
    if (SeparateBands(photo, view)) return view;
  }
  ChevronView view;
  view.found = found;
  view.photo_width_px = photo.width;
  view.photo_height_px = photo.height;
  view.problem =
      "the pattern is not seen as a whole, or filament and plate look alike. All of it, and no "
      "other one, must be in the picture, sharp and without glare";
  return view;
}

namespace {

// Straight edges of both arms of a chevron, continued to where they meet.
struct IdealBand {
  Arm above, below;

  [[nodiscard]] double RowWidth(double dy) const {
    return std::min(above.outer(dy), below.outer(dy)) - std::min(above.inner(dy), below.inner(dy));
  }
};

// Sums of `rows` neighbouring values, half overlapping.
std::vector<double> WindowSums(const std::vector<double>& values, std::size_t rows) {
  std::vector<double> sums;
  for (std::size_t i = 0; i + rows <= values.size(); i += std::max<std::size_t>(1, rows / 2)) {
    sums.push_back(std::accumulate(values.begin() + i, values.begin() + i + rows, 0.0));
  }
  return sums;
}

// True if the photo shows a corner with the space around it, to the ends of its straight arms.
bool ShowsCorner(const ChevronView& view, int chevron) {
  for (const int side : {-1, 1}) {
    for (const double t : {0.0, kStraightBegin, kStraightEnd}) {
      const int y = RowOf(view, side, t);
      for (const double off : {-0.5, 0.5}) {
        if (!view.Shows(ColumnOf(view, chevron, y, off), y)) return false;
      }
    }
  }
  return true;
}

ChevronReading ReadCorner(const ChevronView& view, int chevron, double half_rows) {
  ChevronReading reading;
  if (!ShowsCorner(view, chevron)) {
    reading.unusable = "the photo does not show all of this corner";
    return reading;
  }
  const IdealBand band{EdgesOf(view, chevron, -1), EdgesOf(view, chevron, 1)};
  if (!band.above.seen || !band.below.seen) {
    reading.unusable = "an arm's edges are not seen";
    return reading;
  }
  const auto surplus = [&](int y) {
    return SumRow(view, chevron, y) - band.RowWidth(y - view.apex_y_px);
  };
  // The straight arms calibrate the sum of a row, and show its scatter.
  std::vector<double> straight;
  std::array<double, 2> arm_widths{};
  for (const int side : {-1, 1}) {
    const int begin = RowOf(view, side, kStraightBegin), end = RowOf(view, side, kStraightEnd);
    for (int y = begin; side * (end - y) >= 0; y += side) straight.push_back(surplus(y));
    arm_widths[side > 0] = band.RowWidth((begin + end) / 2.0 - view.apex_y_px);
  }
  const double offset = Median(straight);
  for (double& value : straight) value -= offset;
  const int begin = static_cast<int>(std::ceil(view.apex_y_px - half_rows));
  const int end = static_cast<int>(std::floor(view.apex_y_px + half_rows));
  double sum = 0;
  for (int y = begin; y <= end; ++y) sum += surplus(y) - offset;
  // A row's length is the band's width times sqrt 2, and an area over the width is a length.
  const double unit = Mean(arm_widths) / std::numbers::sqrt2 * view.spacing_px;
  const auto rows = static_cast<std::size_t>(end - begin + 1);
  // Half of the window, as each arm is little longer than one; two halves scatter independently.
  const std::vector<double> windows = WindowSums(straight, std::max<std::size_t>(1, rows / 2));
  reading.surplus = sum / unit;
  reading.wider = arm_widths[1] / arm_widths[0] - 1;
  reading.sigma = std::max(1e-3, StandardDeviation(windows) * std::numbers::sqrt2 / unit);
  return reading;
}

}  // namespace

std::vector<ChevronReading> ReadChevrons(const ChevronView& view, double half_window) {
  constexpr double kLeast = 0.1, kMost = 1.7;  // spacings: the window ends where the arms begin
  const double half_rows =
      std::clamp(half_window, kLeast, kMost) / std::numbers::sqrt2 * view.spacing_px;
  std::vector<ChevronReading> readings;
  for (int chevron = 0; chevron < view.found.count; ++chevron) {
    readings.push_back(ReadCorner(view, chevron, half_rows));
  }
  return readings;
}

double SpacingOf_mm(const ChevronView& view) {
  // Three or four loops of 0.56 mm inside of +-21.213 mm: 19.9 and 19.4 mm remain.
  constexpr double kFrameInside_mm = 19.65, kUsual_mm = 3.601;
  return view.frame ? kFrameInside_mm / *view.frame : kUsual_mm;
}

PhotoView PictureOf(const ChevronView& view, const std::vector<double>& pressure_advance_s) {
  const Frame& from = view.picture;
  PhotoView result;
  // Turned by a right angle against the clock: (x, y) becomes (y, width - 1 - x).
  result.rectified = Frame(from.height, from.width);
  for (int y = 0; y < from.height; ++y) {
    const std::uint8_t* source = from.view().row(y);
    for (int x = 0; x < from.width; ++x) {
      std::copy_n(source + std::ptrdiff_t{3} * x, 3,
                  result.rectified.row(from.width - 1 - x) + std::ptrdiff_t{3} * y);
    }
  }
  for (int chevron = 0; chevron < view.found.count; ++chevron) {
    TracedLine& line = result.lines.emplace_back();
    line.pressure_advance_s = pressure_advance_s[chevron];
    constexpr double kTraced = 4.2;
    const int end = RowOf(view, 1, kTraced);
    for (int y = RowOf(view, -1, kTraced); y <= end; y += 2) {
      const double middle = ColumnOf(view, chevron, y, 0), reach = view.spacing_px / 2;
      const auto inner = HalfCrossing(view.fill, y, middle - reach, middle + reach);
      const auto outer = HalfCrossing(view.fill, y, middle + reach, middle - reach);
      if (!inner || !outer) continue;
      line.x_px.push_back(y);
      line.centre_px.push_back(from.width - 1 - (*inner + *outer) / 2);
      line.width_px.push_back(std::max(0.0, *outer - *inner));
    }
  }
  return result;
}

}  // namespace trammel::pressure_advance
