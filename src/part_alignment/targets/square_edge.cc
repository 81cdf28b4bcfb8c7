#include "part_alignment/targets/square_edge.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "part_alignment/targets/normal_integral.h"
#include "part_alignment/targets/small_cholesky.h"

namespace trammel::part_alignment {
namespace {

// Place in the middle, place at the end less that, blur, shade outside in the middle and its change
// to the end, and the same inside.
constexpr std::size_t kParameters = 7;
constexpr int kMaxIterations = 20;
constexpr int kWholeSteps = 8;  ///< beyond, pixels that enter and leave the band make it swing
constexpr double kSettled_px = 0.003;  ///< a step's own error is of second order
constexpr double kSettled = 0.2;       ///< sigmas: noise at the band's ends keeps it moving
constexpr double kRough_px = 0.02;
constexpr double kFew_px = 40;        ///< rows or columns that are enough for a rough fit
constexpr double kSaturated = 254.5;  ///< 8-bit white holds anything from here on
constexpr double kBlack = 0.5;
constexpr double kRoundingNoise = 0.2887;  ///< 1 / sqrt(12)
constexpr double kReach = 3.5;             ///< the edge is over, in blurs
constexpr double kMargin_px = 3.0;         ///< flat pixels beyond it, on either side
constexpr double kFromCorner = 2.0;        ///< blurs, from the edges at either end
constexpr int kMostParts = 32;

using Vector = SmallVector<kParameters>;
using Matrix = SmallMatrix<kParameters>;

struct Line {
  ImagePoint middle;
  ImagePoint along;  ///< unit vector, from `from` to `to`
  [[nodiscard]] ImagePoint outwards() const { return {along.y, -along.x}; }
};

double Dot(const ImagePoint& a, const ImagePoint& b) { return a.x * b.x + a.y * b.y; }
ImagePoint Less(const ImagePoint& a, const ImagePoint& b) { return {a.x - b.x, a.y - b.y}; }

Line LineThrough(const ImagePoint& from, const ImagePoint& to) {
  const double length = std::max(Distance(from, to), 1e-9);
  return {{0.5 * (from.x + to.x), 0.5 * (from.y + to.y)},
          {(to.x - from.x) / length, (to.y - from.y) / length}};
}

/// One part of the edge's length: how far out the pixels put it, less the line.
struct Part {
  double jj = 0;
  double jr = 0;
};

struct Sums {
  Matrix jtj{};
  Vector jtr{};
  double rss = 0;
  int samples = 0;
  int saturated = 0;
  std::array<Part, kMostParts> parts{};
};

class EdgeFitter {
 public:
  EdgeFitter(const PageView& picture, const EdgeStart& start) : picture_(picture), start_(start) {
    line_ = LineThrough(start.from, start.to);
    length_ = Distance(start.from, start.to);
    neighbours_ = {LineThrough(start.before, start.from), LineThrough(start.to, start.after)};
    blur_ = start.blur_px;
    shades_ = {start.bright, 0, start.dark, 0};
  }

  std::optional<EdgeFit> Run() {
    if (!(length_ > 4)) return std::nullopt;
    every_ = start_.rough ? std::max(1, static_cast<int>(length_ / kFew_px)) : 1;
    const ImagePoint began = line_.middle;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      Place();
      if (!(half_ >= 0.25 * length_)) return std::nullopt;
      Sums sums = Pass();
      constexpr int kLeastSamples = 3 * static_cast<int>(kParameters);
      if (sums.samples - sums.saturated < kLeastSamples) return std::nullopt;
      HoldWhatPixelsLeaveOpen(sums);
      if (!Factor(sums.jtj)) return std::nullopt;
      const double noise = std::sqrt(sums.rss / (sums.samples - sums.saturated));
      const double sigma_px = noise * std::sqrt(SolveFactored(sums.jtj, {1, 0, 0, 0, 0, 0, 0})[0]);
      const double share = iteration < kWholeSteps ? 1 : 0.5;
      const double moved = Step(SolveFactored(sums.jtj, sums.jtr), share);
      if (!(Distance(line_.middle, began) < 2 + 0.3 * depth_)) return std::nullopt;
      const double least_px = start_.rough ? kRough_px : kSettled_px;
      // Early on, residuals are of the start and not of the noise.
      const double enough = iteration < kWholeSteps          ? 0
                            : iteration + 1 < kMaxIterations ? kSettled
                                                             : 1;
      if (moved < std::max(least_px, enough * sigma_px) && iteration > 0) return Describe(sums);
    }
    return std::nullopt;
  }

 private:
  /// What depends on the line and the blur: how much of the edge is fitted, and the modules behind.
  void Place() {
    const ImagePoint n = line_.outwards();
    for (std::size_t k = 0; k < start_.behind.size(); ++k) {
      const ImagePoint p = Less(start_.behind[k], line_.middle);
      behind_[k] = Dot(p, line_.along);
      if (k == 0) first_depth_ = -Dot(p, n);
      last_depth_ = -Dot(p, n);
    }
    depth_ = std::min(first_depth_, last_depth_);
    outer_ = std::min(kReach * blur_ + kMargin_px, std::max(start_.outer_px, 2.5 * blur_));
    const double from = Dot(Less(start_.from, line_.middle), line_.along);
    const double to = Dot(Less(start_.to, line_.middle), line_.along);
    const double low = from + FromCorner(Less(start_.from, start_.before));
    const double high = to - FromCorner(Less(start_.to, start_.after));
    half_ = 0.5 * (high - low);
    // The line's middle is where place and direction share least.
    const double shift = 0.5 * (high + low);
    line_.middle = {line_.middle.x + shift * line_.along.x, line_.middle.y + shift * line_.along.y};
    for (double& at : behind_) at -= shift;
  }

  /// What to leave at a corner so that the other edge, whose direction is given, does not matter.
  [[nodiscard]] double FromCorner(const ImagePoint& other) const {
    const double norm = std::max(std::hypot(other.x, other.y), 1e-9);
    const double sine = std::abs(Dot(other, line_.outwards())) / norm;
    const double cosine = std::abs(Dot(other, line_.along)) / norm;
    const double reach = std::min(kReach * blur_ + kMargin_px, depth_);
    return std::min(0.25 * length_,
                    (kFromCorner * blur_ + 0.25 + reach * cosine) / std::max(sine, 0.2));
  }

  [[nodiscard]] double DepthAt(double t) const {
    const double share = (t - behind_[0]) / (behind_[5] - behind_[0]);
    return first_depth_ + share * (last_depth_ - first_depth_);
  }

  /// How much white from behind the border covers a place, at `depth` px within the edge.
  [[nodiscard]] double WhiteFromBehind(double t, double beyond) const {
    const double over = beyond / blur_;
    if (over < -kReach) return 0;
    double along = 0;
    for (std::size_t k = 0; k < start_.white_behind.size(); ++k) {
      if (!start_.white_behind[k]) continue;
      along +=
          NormalIntegral((t - behind_[k]) / blur_) - NormalIntegral((t - behind_[k + 1]) / blur_);
    }
    return along * NormalIntegral(over);
  }

  /// Where white and black are cut off, next to nothing tells of shades and blur: as weakly as this
  /// they are held to where they began.
  void HoldWhatPixelsLeaveOpen(Sums& sums) const {
    constexpr double kShade = 1 / (20.0 * 20);  // in units of one grey level's weight
    constexpr double kBlur = 1 / (0.5 * 0.5);
    const std::array<double, 4> began = {start_.bright, 0, start_.dark, 0};
    sums.jtj[2][2] += kBlur;
    sums.jtr[2] += kBlur * (start_.blur_px - blur_);
    for (std::size_t i = 0; i < shades_.size(); ++i) {
      sums.jtj[3 + i][3 + i] += kShade;
      sums.jtr[3 + i] += kShade * (began[i] - shades_[i]);
    }
  }

  /// How much of a place on the edge the two edges that meet it leave.
  [[nodiscard]] double WithinNeighbours(double t, double d) const {
    const ImagePoint n = line_.outwards();
    const ImagePoint p{line_.middle.x + t * line_.along.x + d * n.x,
                       line_.middle.y + t * line_.along.y + d * n.y};
    double share = 1;
    for (const Line& neighbour : neighbours_) {
      const double within = -Dot(Less(p, neighbour.middle), neighbour.outwards()) / blur_;
      if (within < kReach) share *= NormalIntegral(within);
    }
    return share;
  }

  [[nodiscard]] Sums Pass() const {
    Sums sums;
    const ImagePoint n = line_.outwards();
    const bool upright = std::abs(n.x) > std::abs(n.y);
    // Along rows where the edge is steep, along columns where it is flat: `major` counts them.
    const double major_middle = upright ? line_.middle.y : line_.middle.x;
    const double minor_middle = upright ? line_.middle.x : line_.middle.y;
    const double major_along = upright ? line_.along.y : line_.along.x;
    const double minor_along = upright ? line_.along.x : line_.along.y;
    const double steep = std::abs(upright ? n.x : n.y);
    const double deepest = std::max(kReach * blur_ + kMargin_px, outer_);
    const double ends = half_ * std::abs(major_along) + deepest;
    const int most = (upright ? picture_.height : picture_.width) - 1;
    const int widest = (upright ? picture_.width : picture_.height) - 1;
    const int first = std::max(0, static_cast<int>(std::ceil(major_middle - ends)));
    const int last = std::min(most, static_cast<int>(std::floor(major_middle + ends)));
    for (int major = first; major <= last; major += every_) {
      const double centre = minor_middle + (major - major_middle) * minor_along / major_along;
      const int low = std::max(0, static_cast<int>(std::ceil(centre - deepest / steep)));
      const int high = std::min(widest, static_cast<int>(std::floor(centre + deepest / steep)));
      for (int minor = low; minor <= high; ++minor) {
        const int x = upright ? minor : major;
        const int y = upright ? major : minor;
        const ImagePoint p{x - line_.middle.x, y - line_.middle.y};
        const double t = Dot(p, line_.along);
        if (std::abs(t) <= half_) Add(picture_.row(y)[x], t, Dot(p, n), sums);
      }
    }
    return sums;
  }

  void Add(double grey, double t, double d, Sums& sums) const {
    const double depth = DepthAt(t);
    const double inner =
        std::min(kReach * blur_ + kMargin_px, std::max(depth - 2 * blur_, 0.5 * depth));
    if (d > outer_ || d < -inner) return;
    const double place = t / half_;
    const bool flat = std::abs(d) > kReach * blur_;
    const double profile = flat ? 0 : NormalDensity(d / blur_);
    const double within = flat ? (d < 0 ? 1.0 : 0.0) : NormalIntegral(-d / blur_, profile);
    // The corners are rounded by the edges that meet there.
    const double left = WithinNeighbours(t, d);
    const double density = left * profile;
    const double cover = left * within - WhiteFromBehind(t, -d - depth);
    const ImagePoint n = line_.outwards();
    const double gain = 1 + d * (start_.light_x * n.x + start_.light_y * n.y);
    const double bright = gain * (shades_[0] + shades_[1] * place);
    const double dark = gain * (shades_[2] + shades_[3] * place);
    const double value = bright + (dark - bright) * cover;
    ++sums.samples;
    // What the sensor cut off tells only that it was beyond.
    if ((grey >= kSaturated && value >= grey) || (grey <= kBlack && value <= grey)) {
      ++sums.saturated;
      return;
    }
    const double by_place = (dark - bright) * density / blur_;
    const Vector j = {by_place,
                      by_place * place,
                      by_place * d / blur_,
                      gain * (1 - cover),
                      gain * (1 - cover) * place,
                      gain * cover,
                      gain * cover * place};
    const double residual = grey - value;
    constexpr std::size_t kShades = 3;  // the first parameter that flat pixels tell of
    for (std::size_t a = flat ? kShades : 0; a < kParameters; ++a) {
      sums.jtr[a] += j[a] * residual;
      for (std::size_t b = flat ? kShades : 0; b <= a; ++b) sums.jtj[a][b] += j[a] * j[b];
    }
    sums.rss += residual * residual;
    const double share = 0.5 * (place + 1) * parts();
    Part& part = sums.parts[std::min(static_cast<std::size_t>(std::max(share, 0.0)),
                                     static_cast<std::size_t>(parts()) - 1)];
    part.jj += by_place * by_place;
    part.jr += by_place * residual;
  }

  [[nodiscard]] int parts() const {
    constexpr double kPart_px = 4;
    return std::clamp(static_cast<int>(2 * half_ / kPart_px), 4, kMostParts);
  }

  /// @returns How far an end of the line went.
  double Step(const Vector& d, double share) {
    const auto within = [](double value, double bound) { return std::clamp(value, -bound, bound); };
    const double out = within(share * d[0], 1);
    const double end = within(share * d[1], 1);
    const ImagePoint n = line_.outwards();
    line_.middle = {line_.middle.x + out * n.x, line_.middle.y + out * n.y};
    const double slope = end / half_;
    const ImagePoint along{line_.along.x + slope * n.x, line_.along.y + slope * n.y};
    const double norm = std::hypot(along.x, along.y);
    line_.along = {along.x / norm, along.y / norm};
    blur_ = std::clamp(blur_ + within(share * d[2], 0.5), 0.25, std::max(0.3, 0.5 * depth_));
    for (std::size_t i = 0; i < shades_.size(); ++i) shades_[i] += within(share * d[3 + i], 100);
    return std::abs(out) + std::abs(end);
  }

  /// REQUIRES sums.jtj factored.
  [[nodiscard]] EdgeFit Describe(const Sums& sums) const {
    EdgeFit fit;
    fit.middle = line_.middle;
    fit.outwards = line_.outwards();
    fit.half_length_px = half_;
    fit.samples = sums.samples;
    fit.saturated = sums.saturated;
    fit.blur_px = blur_;
    fit.bright = shades_[0];
    fit.dark = shades_[2];
    const double spare = sums.samples - sums.saturated - static_cast<double>(kParameters);
    fit.noise = std::max(kRoundingNoise, std::sqrt(sums.rss / spare));
    const Vector middle = SolveFactored(sums.jtj, {1, 0, 0, 0, 0, 0, 0});
    const Vector end = SolveFactored(sums.jtj, {0, 1, 0, 0, 0, 0, 0});
    const double scale = fit.noise * fit.noise;
    fit.var_middle = scale * middle[0];
    fit.var_end = scale * end[1];
    fit.covariance = scale * middle[1];
    Straightness(sums, fit);
    return fit;
  }

  /// The bow, and the scatter of the parts' places about line and bow.
  void Straightness(const Sums& sums, EdgeFit& fit) const {
    const int count = parts();
    const auto bend = [count](int i) {
      const double place = (2 * i + 1.0) / count - 1;
      return 1.5 * place * place - 0.5;
    };
    double top = 0, bottom = 0;
    for (int i = 0; i < count; ++i) {
      top += bend(i) * sums.parts[static_cast<std::size_t>(i)].jr;
      bottom += bend(i) * bend(i) * sums.parts[static_cast<std::size_t>(i)].jj;
    }
    bottom = std::max(bottom, std::numeric_limits<double>::min());
    const double bow = top / bottom;
    for (int i = 0; i < count; ++i) {
      const Part& part = sums.parts[static_cast<std::size_t>(i)];
      if (part.jj <= 0) continue;
      const double off = part.jr / part.jj - bow * bend(i);
      fit.scatter += off * off * part.jj / (fit.noise * fit.noise);
    }
    fit.scatter_free = count - 3;
    fit.bow_px = -1.5 * bow;
    fit.bow_sigma_px = 1.5 * fit.noise / std::sqrt(bottom);
  }

  const PageView& picture_;
  const EdgeStart& start_;
  double length_ = 0;
  double half_ = 0;
  double outer_ = 0;
  double depth_ = 1;
  double first_depth_ = 1;
  double last_depth_ = 1;
  double blur_ = 0;
  int every_ = 1;  ///< looks at one row or column in so many
  Line line_;
  std::array<Line, 2> neighbours_;  ///< the edges before and after
  std::array<double, 6> behind_{};
  std::array<double, 4> shades_{};
};

}  // namespace

std::optional<EdgeFit> FitSquareEdge(const PageView& picture, const EdgeStart& start) {
  return EdgeFitter(picture, start).Run();
}

}  // namespace trammel::part_alignment
