#include "vision/comb_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <utility>

#include "base/statistics.h"
#include "vision/comb_strokes.h"
#include "vision/filament_contrast.h"
#include "vision/image.h"

namespace trammel::vision {
namespace {

constexpr int kLongestSearched_px = 1000;  // of the shrunk picture that is searched
constexpr std::size_t kFewestStrokes = 5;

// Parameters of one search in the picture.
struct Look {
  double smooth_px = 1;  // sigma before comparing with the surroundings
  double window = 0.1;   // of the longest side: extent of the surroundings
};

// Returns the directions of most edges, strongest first; rad from +x towards +y, [0, pi).
std::vector<double> EdgeDirections(const cv::Mat& channel) {
  cv::Mat smooth, dx, dy;
  channel.convertTo(smooth, CV_32F);
  cv::GaussianBlur(smooth, smooth, {}, 2.0);
  cv::Sobel(smooth, dx, CV_32F, 1, 0);
  cv::Sobel(smooth, dy, CV_32F, 0, 1);
  constexpr int kBins = 180;
  std::array<double, kBins> bins{};
  for (int y = 0; y < dx.rows; ++y) {
    for (int x = 0; x < dx.cols; ++x) {
      const float gx = dx.at<float>(y, x), gy = dy.at<float>(y, x);
      const double along = std::atan2(gx, -gy) / std::numbers::pi;  // across the gradient
      const int bin = static_cast<int>(std::floor((along - std::floor(along)) * kBins)) % kBins;
      bins[static_cast<std::size_t>(bin)] += std::sqrt(gx * gx + gy * gy);
    }
  }
  std::array<double, kBins> sums{};
  constexpr int kHalf = 3;  // perspective fans parallel lines out over a few degrees
  for (int i = 0; i < kBins; ++i) {
    for (int k = -kHalf; k <= kHalf; ++k) sums[i] += bins[(i + k + kBins) % kBins];
  }
  constexpr std::size_t kMaxDirections = 4;
  constexpr int kApart = 12;
  std::vector<double> directions;
  while (directions.size() < kMaxDirections) {
    const auto top = std::max_element(sums.begin(), sums.end());
    if (!(*top > 0)) break;
    const int at = static_cast<int>(top - sums.begin());
    directions.push_back((at + 0.5) * std::numbers::pi / kBins);
    for (int k = -kApart; k <= kApart; ++k) sums[(at + k + kBins) % kBins] = 0;
  }
  return directions;
}

// Picture rotated so that a direction runs along the rows.
struct TurnedGrid {
  cv::Size size;
  cv::Mat seen;
  cv::Matx23d from_turned;  // picture px of turned px
};

TurnedGrid GridAlong(const cv::Size& picture, double direction_rad) {
  const double c = std::cos(direction_rad), s = std::sin(direction_rad);
  const double w = picture.width, h = picture.height;
  TurnedGrid grid;
  grid.size = {static_cast<int>(std::abs(w * c) + std::abs(h * s)) + 1,
               static_cast<int>(std::abs(w * s) + std::abs(h * c)) + 1};
  const double x0 = (grid.size.width - 1) / 2.0, y0 = (grid.size.height - 1) / 2.0;
  grid.from_turned = {c, -s, (w - 1) / 2 - c * x0 + s * y0, s, c, (h - 1) / 2 - s * x0 - c * y0};
  cv::warpAffine(cv::Mat(picture, CV_8U, cv::Scalar(255)), grid.seen, grid.from_turned, grid.size,
                 cv::INTER_NEAREST | cv::WARP_INVERSE_MAP);
  return grid;
}

// Strokes on whole places of a pencil.
struct Family {
  LinePencil pencil;
  std::map<int, double> strength;  // length seen times contrast, by place
  double left_px = 0, right_px = 0;
  double irregularity = 0;  // rms deviation from whole places
  double weight = 0;        // lengths times contrast, less where irregular
};

// Noise near whole places by chance scatters uniformly within the tolerance of 0.2: by 0.115.
constexpr double kOffPencil = 0.2;
constexpr double kNoiseIrregularity = 0.115;

using Places = std::map<std::size_t, int>;  // by stroke index

double YNear(const Stroke& stroke, double x) {
  const auto after = std::lower_bound(stroke.points.begin(), stroke.points.end(), x,
                                      [](const PointPx& p, double at) { return p.x < at; });
  return after == stroke.points.end() ? stroke.points.back().y : after->y;
}

// Returns the strokes that cross a column, by y.
std::vector<std::pair<double, std::size_t>> Crossing(const std::vector<Stroke>& strokes, double x) {
  std::vector<std::pair<double, std::size_t>> crossing;
  for (std::size_t i = 0; i < strokes.size(); ++i) {
    const std::vector<PointPx>& p = strokes[i].points;
    if (p.front().x <= x && x <= p.back().x) crossing.emplace_back(YNear(strokes[i], x), i);
  }
  std::sort(crossing.begin(), crossing.end());
  return crossing;
}

// Follows the strokes from two neighbours on, upwards and downwards, in steps that change slowly.
Places Walk(const std::vector<std::pair<double, std::size_t>>& crossing, std::size_t start) {
  constexpr double kOff = 0.22;  // relative to a step
  constexpr int kMaxEmpty = 3;
  Places places{{crossing[start].second, 0}, {crossing[start + 1].second, 1}};
  const double first_step = crossing[start + 1].first - crossing[start].first;
  for (const int direction : {1, -1}) {
    double step = first_step;
    std::size_t at = direction > 0 ? start + 1 : start;
    int place = direction > 0 ? 1 : 0;
    double y = crossing[at].first;
    for (std::size_t next = at + 1; direction > 0 ? next < crossing.size() : at > 0;) {
      const std::size_t i = direction > 0 ? next++ : --at;
      const double steps = std::abs(crossing[i].first - y) / step;
      const double whole = std::max(1.0, std::round(steps));
      if (whole > kMaxEmpty) break;
      if (std::abs(steps - whole) > kOff) continue;
      place += direction * static_cast<int>(whole);
      places[crossing[i].second] = place;
      step = 0.6 * step + 0.4 * std::abs(crossing[i].first - y) / whole;
      y = crossing[i].first;
    }
  }
  return places;
}

std::vector<PencilPoint> PointsOf(const std::vector<Stroke>& strokes, const Places& places) {
  std::vector<PencilPoint> points;
  for (const auto& [index, place] : places) {
    const std::vector<PointPx>& p = strokes[index].points;
    constexpr std::size_t kPerStroke = 8;
    const std::size_t step = std::max<std::size_t>(1, p.size() / kPerStroke);
    for (std::size_t i = 0; i < p.size(); i += step) points.push_back({p[i], double(place)});
  }
  return points;
}

// Returns all strokes on whole places of a pencil, wherever they are.
Places OnPencil(const std::vector<Stroke>& strokes, const LinePencil& pencil) {
  Places places;
  for (std::size_t i = 0; i < strokes.size(); ++i) {
    const std::vector<PointPx>& p = strokes[i].points;
    const double place = std::round(pencil.PlaceOf(p[p.size() / 2]));
    if (!(std::abs(place) < 1000)) continue;
    const bool on = std::all_of(p.begin(), p.end(), [&](const PointPx& point) {
      return std::abs(pencil.PlaceOf(point) - place) < kOffPencil;
    });
    if (on) places[i] = static_cast<int>(place);
  }
  return places;
}

// Columns, from and to.
using Stretch = std::pair<double, double>;

// Returns the longest range of columns in which most of the visible places have a stroke: the
// plate's edge, a shadow or stripes in the surroundings put strokes on some places only.
std::optional<Stretch> CoveredColumns(const std::vector<Stroke>& strokes, const Places& places,
                                      const LinePencil& pencil, const cv::Mat& seen) {
  constexpr int kColumns = 180;
  constexpr double kMinShare = 0.5;
  int first = places.begin()->second, last = first;
  for (const auto& [index, place] : places) {
    first = std::min(first, place);
    last = std::max(last, place);
  }
  const auto x_of = [&](int column) { return (column + 0.5) * seen.cols / kColumns; };
  std::vector<Stretch> stretches;
  bool before = false;
  for (int column = 0; column < kColumns; ++column) {
    const double x = x_of(column);
    int shown = 0;
    for (int place = first; place <= last; ++place) {
      const double y = pencil.Y_px(place, x);
      shown += y >= 0 && y <= seen.rows - 1 &&
               seen.at<std::uint8_t>(static_cast<int>(y), static_cast<int>(x)) != 0;
    }
    std::set<int> covered;
    for (const auto& [index, place] : places) {
      const std::vector<PointPx>& p = strokes[index].points;
      if (p.front().x <= x && x <= p.back().x) covered.insert(place);
    }
    const bool most = shown > 0 && static_cast<double>(covered.size()) >= kMinShare * shown;
    if (most && !before) stretches.emplace_back(x, x);
    if (most) stretches.back().second = x;
    before = most;
  }
  // Most lines may be broken at one place, where they change speed.
  constexpr double kBreak = 0.15;
  for (std::size_t i = 0; i + 1 < stretches.size();) {
    const double whole = stretches[i + 1].second - stretches[i].first;
    if (stretches[i + 1].first - stretches[i].second > kBreak * whole) {
      ++i;
      continue;
    }
    stretches[i].second = stretches[i + 1].second;
    stretches.erase(stretches.begin() + static_cast<std::ptrdiff_t>(i) + 1);
  }
  const auto longest = std::max_element(
      stretches.begin(), stretches.end(),
      [](const Stretch& a, const Stretch& b) { return a.second - a.first < b.second - b.first; });
  if (longest == stretches.end()) return std::nullopt;
  return *longest;
}

// Drops outer places with weak strokes relative to the rest: the plate's texture.
void DropWeakEnds(std::map<int, double>& strength) {
  std::vector<double> strengths;
  for (const auto& [place, of_place] : strength) strengths.push_back(of_place);
  const double usual = Quantile(strengths, 0.6);
  constexpr double kMinStrength = 0.2;
  const auto too_weak = [&](const auto& entry) { return entry->second < kMinStrength * usual; };
  while (!strength.empty() && too_weak(strength.begin())) strength.erase(strength.begin());
  while (!strength.empty() && too_weak(std::prev(strength.end()))) {
    strength.erase(std::prev(strength.end()));
  }
}

std::optional<Family> Describe(const std::vector<Stroke>& strokes, const Places& places,
                               const LinePencil& pencil, const cv::Mat& seen) {
  const std::optional<Stretch> covered = CoveredColumns(strokes, places, pencil, seen);
  if (!covered) return std::nullopt;
  Family family;
  family.pencil = pencil;
  family.left_px = covered->first;
  family.right_px = covered->second;
  double squares = 0;
  std::size_t points = 0;
  for (const auto& [index, place] : places) {
    const Stroke& stroke = strokes[index];
    const double length_px = std::min(stroke.points.back().x, family.right_px) -
                             std::max(stroke.points.front().x, family.left_px);
    if (!(length_px > 0)) continue;
    family.strength[place] += length_px * stroke.height;
    family.weight += length_px * stroke.height * stroke.height;
    points += stroke.points.size();
    for (const PointPx& point : stroke.points) {
      squares += std::pow(pencil.PlaceOf(point) - place, 2);
    }
  }
  if (points == 0) return std::nullopt;
  DropWeakEnds(family.strength);
  family.irregularity = std::sqrt(squares / static_cast<double>(points));
  family.weight *= std::max(0.0, 1 - family.irregularity / kNoiseIrregularity);
  return family;
}

std::optional<Family> Grow(const std::vector<Stroke>& strokes, Places places, const cv::Mat& seen) {
  std::optional<LinePencil> pencil;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    if (places.size() < kFewestStrokes) return std::nullopt;
    pencil = FitPencil(PointsOf(strokes, places));
    if (!pencil) return std::nullopt;
    places = OnPencil(strokes, *pencil);
  }
  if (places.empty()) return std::nullopt;
  std::optional<Family> family = Describe(strokes, places, *pencil, seen);
  constexpr double kMaxIrregular = 0.7 * kNoiseIrregularity;
  if (!family || family->strength.size() < kFewestStrokes || family->irregularity > kMaxIrregular) {
    return std::nullopt;
  }
  return family;
}

std::optional<Family> LargestFamily(const std::vector<Stroke>& strokes, const cv::Mat& seen) {
  std::optional<Family> best;
  for (const double share : {0.5, 0.35, 0.65, 0.25, 0.75}) {
    const auto crossing = Crossing(strokes, share * seen.cols);
    std::optional<Places> most;
    for (std::size_t start = 0; start + 1 < crossing.size(); ++start) {
      Places places = Walk(crossing, start);
      if (!most || places.size() > most->size()) most = std::move(places);
    }
    if (!most) continue;
    std::optional<Family> family = Grow(strokes, *most, seen);
    if (family && (!best || family->weight > best->weight)) best = std::move(family);
  }
  return best;
}

// Returns the intersection of a side of the family with the line of a place. Sides point towards
// the vanishing point of the perpendicular to the strokes at the family's middle, as far as the
// picture determines it.
std::optional<PointPx> OnSide(const Family& family, double x_side, double place) {
  const double first = family.strength.begin()->first, last = family.strength.rbegin()->first;
  const std::array<double, 3>& horizon = family.pencil.step;
  const double x_middle = (family.left_px + family.right_px) / 2;
  const double half = (family.right_px - family.left_px) / 2;
  const auto middle = [&](double x) { return family.pencil.Y_px((first + last) / 2, x); };
  const double y_middle = middle(x_middle), y_side = middle(x_side);
  const double slope = (middle(x_middle + half) - middle(x_middle - half)) / (2 * half);
  // Point on the horizon, at middle + t (-slope, 1); homogeneous, as it may be at infinity.
  const double towards = horizon[1] - slope * horizon[0];
  const double at = horizon[0] * x_middle + horizon[1] * y_middle + horizon[2];
  const double vx = x_middle * towards + slope * at, vy = y_middle * towards - at;
  // Line through the side's point (x_side, y_side, 1) and (vx, vy, towards).
  const double a = y_side * towards - vy, b = vx - x_side * towards, c = x_side * vy - y_side * vx;
  std::array<double, 3> line{};
  for (std::size_t i = 0; i < 3; ++i) line[i] = family.pencil.first[i] + place * horizon[i];
  const double w = a * line[1] - b * line[0];
  const PointPx point{(b * line[2] - c * line[1]) / w, (c * line[0] - a * line[2]) / w};
  if (!std::isfinite(point.x) || !std::isfinite(point.y)) return std::nullopt;
  return point;
}

// Returns the pencil after x_old = m (x_new, y_new, 1), with place 0 moved to `place`.
LinePencil Transformed(const LinePencil& pencil, const cv::Matx23d& m, double place) {
  const auto moved = [&m](const std::array<double, 3>& line) {
    return std::array<double, 3>{line[0] * m(0, 0) + line[1] * m(1, 0),
                                 line[0] * m(0, 1) + line[1] * m(1, 1),
                                 line[0] * m(0, 2) + line[1] * m(1, 2) + line[2]};
  };
  LinePencil result{moved(pencil.first), moved(pencil.step)};
  for (std::size_t i = 0; i < 3; ++i) result.first[i] += place * result.step[i];
  return result;
}

std::optional<FoundComb> ToComb(const Family& family, const TurnedGrid& turned) {
  const int first = family.strength.begin()->first, last = family.strength.rbegin()->first;
  const double reach = kBesideComb * (family.right_px - family.left_px);
  const double left = family.left_px - reach, right = family.right_px + reach;
  const double top = first - kAroundComb, bottom = last + kAroundComb;
  if (!family.pencil.Sees(top, bottom, left, right)) return std::nullopt;
  FoundComb comb;
  comb.places = last - first + 1;
  comb.weight = family.weight;
  cv::Matx23d to_turned;
  cv::invertAffineTransform(turned.from_turned, to_turned);
  comb.pencil = Transformed(family.pencil, to_turned, first);
  const std::array<std::pair<double, double>, 4> sides{
      {{left, top}, {right, top}, {right, bottom}, {left, bottom}}};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::optional<PointPx> point = OnSide(family, sides[i].first, sides[i].second);
    if (!point) return std::nullopt;
    const cv::Matx23d& m = turned.from_turned;
    comb.corners[i] = {m(0, 0) * point->x + m(0, 1) * point->y + m(0, 2),
                       m(1, 0) * point->x + m(1, 1) * point->y + m(1, 2)};
  }
  if (!IsConvex(comb.corners)) return std::nullopt;
  return comb;
}

double Apart_px(const Quad& a, const Quad& b) {
  double apart = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    apart = std::max(apart, std::min(Distance_px(a[i], b[i]), Distance_px(a[i], b[(i + 2) % 4])));
  }
  return apart;
}

// Adds a comb unless a clearer one was found in the same place; the clearest first.
void KeepBest(std::vector<FoundComb>& found, FoundComb comb) {
  constexpr double kSame = 0.25;  // relative to a place
  const double place_px =
      Distance_px(comb.corners[1], comb.corners[2]) / (comb.places - 1 + 2 * kAroundComb);
  for (FoundComb& other : found) {
    if (other.places != comb.places) continue;
    if (Apart_px(other.corners, comb.corners) > kSame * place_px * comb.places) continue;
    const double middle =
        std::hypot(
            other.corners[0].x + other.corners[2].x - comb.corners[0].x - comb.corners[2].x,
            other.corners[0].y + other.corners[2].y - comb.corners[0].y - comb.corners[2].y) /
        2;
    if (middle > kSame * place_px) continue;  // the spaces between the strokes, perhaps
    if (comb.weight > other.weight) other = comb;
    comb.places = 0;
    break;
  }
  if (comb.places > 0) found.push_back(comb);
  std::stable_sort(found.begin(), found.end(),
                   [](const FoundComb& a, const FoundComb& b) { return a.weight > b.weight; });
  if (found.size() > kMostCombs) found.resize(kMostCombs);
}

}  // namespace

std::vector<FoundComb> FindCombs(const BgrView& photo) {
  TRAMMEL_CHECK(photo.width >= 16 && photo.height >= 16, "{} x {}", photo.width, photo.height);
  double scale = 1;
  Frame small = ShrinkToFit(photo, kLongestSearched_px, 1e18, scale);
  const cv::Mat bgr(small.height, small.width, CV_8UC3, small.bgr.data());
  const int longest = std::max(small.width, small.height);
  std::vector<FoundComb> found;
  for (const cv::Mat& channel : ColourChannels(bgr)) {
    std::vector<TurnedGrid> grids;
    for (const double direction : EdgeDirections(channel)) {
      grids.push_back(GridAlong(channel.size(), direction));
    }
    for (const Look& look : {Look{1.0, 0.12}, Look{1.0, 0.06}, Look{2.0, 0.25}}) {
      const int window = static_cast<int>(look.window * longest) | 1;
      const cv::Mat contrast = LocalContrast(channel, look.smooth_px, window);
      for (const TurnedGrid& grid : grids) {
        cv::Mat turned;
        cv::warpAffine(contrast, turned, grid.from_turned, grid.size,
                       cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
        const Strips strips = AverageStrips(turned, grid.seen);
        for (const bool lighter : {true, false}) {
          const std::vector<Stroke> strokes = TraceStrokes(strips, lighter);
          const auto family = LargestFamily(strokes, grid.seen);
          if (!family) continue;
          std::optional<FoundComb> comb = ToComb(*family, grid);
          if (!comb) continue;
          if (found.size() == kMostCombs && comb->weight < found.back().weight) continue;
          KeepBest(found, *comb);
        }
      }
    }
  }
  // Pixel centres have whole coordinates, so that scaling is about (-0.5, -0.5).
  const double shift = (scale - 1) / 2;
  for (FoundComb& comb : found) {
    comb.pencil = Transformed(comb.pencil, {scale, 0, shift, 0, scale, shift}, 0);
    for (PointPx& p : comb.corners) p = {(p.x + 0.5) / scale - 0.5, (p.y + 0.5) / scale - 0.5};
  }
  return found;
}

}  // namespace trammel::vision
