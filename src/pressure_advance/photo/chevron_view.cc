#include "pressure_advance/photo/chevron_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
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

Levels LevelsOf(const ChevronView& view, const GrayImage& mixed, int chevron, int side) {
  std::vector<double> plate, filament;
  for (double t = kStraightBegin; t < kStraightEnd; t += 0.05) {
    const int y = view.RowOf(side, t);
    for (const double off : {-0.06, 0.0, 0.06}) {
      plate.push_back(ValueAt(mixed, view.ColumnOf(chevron, y, -0.5 + off), y));
      plate.push_back(ValueAt(mixed, view.ColumnOf(chevron, y, 0.5 + off), y));
      filament.push_back(ValueAt(mixed, view.ColumnOf(chevron, y, off), y));
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

// Returns the distance from the apexes' row at which the spaces between the bands end.
std::optional<double> FrameOf(const ChevronView& view) {
  std::vector<double> distances;
  for (int chevron = 0; chevron + 1 < view.found.count; ++chevron) {
    for (const int side : {-1, 1}) {
      const int limit = view.picture.height - 1;
      int begin = 0;  // of the filled stretch that is long enough for a frame
      for (int y = view.RowOf(side, 2.5); y > 0 && y < limit; y += side) {
        const bool filled = ValueAt(view.fill, view.ColumnOf(chevron, y, 0.5), y) > 0.5;
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

}  // namespace

float ValueAt(const vision::GrayImage& image, double x, int y) {
  const int at = std::clamp(static_cast<int>(std::floor(x)), 0, image.width - 2);
  const float* row = image.row(std::clamp(y, 0, image.height - 1));
  const auto part = static_cast<float>(std::clamp(x - at, 0.0, 1.0));
  return row[at] + part * (row[at + 1] - row[at]);
}

bool ChevronView::Shows(double x_px, double y_px) const {
  const vision::PointPx at = photo_from_picture({x_px, y_px});
  return at.x >= 0 && at.y >= 0 && at.x <= photo_width_px - 1 && at.y <= photo_height_px - 1;
}

int ChevronView::RowOf(int side, double distance) const {
  return static_cast<int>(std::lround(apex_y_px + side * distance * spacing_px));
}

double ChevronView::ColumnOf(int chevron, double row, double off) const {
  const double distance = std::abs(row - apex_y_px) / spacing_px;
  return first_x_px + (chevron + off - distance) * spacing_px;
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

double SpacingOf_mm(const ChevronView& view) {
  // Three or four loops of 0.56 mm inside of +-21.213 mm: 19.9 and 19.4 mm remain.
  constexpr double kFrameInside_mm = 19.65, kUsual_mm = 3.601;
  return view.frame ? kFrameInside_mm / *view.frame : kUsual_mm;
}

}  // namespace trammel::pressure_advance
