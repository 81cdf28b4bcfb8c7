#include "part_alignment/targets/disc_by_rays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "part_alignment/targets/ellipse_through.h"
#include "part_alignment/targets/soft_grey.h"
#include "part_alignment/targets/step_finder.h"

namespace trammel::part_alignment {
namespace {

constexpr int kRays = 24;
constexpr int kLeastRays = kRays / 2;          ///< that end somewhere, and that agree
constexpr int kPlainlyAgreed = kRays * 5 / 6;  ///< rays that leave nothing to look for
constexpr double kMostRatio = 3.5;             ///< of a disc's chords: tilted by 73 degrees

const std::array<FourPlaces, kRays / 4> kAlong = AroundByFour<kRays>(0);

/// A step of shade outwards that is no noise, in soft grey over 2 px.
int LeastStep(double noise) {
  constexpr double kSigmas = 4;
  constexpr double kLeast = 1.5;  // grey levels: rounding makes less
  return static_cast<int>(kSoftUnit * std::max(kLeast, kSigmas * kSoftStepNoise * noise));
}

/// Where rays begin, and how large a disc about it may be.
struct Start {
  double column_px = 0;
  double row_px = 0;
  double radius_px = 0;
};

constexpr int kBorder_px = 2;

bool IsWithinBorder(const PageView& picture, int x, int y) {
  return x >= kBorder_px && y >= kBorder_px && x < picture.width - kBorder_px &&
         y < picture.height - kBorder_px;
}

/// Pixels of a picture, four at a time.
struct FourPixelPlaces {
  FourInts column;
  FourInts row;
  [[gnu::always_inline]] inline explicit FourPixelPlaces(const FourPlaces& nearest)
      : column(__builtin_convertvector(nearest.x + 0.5, FourInts)),
        row(__builtin_convertvector(nearest.y + 0.5, FourInts)) {}
  [[nodiscard, gnu::always_inline]] inline FourInts AreWithinBorder(const PageView& picture) const {
    return (column >= kBorder_px) & (row >= kBorder_px) & (column < picture.width - kBorder_px) &
           (row < picture.height - kBorder_px);
  }
  /// Of those that are within the picture; the first pixel's for the others.
  [[nodiscard, gnu::always_inline]] inline FourInts Greys(const PageView& picture,
                                                          FourInts are_within) const {
    const FourInts offset = (row * static_cast<std::int32_t>(picture.stride) + column) & are_within;
    return FourInts{picture.data[offset[0]], picture.data[offset[1]], picture.data[offset[2]],
                    picture.data[offset[3]]};
  }
};

/// Whether shade differs between what is within chords and what is beyond: in most of the few
/// directions in which both are in the picture.
/// @param least_step  outwards, in soft grey; its sign counts.
[[gnu::always_inline]] inline bool IsBounded(const PageView& picture, Two middle, Two chords,
                                             int least_step) {
  constexpr std::size_t kAround = 8;
  constexpr int kLeastInPicture = 4;
  constexpr double kWithin = 0.6;  // of the chords
  constexpr double kBeyond = 1.5;
  static const auto kDirections = AroundByFour<kAround>(0.1);
  const Two near = kWithin * chords;
  const Two far = kBeyond * chords;
  const int sign = least_step > 0 ? 1 : -1;
  int differ = 0;
  int alike = 0;
  for (const FourPlaces& to : kDirections) {
    const FourPixelPlaces within({middle[0] + near[0] * to.x, middle[1] + near[1] * to.y});
    const FourPixelPlaces beyond({middle[0] + far[0] * to.x, middle[1] + far[1] * to.y});
    const FourInts are_in = within.AreWithinBorder(picture) & beyond.AreWithinBorder(picture);
    const FourInts change =
        2 * kSoftUnit * (beyond.Greys(picture, are_in) - within.Greys(picture, are_in));
    const FourInts differs = are_in & (sign * change > sign * least_step);
    differ += std::popcount(BitsOf(differs));
    alike += std::popcount(BitsOf(are_in & ~differs));
  }
  return differ >= kLeastInPicture && differ >= 2 * alike;
}

/// Whether the chords through a run's middle, ended by steps outwards, may be a disc's, with its
/// surroundings beyond them. Little is looked at: most runs are dismissed here.
[[gnu::always_inline]] inline std::optional<Start> LookWithin(const PageView& picture,
                                                              const Run& run, int least_step,
                                                              const DiscByRaysRules& rules) {
  const int length = run.last - run.first;
  const int most =
      std::min(static_cast<int>(2 * rules.max_radius_px), static_cast<int>(kMostRatio * length)) +
      2;
  constexpr double kChordError_px = 1;  // of a half: the step of a rim is felt early or late
  const double least_half = 0.5 * rules.min_radius_px + kChordError_px;
  const int column = (run.first + run.last + 1) / 2;
  if (!IsWithinBorder(picture, column, run.row)) return std::nullopt;
  const StepFinder steps(picture, run.dark, least_step);
  const int below = steps.To<0, 1>(column, run.row, most);
  if (below < 0) return std::nullopt;
  const int above = steps.To<0, -1>(column, run.row, most);
  if (above < 0 || below + above + 1 < 2 * least_half) return std::nullopt;
  const int row = run.row + (below - above) / 2;
  const int right = steps.To<1, 0>(column, row, most);
  if (right < 0) return std::nullopt;
  const int left = steps.To<-1, 0>(column, row, most);
  if (left < 0) return std::nullopt;
  const double across = 0.5 * (left + right + 1);
  if (across < least_half || 2.4 * across < length) return std::nullopt;
  // The column may pass beside the middle.
  const double beside = 0.5 * (right - left) / across;
  const double down = 0.5 * (below + above + 1) / std::sqrt(std::max(0.1, 1 - beside * beside));
  if (across > kMostRatio * down + 1 || down > kMostRatio * across + 1) return std::nullopt;
  const double least = rules.min_radius_px + kChordError_px;
  if (across * down < least * least) return std::nullopt;
  const Two middle{column + 0.5 * (right - left), static_cast<double>(row)};
  if (!IsBounded(picture, middle, Two{across, down}, run.dark ? least_step : -least_step)) {
    return std::nullopt;
  }
  return Start{static_cast<double>(column), static_cast<double>(row), std::sqrt(across * down)};
}

#ifdef __x86_64__
/// The same to the bit.
[[gnu::target("avx2")]] std::optional<Start> LookWithinByAvx2(const PageView& picture,
                                                              const Run& run, int least_step,
                                                              const DiscByRaysRules& rules) {
  return LookWithin(picture, run, least_step, rules);
}
#endif

std::optional<Start> StartWithin(const PageView& picture, const Run& run, int least_step,
                                 const DiscByRaysRules& rules) {
#ifdef __x86_64__
  if (TakesAvx2()) return LookWithinByAvx2(picture, run, least_step, rules);
#endif
  return LookWithin(picture, run, least_step, rules);
}

struct RayRules {
  int sign = 1;  ///< of a step outwards
  int least_step = 0;
  double pace_px = 1;
  double farthest_px = 0;
  [[nodiscard]] int MostPaces() const { return static_cast<int>(farthest_px / pace_px) + 1; }
};

/// Where the rays end, about their start.
struct Rim {
  std::array<FourPlaces, kRays / 4> points{};
  std::array<FourDoubles, kRays / 4> at{};  ///< px; < 0: none
  double farthest_px = 0;
  int count = 0;
};

/// Distances of the first steep place along four rays, in paces; 0: none before the picture or the
/// way ends.
/// @tparam kAll  whether the picture has all of them, and a pixel more.
template <bool kAll>
[[gnu::always_inline]] inline FourInts SteepPlaces(const SoftPicture& picture, Two start,
                                                   const FourPlaces& along, const RayRules& rules) {
  const int most = rules.MostPaces();
  FourInts behind = FourInts{} + picture.At(start);
  FourInts here = behind;
  FourInts steepest{};
  FourInts place{};
  FourInts goes_on = FourInts{} - 1;
  for (int i = 1; i <= most; ++i) {
    const double way = i * rules.pace_px;
    const FourPlaces at = {start[0] + way * along.x, start[1] + way * along.y};
    if (!kAll) goes_on &= picture.Has(at);
    const FourInts ahead = kAll ? picture.AtWide(at) : picture.At(at);
    const FourInts step = rules.sign * (ahead - behind);
    const FourInts steeper = goes_on & (step >= rules.least_step) & (step > steepest);
    steepest = steeper ? step : steepest;
    place = steeper ? FourInts{} + (i - 1) : place;
    goes_on &= steeper | (steepest == 0) | (2 * step >= steepest);
    if (!Any(goes_on)) break;
    behind = here;
    here = ahead;
  }
  return place;
}

/// Stops as soon as less than kLeastRays can end anywhere.
[[gnu::always_inline]] inline Rim CastAll(const SoftPicture& picture, Two start,
                                          const RayRules& rules) {
  Rim rim;
  constexpr double kRounding_px = 1e-3;
  const double most_px = rules.MostPaces() * rules.pace_px + kRounding_px;
  const Two reach = {most_px, most_px};
  const bool has_all = picture.HasWide(start - reach) && picture.HasWide(start + reach);
  for (int i = 0; i < kRays; i += 4) {
    const FourPlaces& along = kAlong[i / 4];
    const FourInts places = has_all ? SteepPlaces<true>(picture, start, along, rules)
                                    : SteepPlaces<false>(picture, start, along, rules);
    FourDoubles at;
    for (int k = 0; k < 4; ++k) {
      at[k] = places[k] > 0 ? places[k] * rules.pace_px : -1;
      rim.farthest_px = std::max(rim.farthest_px, at[k]);
      rim.count += places[k] > 0 ? 1 : 0;
    }
    rim.at[i / 4] = at;
    rim.points[i / 4] = {at * along.x, at * along.y};
    const int left = kRays - 4 - i;
    if (rim.count + left < kLeastRays) break;
  }
  return rim;
}

#ifdef __x86_64__
/// The same to the bit.
[[gnu::target("avx2")]] Rim CastAllByAvx2(const SoftPicture& picture, Two start,
                                          const RayRules& rules) {
  return CastAll(picture, start, rules);
}
#endif

Rim CastRays(const SoftPicture& picture, const Start& start, const RayRules& rules) {
  const Two from = {start.column_px, start.row_px};
#ifdef __x86_64__
  if (TakesAvx2()) return CastAllByAvx2(picture, from, rules);
#endif
  return CastAll(picture, from, rules);
}

/// Which points lie on an ellipse.
class Agreement {
 public:
  Agreement(const Rim& rim, double tolerance_px) : rim_(rim), tolerance_px_(tolerance_px) {}

  /// Bit i: whether the i-th does.
  [[nodiscard, gnu::always_inline]] inline unsigned With(const DiscModel& disc) const {
    constexpr double kOfRadius = 0.06;
    const double tolerance = tolerance_px_ + kOfRadius * MeanRadius(disc);
    unsigned agree = 0;
    for (int i = 0; i < kRays / 4; ++i) {
      const FourDoubles x = rim_.points[i].x - disc.column_px;
      const FourDoubles y = rim_.points[i].y - disc.row_px;
      const FourDoubles u = disc.wxx * x + disc.wxy * y;
      const FourDoubles v = disc.wxy * x + disc.wyy * y;
      // |W d|² - 1, and half its gradient.
      const FourDoubles off = u * u + v * v - 1;
      const FourDoubles gx = disc.wxx * u + disc.wxy * v;
      const FourDoubles gy = disc.wxy * u + disc.wyy * v;
      const FourLongs lie =
          (rim_.at[i] > 0) & (off * off < 4 * tolerance * tolerance * (gx * gx + gy * gy));
      agree |= BitsOf(__builtin_convertvector(lie, FourInts)) << 4 * i;
    }
    return agree;
  }

 private:
  const Rim& rim_;
  double tolerance_px_;
};

struct Common {
  std::optional<DiscModel> disc;  ///< about the rays' start
  unsigned agree = 0;             ///< bit i: whether the i-th ray ends there
  int agreed = 0;
};

[[gnu::always_inline]] inline void KeepBetter(const Agreement& agreement,
                                              const EllipsesOf<double>& ellipse, Common& best) {
  if (!ellipse.are) return;
  const DiscModel disc = ModelOf(ellipse);
  const unsigned agree = agreement.With(disc);
  const int agreed = std::popcount(agree);
  if (agreed > best.agreed) best = {disc, agree, agreed};
}

/// What a rim's points are counted in, px.
double UnitOf(const Rim& rim) {
  double unit = 0;
  for (int i = 0; i < kRays; ++i) {
    // Rays end whole paces apart, but for those that are equally long to some rounding.
    const FourPlaces& four = rim.points[i / 4];
    if (rim.at[i / 4][i % 4] == rim.farthest_px)
      unit = std::max(unit, std::hypot(four.x[i % 4], four.y[i % 4]));
  }
  return unit;
}

constexpr int kSpan = 3;  ///< rays side by side
constexpr int kSpans = kRays / kSpan;
constexpr int kPick = kSpans / 2;

/// A rim's points in a unit, and the sums of each span of them.
class RimSums {
 public:
  [[gnu::always_inline]] inline RimSums(const Rim& rim, double unit) {
    for (int i = 0; i < kRays; i += 4) {
      // What is not there is at (0, 0), and adds nothing.
      const FourLongs is_there = rim.at[i / 4] > 0;
      const FourDoubles x = is_there ? rim.points[i / 4].x / unit : FourDoubles{};
      const FourDoubles y = is_there ? rim.points[i / 4].y / unit : FourDoubles{};
      std::memcpy(&x_[i], &x, sizeof(x));
      std::memcpy(&y_[i], &y, sizeof(y));
    }
    for (int first = 0; first < kSpans; first += 4) {
      EllipseSumsOf<FourDoubles> four;
      for (int i = 0; i < kSpan; ++i) {
        const int at = first * kSpan + i;
        four.Add(EverySpan(&x_[at]), EverySpan(&y_[at]));
      }
      for (std::size_t k = 0; k < kSums; ++k) {
        std::memcpy(&spans_[k][first], &four[k], sizeof(four[k]));
      }
    }
    for (auto& spans : spans_) std::copy_n(spans.begin(), kPick, spans.begin() + kSpans);
  }

  [[nodiscard, gnu::always_inline]] inline EllipseSumsOf<double> OfAll() const {
    EllipseSumsOf<double> all;
    for (std::size_t k = 0; k < kSums; ++k) {
      for (int i = 0; i < kSpans; ++i) all[k] += spans_[k][i];
    }
    return all;
  }
  /// Of the half of them that begins at a span, and of those that begin at the three after it.
  [[nodiscard, gnu::always_inline]] inline EllipseSumsOf<FourDoubles> OfHalves(int first) const {
    EllipseSumsOf<FourDoubles> halves;
    for (std::size_t k = 0; k < kSums; ++k) {
      for (int i = 0; i < kPick; ++i) {
        FourDoubles spans;
        std::memcpy(&spans, &spans_[k][first + i], sizeof(spans));
        halves[k] += spans;
      }
    }
    return halves;
  }
  /// @param chosen  bit i: whether the i-th point counts.
  [[nodiscard, gnu::always_inline]] inline EllipseSumsOf<double> Of(unsigned chosen) const {
    EllipseSumsOf<double> sums;
    for (; chosen != 0; chosen &= chosen - 1) {
      const int i = std::countr_zero(chosen);
      sums.Add(x_[i], y_[i]);
    }
    return sums;
  }

 private:
  static constexpr std::size_t kSums = EllipseSumsOf<double>::kCount;
  [[gnu::always_inline]] static inline FourDoubles EverySpan(const double* of) {
    return FourDoubles{of[0], of[kSpan], of[2 * kSpan], of[3 * kSpan]};
  }

  std::array<double, kRays> x_;
  std::array<double, kRays> y_;
  std::array<std::array<double, kSpans + kPick>, kSums> spans_;  ///< after the last the first again
};

/// The ellipse that most of the rays end at, of those through all of them, and through half of them
/// side by side.
[[gnu::always_inline]] inline Common BestEllipse(const Rim& rim, double tolerance_px) {
  const double unit = UnitOf(rim);
  const RimSums sums(rim, unit);
  const Agreement agreement(rim, tolerance_px);
  const int enough = std::min(kPlainlyAgreed, rim.count);
  Common best;
  KeepBetter(agreement, sums.OfAll().Ellipses(unit), best);
  for (int first = 0; first < kSpans && best.agreed < enough; first += 4) {
    const EllipsesOf<FourDoubles> halves = sums.OfHalves(first).Ellipses(unit);
    for (int k = 0; k < 4 && best.agreed < enough; ++k) {
      KeepBetter(agreement, OneOf(halves, k), best);
    }
  }
  if (best.agreed < kLeastRays) return {};
  KeepBetter(agreement, sums.Of(best.agree).Ellipses(unit), best);
  return best;
}

#ifdef __x86_64__
/// The same to the bit.
[[gnu::target("avx2")]] Common BestEllipseByAvx2(const Rim& rim, double tolerance_px) {
  return BestEllipse(rim, tolerance_px);
}
#endif

Common CommonEllipse(const Rim& rim, double tolerance_px) {
#ifdef __x86_64__
  if (TakesAvx2()) return BestEllipseByAvx2(rim, tolerance_px);
#endif
  return BestEllipse(rim, tolerance_px);
}

bool IsDisc(const DiscModel& disc, const DiscByRaysRules& rules) {
  constexpr double kLeastRatio = 0.24;  // of the axes: tilted by 76 degrees
  constexpr double kSlack = 0.8;
  const double mean = 0.5 * (disc.wxx + disc.wyy);
  const double spread = std::hypot(0.5 * (disc.wxx - disc.wyy), disc.wxy);
  const double radius = MeanRadius(disc);
  return mean - spread >= kLeastRatio * (mean + spread) && radius >= kSlack * rules.min_radius_px &&
         radius <= rules.max_radius_px;
}

/// Long rays go at a longer pace: less noise, and less to look at.
double PaceFor(double radius_px) {
  constexpr double kPacesOfRadius = 12;
  return std::clamp(radius_px / kPacesOfRadius, 1.0, 8.0);
}

}  // namespace

std::optional<DiscModel> FindDiscByRays(const PageView& picture, const Run& run,
                                        const DiscByRaysRules& rules) {
  const int least_step = LeastStep(rules.noise);
  const std::optional<Start> within = StartWithin(picture, run, least_step, rules);
  if (!within) return std::nullopt;
  const SoftPicture soft(picture);
  Common best;
  Start start = *within;
  double reach_px = 4 * start.radius_px + 8;
  // From where the run was, and once more from the middle of what came of it: whichever more rays
  // agree from. A shadow's edge may run through the middle.
  for (int round = 0; round < 2 && best.agreed < kPlainlyAgreed; ++round) {
    const RayRules rays{run.dark ? 1 : -1, least_step, PaceFor(start.radius_px),
                        std::min(2 * rules.max_radius_px, reach_px)};
    const Rim rim = CastRays(soft, start, rays);
    if (rim.count < kLeastRays) break;
    Common common = CommonEllipse(rim, 0.3 + 0.6 * rays.pace_px);
    if (!common.disc) break;
    common.disc->column_px += start.column_px;
    common.disc->row_px += start.row_px;
    if (!IsDisc(*common.disc, rules)) break;
    start = {common.disc->column_px, common.disc->row_px, MeanRadius(*common.disc)};
    if (common.agreed > best.agreed) best = common;
    if (!soft.Has(start.column_px, start.row_px)) break;
    reach_px = 4 * start.radius_px;
  }
  if (best.disc) best.disc->contrast = run.dark ? -1 : 1;
  return best.disc;
}

}  // namespace trammel::part_alignment
