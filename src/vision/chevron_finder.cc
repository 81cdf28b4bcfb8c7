#include "vision/chevron_finder.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "vision/comb_finder.h"
#include "vision/filament_contrast.h"

namespace trammel::vision {
namespace {

constexpr int kLongestSearched_px = 1600;
constexpr int kUnit_px = 20;                 // of the rectified picture, per spacing
constexpr int kRoughUnit_px = kUnit_px / 2;  // of pairs of combs that are compared
constexpr int kFewestChevrons = 6;
constexpr int kLargestExtent = 60;  // spacings

cv::Matx33d Matrix(const Homography& homography) { return cv::Matx33d(homography.m.data()); }

Homography FromMatrix(const cv::Matx33d& matrix) {
  Homography result;
  std::copy(matrix.val, matrix.val + 9, result.m.begin());
  return result;
}

cv::Vec3d Vector(const std::array<double, 3>& line) { return {line[0], line[1], line[2]}; }

PointPx Middle(const Quad& quad) {
  return {(quad[0].x + quad[1].x + quad[2].x + quad[3].x) / 4,
          (quad[0].y + quad[1].y + quad[2].y + quad[3].y) / 4};
}

// Returns the direction of a comb's strokes, rad modulo pi.
double Direction(const FoundComb& comb) {
  return std::atan2(comb.corners[1].y - comb.corners[0].y, comb.corners[1].x - comb.corners[0].x);
}

double Spacing_px(const FoundComb& comb) {
  return Distance_px(comb.corners[1], comb.corners[2]) / (comb.places - 1 + 2 * kAroundComb);
}

// True if two combs may be the two arms of chevrons, seen at a slant.
bool MayMeet(const FoundComb& a, const FoundComb& b) {
  constexpr double kMinCross = 0.7;  // sine of the angle: 45 degrees off are too many
  constexpr double kMaxRatio = 1.8;
  const double ratio = Spacing_px(a) / Spacing_px(b);
  return std::abs(std::sin(Direction(a) - Direction(b))) > kMinCross && ratio < kMaxRatio &&
         ratio > 1 / kMaxRatio;
}

// Returns the plane's coordinates in which a stripe of a is x + y = k and one of b x - y = k.
// Both pencils have the plane's horizon; its mean counts.
std::optional<cv::Matx33d> PlaneFromPhoto(const FoundComb& a, const FoundComb& b) {
  const PointPx pa = Middle(a.corners), pb = Middle(b.corners);
  const cv::Vec3d middle{(pa.x + pb.x) / 2, (pa.y + pb.y) / 2, 1};
  const cv::Vec3d sa = Vector(a.pencil.step), sb = Vector(b.pencil.step);
  const double wa = sa.dot(middle), wb = sb.dot(middle);
  if (wa == 0 || wb == 0) return std::nullopt;
  const cv::Vec3d u = -Vector(a.pencil.first) / wa, v = -Vector(b.pencil.first) / wb;
  const cv::Vec3d x = (u + v) / 2, y = (u - v) / 2, h = (sa / wa + sb / wb) / 2;
  return cv::Matx33d(x[0], x[1], x[2], y[0], y[1], y[2], h[0], h[1], h[2]);
}

// Part of the plane, rectified.
struct Patch {
  int unit_px = 0;
  cv::Matx33d photo_from_patch;
  std::vector<cv::Mat> contrasts;  // one per colour channel; float
};

int Reach_px(int unit_px) { return static_cast<int>(kChevronReach * unit_px); }

std::optional<Patch> RectifyAround(const cv::Mat& photo, const cv::Matx33d& plane_from_photo,
                                   const FoundComb& a, const FoundComb& b, int unit_px) {
  double x0 = 1e9, x1 = -1e9, y0 = 1e9, y1 = -1e9;
  for (const FoundComb* comb : {&a, &b}) {
    for (const PointPx& corner : comb->corners) {
      const double px = std::clamp<double>(corner.x, 0, photo.cols - 1);
      const double py = std::clamp<double>(corner.y, 0, photo.rows - 1);
      const cv::Vec3d at = plane_from_photo * cv::Vec3d(px, py, 1);
      if (!(at[2] > 1e-9)) return std::nullopt;  // the horizon
      x0 = std::min(x0, at[0] / at[2]);
      x1 = std::max(x1, at[0] / at[2]);
      y0 = std::min(y0, at[1] / at[2]);
      y1 = std::max(y1, at[1] / at[2]);
    }
  }
  if (x1 - x0 > kLargestExtent || y1 - y0 > kLargestExtent) return std::nullopt;
  const cv::Size size(static_cast<int>((x1 - x0) * unit_px) + 1,
                      static_cast<int>((y1 - y0) * unit_px) + 1);
  const cv::Matx33d plane_from_patch(1.0 / unit_px, 0, x0, 0, 1.0 / unit_px, y0, 0, 0, 1);
  if (std::max(size.width, size.height) <= 2 * Reach_px(unit_px)) return std::nullopt;
  Patch patch;
  patch.unit_px = unit_px;
  patch.photo_from_patch = plane_from_photo.inv() * plane_from_patch;
  cv::Mat rectified;
  cv::warpPerspective(photo, rectified, patch.photo_from_patch, size,
                      cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  for (const cv::Mat& channel : ColourChannels(rectified)) {
    patch.contrasts.push_back(LocalContrast(channel, 1.0, 6 * unit_px + 1));
  }
  return patch;
}

// Row of a patch in which the stripes of both arms meet.
struct Meeting {
  double score = 0;
  double y_px = 0;
  double x_px = 0;    // an apex, modulo the spacing
  bool right = true;  // they point to +x
};

using Amplitudes = std::vector<std::complex<double>>;

// Wave of one spacing, for whole pixels.
Amplitudes Wave(int unit_px) {
  Amplitudes wave;
  for (int i = 0; i < unit_px; ++i) {
    wave.push_back(std::polar(1.0, -2 * std::numbers::pi * i / unit_px));
  }
  return wave;
}

float Bounded(float contrast) { return std::clamp(contrast, -2.0F, 2.0F); }

// Returns each row's amplitude of the wave.
Amplitudes AmplitudesOfRows(const cv::Mat& contrast, int unit_px) {
  const auto wave = Wave(unit_px);
  Amplitudes amplitudes(static_cast<std::size_t>(contrast.rows));
  for (int y = 0; y < contrast.rows; ++y) {
    const float* value = contrast.ptr<float>(y);
    std::array<double, kUnit_px> sums{};  // of equal phase
    int x = 0;
    for (; x + unit_px <= contrast.cols; x += unit_px) {
      for (int i = 0; i < unit_px; ++i) sums[i] += Bounded(value[x + i]);
    }
    for (int i = 0; x + i < contrast.cols; ++i) sums[i] += Bounded(value[x + i]);
    for (int i = 0; i < unit_px; ++i) amplitudes[y] += sums[i] * wave[i];
  }
  return amplitudes;
}

// Returns each column's amplitude of the wave.
Amplitudes AmplitudesOfColumns(const cv::Mat& contrast, int unit_px) {
  const auto wave = Wave(unit_px);
  std::vector<double> real(static_cast<std::size_t>(contrast.cols)), imaginary = real;
  for (int y = 0; y < contrast.rows; ++y) {
    const float* value = contrast.ptr<float>(y);
    const double c = wave[y % unit_px].real(), s = wave[y % unit_px].imag();
    for (int x = 0; x < contrast.cols; ++x) {
      const double bounded = Bounded(value[x]);
      real[x] += bounded * c;
      imaginary[x] += bounded * s;
    }
  }
  Amplitudes amplitudes;
  for (int x = 0; x < contrast.cols; ++x) amplitudes.emplace_back(real[x], imaginary[x]);
  return amplitudes;
}

// Compares each row's phase with that of chevrons around it: sums over the rows on either side,
// turned by a phase that grows with the distance, are differences of running sums.
Meeting FindMeeting(const Amplitudes& amplitudes, int unit_px) {
  const auto wave = Wave(unit_px);
  const int rows = static_cast<int>(amplitudes.size()), reach_px = Reach_px(unit_px);
  Amplitudes with{0}, against{0};  // running sums of amplitudes times the wave, and its conjugate
  for (int y = 0; y < rows; ++y) {
    with.push_back(with.back() + amplitudes[y] * wave[y % unit_px]);
    against.push_back(against.back() + amplitudes[y] * std::conj(wave[y % unit_px]));
  }
  Meeting best;
  for (const bool right : {true, false}) {
    const Amplitudes &below = right ? with : against, &above = right ? against : with;
    for (int y0 = reach_px; y0 + reach_px < rows; ++y0) {
      const std::complex<double> turn = right ? wave[y0 % unit_px] : std::conj(wave[y0 % unit_px]);
      const std::complex<double> sum = std::conj(turn) * (below[y0 + reach_px + 1] - below[y0]) +
                                       turn * (above[y0] - above[y0 - reach_px]);
      if (std::abs(sum) <= best.score) continue;
      const double x = -std::arg(sum) / (2 * std::numbers::pi) * unit_px;
      best = {std::abs(sum), double(y0), x, right};
    }
  }
  best.score /= (2.0 * reach_px + 1) * unit_px;
  return best;
}

// Chevrons of one patch, all turned to point to +x.
struct Turned {
  double score = 0;
  cv::Matx33d photo_from_plane;
};

// Searches the patch along its rows and along its columns.
Turned BestMeeting(const Patch& patch) {
  Turned best;
  for (const cv::Mat& contrast : patch.contrasts) {
    for (const bool turned : {false, true}) {
      const Meeting meeting = FindMeeting(turned ? AmplitudesOfColumns(contrast, patch.unit_px)
                                                 : AmplitudesOfRows(contrast, patch.unit_px),
                                          patch.unit_px);
      if (meeting.score <= best.score) continue;
      // Patch px of plane coordinates; the y axis keeps the picture unmirrored.
      const double s = meeting.right ? patch.unit_px : -patch.unit_px;
      cv::Matx33d patch_from_plane(s, 0, meeting.x_px, 0, s, meeting.y_px, 0, 0, 1);
      if (turned) {
        patch_from_plane = cv::Matx33d(0, -s, meeting.y_px, s, 0, meeting.x_px, 0, 0, 1);
      }
      best = {meeting.score, patch.photo_from_patch * patch_from_plane};
    }
  }
  return best;
}

// Strip of the plane along the apexes, rectified; chevron k's apex lies at x_px = k unit + origin.
struct Strip {
  int first = 0;  // k of the leftmost apex that is looked at
  int last = -1;
  cv::Mat contrast;  // float; filament lighter or darker than plate
  cv::Matx33d photo_from_strip;
  double origin_x_px = 0, origin_y_px = 0;
};

// Range of k whose arms the photo shows.
std::pair<int, int> Shown(const cv::Size& photo, const cv::Matx33d& photo_from_plane) {
  const auto seen = [&](double x, double y) {
    const cv::Vec3d at = photo_from_plane * cv::Vec3d(x, y, 1);
    if (!(at[2] > 0)) return false;
    const double px = at[0] / at[2], py = at[1] / at[2];
    return px >= 0 && py >= 0 && px <= photo.width - 1 && py <= photo.height - 1;
  };
  const auto shown = [&](int k) {
    return seen(k, 0) && seen(k - kChevronReach, kChevronReach) &&
           seen(k - kChevronReach, -kChevronReach);
  };
  int first = 0, last = -1;
  bool any = false;
  for (int k = -kLargestExtent; k <= kLargestExtent; ++k) {
    if (!shown(k)) continue;
    if (!any) first = k;
    last = k;
    any = true;
  }
  return {first, last};
}

// Scales so that the third coordinate is positive at the apexes, and turns a mirrored y round.
cv::Matx33d Normalised(cv::Matx33d matrix) {
  if (matrix(2, 2) < 0) matrix *= -1.0;
  return cv::determinant(matrix) < 0 ? matrix * cv::Matx33d(1, 0, 0, 0, -1, 0, 0, 0, 1) : matrix;
}

std::optional<Strip> StripOf(const cv::Mat& photo, const cv::Matx33d& photo_from_plane,
                             std::size_t channel) {
  const auto [first, last] = Shown(photo.size(), photo_from_plane);
  if (last - first + 1 < kFewestChevrons) return std::nullopt;
  Strip strip;
  strip.first = first;
  strip.last = last;
  const double left = first - kChevronReach - 1, right = last + 1;
  const cv::Size size(static_cast<int>((right - left) * kUnit_px) + 1,
                      static_cast<int>(2 * (kChevronReach + 1) * kUnit_px) + 1);
  strip.origin_x_px = -left * kUnit_px;
  strip.origin_y_px = (kChevronReach + 1) * kUnit_px;
  const double s = 1.0 / kUnit_px;
  const cv::Matx33d plane_from_strip(s, 0, left, 0, s, -kChevronReach - 1, 0, 0, 1);
  strip.photo_from_strip = photo_from_plane * plane_from_strip;
  cv::Mat rectified;
  cv::warpPerspective(photo, rectified, strip.photo_from_strip, size,
                      cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  const std::vector<cv::Mat> channels = ColourChannels(rectified);
  if (channel >= channels.size()) return std::nullopt;
  strip.contrast = LocalContrast(channels[channel], 1.0, 4 * kUnit_px + 1);
  return strip;
}

// Place of a stripe's middle on one row: correlation with a wave of one spacing around it.
struct StripeReading {
  double x_px = 0;
  double strength = 0;  // middle over the mean of both sides
};

StripeReading ReadStripe(const cv::Mat& contrast, int y, double x_px) {
  // Phase over one spacing, linearly interpolated.
  std::complex<double> sum = 0;
  const float* value = contrast.ptr<float>(y);
  for (int i = -kUnit_px / 2; i < kUnit_px / 2; ++i) {
    const double x = x_px + i + 0.5;
    const int at = static_cast<int>(std::floor(x));
    if (at < 0 || at + 1 >= contrast.cols) return {};
    const double v = value[at] + (x - at) * (value[at + 1] - value[at]);
    sum += std::clamp(v, -2.0, 2.0) * std::polar(1.0, -2 * std::numbers::pi * (i + 0.5) / kUnit_px);
  }
  return {x_px - std::arg(sum) / (2 * std::numbers::pi) * kUnit_px, sum.real() / kUnit_px};
}

// Point of an arm's middle: where the model has it, and where the photo shows it.
struct ArmPoint {
  cv::Vec2d plane;
  cv::Vec2d photo;
};

cv::Vec2d Project(const cv::Matx33d& matrix, double x, double y) {
  const cv::Vec3d at = matrix * cv::Vec3d(x, y, 1);
  return {at[0] / at[2], at[1] / at[2]};
}

// Reads each arm at several heights. `strength` is of each chevron of the strip, both arms' weaker.
std::vector<ArmPoint> ReadArms(const Strip& strip, std::vector<double>& strength) {
  std::vector<ArmPoint> points;
  strength.clear();
  for (int k = strip.first; k <= strip.last; ++k) {
    std::array<double, 2> arm{};
    std::vector<ArmPoint> own;
    for (const int side : {0, 1}) {
      std::vector<double> strengths;
      for (double t = 0.9; t < kChevronReach; t += 0.2) {
        const double y = (side == 0 ? -t : t);
        const int row = static_cast<int>(std::lround(strip.origin_y_px + y * kUnit_px));
        const double y_at = (row - strip.origin_y_px) / kUnit_px;
        const double x = strip.origin_x_px + (k - std::abs(y_at)) * kUnit_px;
        const StripeReading reading = ReadStripe(strip.contrast, row, x);
        strengths.push_back(reading.strength);
        own.push_back(
            {{k - std::abs(y_at), y_at}, Project(strip.photo_from_strip, reading.x_px, row)});
      }
      arm[side] = Median(strengths);
    }
    strength.push_back(std::min(arm[0], arm[1]));
    if (strength.back() > 0.15) points.insert(points.end(), own.begin(), own.end());
  }
  return points;
}

// Fits photo_from_plane by linear least squares, both sides scaled to about -1 … 1.
std::optional<cv::Matx33d> FitHomography(const std::vector<ArmPoint>& points) {
  if (points.size() < 12) return std::nullopt;
  cv::Vec2d from = {0, 0}, to = {0, 0};
  for (const ArmPoint& p : points) {
    from += p.plane / double(points.size());
    to += p.photo / double(points.size());
  }
  double from_size = 1e-9, to_size = 1e-9;
  for (const ArmPoint& p : points) {
    from_size = std::max(from_size, cv::norm(p.plane - from));
    to_size = std::max(to_size, cv::norm(p.photo - to));
  }
  Eigen::MatrixXd a(2 * static_cast<Eigen::Index>(points.size()), 8);
  Eigen::VectorXd b(a.rows());
  for (Eigen::Index i = 0; i < a.rows() / 2; ++i) {
    const cv::Vec2d p = (points[i].plane - from) / from_size, q = (points[i].photo - to) / to_size;
    a.row(2 * i) << p[0], p[1], 1, 0, 0, 0, -q[0] * p[0], -q[0] * p[1];
    a.row(2 * i + 1) << 0, 0, 0, p[0], p[1], 1, -q[1] * p[0], -q[1] * p[1];
    b(2 * i) = q[0];
    b(2 * i + 1) = q[1];
  }
  const auto h = geometry::SolveOfFullRank(a, b);
  if (!h) return std::nullopt;
  const Eigen::VectorXd& c = *h;
  const cv::Matx33d scaled(c(0), c(1), c(2), c(3), c(4), c(5), c(6), c(7), 1);
  const cv::Matx33d in(1 / from_size, 0, -from[0] / from_size, 0, 1 / from_size,
                       -from[1] / from_size, 0, 0, 1);
  const cv::Matx33d out(to_size, 0, to[0], 0, to_size, to[1], 0, 0, 1);
  return out * scaled * in;
}

// Returns the distance of a point from where the model has it, in spacings.
double Away(const ArmPoint& point, const cv::Matx33d& plane_from_photo) {
  return cv::norm(Project(plane_from_photo, point.photo[0], point.photo[1]) - point.plane);
}

// Fits again without the points that lie far off, such as stripes of a label, and drops them.
// Nothing if most would have to go: the plane explains another pattern.
std::optional<cv::Matx33d> FitInliers(std::vector<ArmPoint>& points) {
  constexpr int kRounds = 3;
  constexpr double kFar = 3, kAlwaysNear = 0.01;  // medians, spacings
  const std::size_t all = points.size();
  std::optional<cv::Matx33d> fitted = FitHomography(points);
  for (int round = 0; round < kRounds && fitted; ++round) {
    const cv::Matx33d inverse = fitted->inv();
    std::vector<double> away;
    for (const ArmPoint& p : points) away.push_back(Away(p, inverse));
    const double farthest = std::max(kAlwaysNear, kFar * Median(away));
    std::erase_if(points, [&](const ArmPoint& p) { return Away(p, inverse) > farthest; });
    fitted = FitHomography(points);
  }
  if (2 * points.size() < all) return std::nullopt;
  return fitted;
}

// Follows the chevrons from the strongest outwards, as long as they stand out.
std::pair<int, int> Run(const std::vector<double>& strength) {
  constexpr double kShare = 0.45;  // of the median of the strongest
  std::vector<double> sorted = strength;
  std::sort(sorted.rbegin(), sorted.rend());
  const double usual = sorted[std::min<std::size_t>(sorted.size() - 1, kFewestChevrons / 2)];
  const int n = static_cast<int>(strength.size());
  std::pair<int, int> longest{0, -1};
  for (int i = 0; i < n;) {
    int end = i;
    while (end < n && strength[end] > kShare * usual) ++end;
    if (end - i > longest.second - longest.first + 1) longest = {i, end - 1};
    i = end + 1;
  }
  return longest;
}

// Refines the homography and counts; tries each colour channel, lighter and darker stripes alike.
std::optional<FoundChevrons> Refine(const cv::Mat& photo, cv::Matx33d photo_from_plane) {
  std::optional<FoundChevrons> best;
  double best_strength = 0;
  const cv::Matx33d start = Normalised(photo_from_plane);
  for (std::size_t channel = 0; channel < 5; ++channel) {
    photo_from_plane = start;
    FoundChevrons found;
    double total = 0;
    constexpr int kRounds = 12;  // each may reach some chevrons farther
    constexpr int kFewestRounds = 6;
    for (int round = 0, before = -1; round < kRounds; ++round) {
      if (round >= kFewestRounds && found.count == before) break;
      before = found.count;
      const std::optional<Strip> strip = StripOf(photo, photo_from_plane, channel);
      if (!strip) break;
      std::vector<double> strength;
      std::vector<ArmPoint> points = ReadArms(*strip, strength);
      const auto [begin, end] = Run(strength);
      const int first = strip->first + begin, last = strip->first + end;
      std::erase_if(points, [&](const ArmPoint& p) {
        const double k = p.plane[0] + std::abs(p.plane[1]);
        return k < first - 0.5 || k > last + 0.5;
      });
      const auto fitted = FitInliers(points);
      if (!fitted) break;
      double squares = 0;
      for (const ArmPoint& p : points) squares += std::pow(Away(p, fitted->inv()), 2);
      photo_from_plane = Normalised(*fitted);
      found.count = last - first + 1;
      found.irregularity = std::sqrt(squares / double(points.size()));
      total = 0;
      for (int i = begin; i <= end; ++i) total += strength[i];
      // Plane coordinates with chevron 0 as the first.
      found.photo_from_plane =
          FromMatrix(photo_from_plane * cv::Matx33d(1, 0, first, 0, 1, 0, 0, 0, 1));
    }
    constexpr double kMaxIrregular = 0.05;  // lenses bend by less, other patterns by more
    constexpr double kLeastStrength = 0.3;  // chevrons have 0.5 to 0.7, a photo of lines 0.2
    if (found.count < kFewestChevrons || found.irregularity > kMaxIrregular) continue;
    if (total < kLeastStrength * found.count) continue;
    if (total <= best_strength) continue;
    best_strength = total;
    best = found;
  }
  return best;
}

}  // namespace

namespace {

// Picture in which combs of the photo meet.
struct MeetingPlace {
  cv::Mat bgr;
  double scale = 1;  // of the photo
  int unit_px = 0;   // of the patches
};

// Maps pixels, whose centres have whole coordinates, to the photo's.
cv::Matx33d PhotoFrom(double scale) {
  const double shift = (1 / scale - 1) / 2;
  return {1 / scale, 0, shift, 0, 1 / scale, shift, 0, 0, 1};
}

// Returns where two combs meet, in px of the picture; score 0 where they do not.
Turned MeetingOf(FoundComb a, FoundComb b, const MeetingPlace& place) {
  const auto plane_from_photo = PlaneFromPhoto(a, b);
  if (!plane_from_photo) return {};
  const double shift = (1 / place.scale - 1) / 2;
  for (FoundComb* comb : {&a, &b}) {
    for (PointPx& p : comb->corners) p = {(p.x - shift) * place.scale, (p.y - shift) * place.scale};
  }
  const auto patch =
      RectifyAround(place.bgr, *plane_from_photo * PhotoFrom(place.scale), a, b, place.unit_px);
  return patch ? BestMeeting(*patch) : Turned{};
}

// Two combs that may be the arms of the same chevrons.
using Arms = std::pair<FoundComb, FoundComb>;

// Returns the comb turned about its middle, with the same horizon, and twice as large: chevrons'
// other arms lie beside it.
FoundComb OtherArms(const FoundComb& comb, double angle_rad) {
  constexpr double kLarger = 2;  // assumed: from one arm's middle beyond the other's end
  const PointPx middle = Middle(comb.corners);
  const cv::Matx22d turn(std::cos(angle_rad), -std::sin(angle_rad), std::sin(angle_rad),
                         std::cos(angle_rad));
  FoundComb other = comb;
  for (PointPx& corner : other.corners) {
    const cv::Vec2d to = turn * cv::Vec2d(corner.x - middle.x, corner.y - middle.y) * kLarger;
    corner = {middle.x + to[0], middle.y + to[1]};
  }
  // A place is -first / step: its gradient at the middle is turned.
  const cv::Vec3d at(middle.x, middle.y, 1), first = Vector(comb.pencil.first),
                                             step = Vector(comb.pencil.step);
  const double w = step.dot(at), f = first.dot(at);
  const cv::Vec2d gradient =
      turn * cv::Vec2d(first[0] - f / w * step[0], first[1] - f / w * step[1]);
  other.pencil.first = {gradient[0], gradient[1], -gradient[0] * middle.x - gradient[1] * middle.y};
  return other;
}

// Returns the pairs of combs that may meet.
std::vector<Arms> PairsOf(std::span<const FoundComb> combs) {
  std::vector<Arms> pairs;
  for (std::size_t i = 0; i < combs.size(); ++i) {
    for (std::size_t j = i + 1; j < combs.size(); ++j) {
      if (MayMeet(combs[i], combs[j])) pairs.emplace_back(combs[i], combs[j]);
    }
  }
  return pairs;
}

// Returns combs with the other arms that they would have.
std::vector<Arms> LonelyArms(std::span<const FoundComb> combs) {
  constexpr std::size_t kClearest = 12;  // assumed, to bound the time
  std::vector<Arms> pairs;
  for (const FoundComb& comb : combs.first(std::min(combs.size(), kClearest))) {
    for (const double angle_deg : {76.0, 90.0, 104.0}) {  // seen at a slant
      pairs.emplace_back(comb, OtherArms(comb, angle_deg * std::numbers::pi / 180));
    }
  }
  return pairs;
}

// Pictures of a photo in which combs are put together.
class MeetingPlaces {
 public:
  explicit MeetingPlaces(const BgrView& photo)
      : small_(ShrinkToFit(photo, kLongestSearched_px, 1e18, scale_)),
        rough_(ShrinkToFit(small_.view(), kLongestSearched_px / 2, 1e18, rough_scale_)),
        fine_place_{{small_.height, small_.width, CV_8UC3, small_.bgr.data()}, scale_, kUnit_px},
        rough_place_{{rough_.height, rough_.width, CV_8UC3, rough_.bgr.data()},
                     scale_ * rough_scale_,
                     kRoughUnit_px} {}

  // Returns the chevrons of the pair that meets best.
  [[nodiscard]] std::optional<FoundChevrons> BestOf(const std::vector<Arms>& pairs) const {
    struct Scored {
      const Arms* arms;
      double score;
    };
    std::vector<Scored> scored;
    for (const Arms& arms : pairs) {
      const double score = MeetingOf(arms.first, arms.second, rough_place_).score;
      if (score > 0) scored.push_back({&arms, score});
    }
    // The same arms are found as several combs. Assumed: 24 sufficed for the pair that is best in
    // detail in the two virtual photos that were looked at.
    constexpr std::size_t kBestPairs = 32;
    constexpr double kMinScore = 1;  // columns of full contrast
    std::ranges::stable_sort(scored, std::greater(), &Scored::score);
    scored.resize(std::min(scored.size(), kBestPairs));
    std::vector<Turned> meetings;
    for (const Scored& pair : scored) {
      const Turned turned = MeetingOf(pair.arms->first, pair.arms->second, fine_place_);
      if (turned.score >= kMinScore) meetings.push_back(turned);
    }
    // An arm's comb may also meet that of a label or a shadow.
    constexpr std::size_t kTried = 4;
    std::ranges::sort(meetings, std::greater(), &Turned::score);
    meetings.resize(std::min(meetings.size(), kTried));
    for (const Turned& meeting : meetings) {
      auto found = Refine(fine_place_.bgr, meeting.photo_from_plane);
      if (!found) continue;
      found->photo_from_plane = FromMatrix(PhotoFrom(scale_) * Matrix(found->photo_from_plane));
      return found;
    }
    return std::nullopt;
  }

 private:
  double scale_ = 1, rough_scale_ = 1;
  Frame small_, rough_;
  MeetingPlace fine_place_, rough_place_;
};

}  // namespace

std::optional<FoundChevrons> FindChevrons(const BgrView& photo, std::span<const FoundComb> combs) {
  const MeetingPlaces places(photo);
  if (auto found = places.BestOf(PairsOf(combs))) return found;
  // The arms of one side may lie in a shadow.
  return places.BestOf(LonelyArms(combs));
}

}  // namespace trammel::vision
