#include "part_alignment/targets/disc_by_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "part_alignment/targets/ellipse_through.h"
#include "part_alignment/targets/soft_grey.h"

namespace trammel::part_alignment {
namespace {

constexpr int kRays = 24;
constexpr int kPlainlyAgreed = kRays * 5 / 6;  ///< rays that leave nothing to look for
constexpr double kMostRatio = 3.5;             ///< of a disc's chords: tilted by 73 degrees

const std::array<Two, kRays> kAlong = AllAround<kRays>(0);

/// A step of shade outwards that is no noise, in soft grey over 2 px.
int LeastStep(double noise) {
  constexpr double kSigmas = 4;
  constexpr double kLeast = 1.5;  // grey levels: rounding makes less
  return static_cast<int>(kSoftUnit * std::max(kLeast, kSigmas * kSoftStepNoise * noise));
}

/// Pixels from a place to the first step outwards along a row or a column.
class StepFinder {
 public:
  StepFinder(const PageView& picture, bool dark, int least_step)
      : picture_(picture), dark_(dark), least_(least_step) {}

  /// -1 where there is none within `most` pixels or the picture.
  [[nodiscard]] int To(int column, int row, int dx, int dy, int most) const {
    // Soft grey is had a pixel from the border, and the step looks a pixel ahead.
    const auto room_along = [](int place, int step, int size) {
      if (step == 0) return size;
      return (step > 0 ? size - 1 - place : place) - 2;
    };
    const int room = std::min(
        {most, room_along(column, dx, picture_.width), room_along(row, dy, picture_.height)});
    const std::uint8_t* p = picture_.row(row) + column;
    if (dy != 0) {
      const std::ptrdiff_t along = dy * picture_.stride;
      return dark_ ? First<1>(p, along, 1, room) : First<-1>(p, along, 1, room);
    }
    return dark_ ? First<1>(p, dx, picture_.stride, room) : First<-1>(p, dx, picture_.stride, room);
  }

 private:
  static constexpr int kAhead_px = 1;  ///< soft grey feels a rim before it is reached

  /// @param along, aside  to the next pixel on the way, and across it.
  template <int kSign>
  [[gnu::always_inline]] int First(const std::uint8_t* p, std::ptrdiff_t along,
                                   std::ptrdiff_t aside, int room) const {
    const auto line = [aside](const std::uint8_t* q) { return SoftLine(q, aside); };
    const auto is_step = [least = least_](int ahead, int behind) {
      return kSign * (ahead - behind) >= least;
    };
    // A line of soft grey across the way serves three places.
    int beside = line(p + along);
    int next = line(p + 2 * along);
    int behind = line(p - along) + 2 * line(p) + beside;
    int here = line(p) + 2 * beside + next;
    p += 3 * along;
    // Two places a turn: none of the values has to change its name.
    for (int i = 1; i <= room; i += 2, p += 2 * along) {
      const int after = line(p);
      const int ahead = beside + 2 * next + after;
      if (is_step(ahead, behind)) return i + kAhead_px;
      if (i == room) return -1;
      const int last = line(p + along);
      const int farther = next + 2 * after + last;
      if (is_step(farther, here)) return i + 1 + kAhead_px;
      behind = ahead;
      here = farther;
      beside = after;
      next = last;
    }
    return -1;
  }

  const PageView& picture_;
  bool dark_;
  int least_;
};

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

/// Whether shade differs between what is within chords and what is beyond: in most of the few
/// directions in which both are in the picture.
/// @param least_step  outwards, in soft grey; its sign counts.
bool IsBounded(const PageView& picture, Two middle, Two chords, int least_step) {
  constexpr std::size_t kAround = 8;
  constexpr int kLeastInPicture = 4;
  constexpr int kMostAlike = 2;    // with another one no two thirds differ
  constexpr double kWithin = 0.6;  // of the chords
  constexpr double kBeyond = 1.5;
  static const std::array<Two, kAround> kDirections = AllAround<kAround>(0.1);
  const Two near = kWithin * chords;
  const Two far = kBeyond * chords;
  int differ = 0;
  int alike = 0;
  for (const Two& direction : kDirections) {
    const TwoInts within = NearestPixel(middle + near * direction);
    const TwoInts beyond = NearestPixel(middle + far * direction);
    if (!IsWithinBorder(picture, within[0], within[1]) ||
        !IsWithinBorder(picture, beyond[0], beyond[1])) {
      continue;
    }
    const int change =
        2 * kSoftUnit * (picture.row(beyond[1])[beyond[0]] - picture.row(within[1])[within[0]]);
    const bool differs = least_step > 0 ? change > least_step : change < least_step;
    differ += differs ? 1 : 0;
    alike += differs ? 0 : 1;
    if (alike > kMostAlike) return false;
  }
  return differ >= kLeastInPicture && differ >= 2 * alike;
}

/// Whether the chords through a run's middle, ended by steps outwards, may be a disc's, with its
/// surroundings beyond them. Little is looked at: most runs are dismissed here.
std::optional<Start> StartWithin(const PageView& picture, const Run& run, int least_step,
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
  const int below = steps.To(column, run.row, 0, 1, most);
  if (below < 0) return std::nullopt;
  const int above = steps.To(column, run.row, 0, -1, most);
  if (above < 0 || below + above + 1 < 2 * least_half) return std::nullopt;
  const int row = run.row + (below - above) / 2;
  const int right = steps.To(column, row, 1, 0, most);
  if (right < 0) return std::nullopt;
  const int left = steps.To(column, row, -1, 0, most);
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

struct RayRules {
  int sign = 1;  ///< of a step outwards
  int least_step = 0;
  double pace_px = 1;
  double farthest_px = 0;
};

/// Distance of the first steep place along a ray; < 0: none before the picture or the way ends.
double SteepPlace(const SoftPicture& picture, Two start, Two along, const RayRules& rules) {
  const int most = static_cast<int>(rules.farthest_px / rules.pace_px) + 1;
  const auto place_at = [&](int i) { return start + i * rules.pace_px * along; };
  const bool all_within = picture.Has(place_at(most));
  int behind = picture.At(start);
  int here = behind;
  int steepest = 0;
  int place = 0;
  for (int i = 1; i <= most; ++i) {
    const Two at = place_at(i);
    if (!all_within && !picture.Has(at)) break;
    const int ahead = picture.At(at);
    const int step = rules.sign * (ahead - behind);
    if (step >= rules.least_step && step > steepest) {
      steepest = step;
      place = i - 1;
    } else if (steepest > 0 && 2 * step < steepest) {
      break;
    }
    behind = here;
    here = ahead;
  }
  return place > 0 ? place * rules.pace_px : -1;
}

/// Where the rays end, about their start.
struct Rim {
  std::array<Offset, kRays> points{};
  std::array<bool, kRays> present{};
  int count = 0;
};

Rim CastRays(const SoftPicture& picture, const Start& start, const RayRules& rules) {
  Rim rim;
  for (int i = 0; i < kRays; ++i) {
    const double at = SteepPlace(picture, Two{start.column_px, start.row_px}, kAlong[i], rules);
    rim.present[i] = at > 0;
    rim.count += rim.present[i] ? 1 : 0;
    rim.points[i] = {at * kAlong[i][0], at * kAlong[i][1]};
  }
  return rim;
}

/// How many points lie on an ellipse.
class Agreement {
 public:
  Agreement(const Rim& rim, double tolerance_px) : rim_(rim), tolerance_px_(tolerance_px) {}

  [[nodiscard]] std::array<bool, kRays> With(const DiscModel& disc) const {
    constexpr double kOfRadius = 0.06;
    const double tolerance = tolerance_px_ + kOfRadius * MeanRadius(disc);
    std::array<bool, kRays> agrees{};
    for (int i = 0; i < kRays; ++i) {
      if (!rim_.present[i]) continue;
      const double x = rim_.points[i].x - disc.column_px;
      const double y = rim_.points[i].y - disc.row_px;
      const double u = disc.wxx * x + disc.wxy * y;
      const double v = disc.wxy * x + disc.wyy * y;
      // |W d|² - 1, and half its gradient.
      const double off = u * u + v * v - 1;
      const double gx = disc.wxx * u + disc.wxy * v;
      const double gy = disc.wxy * u + disc.wyy * v;
      agrees[i] = off * off < 4 * tolerance * tolerance * (gx * gx + gy * gy);
    }
    return agrees;
  }

 private:
  const Rim& rim_;
  double tolerance_px_;
};

struct Common {
  std::optional<DiscModel> disc;  ///< about the rays' start
  int agreed = 0;
};

/// The ellipse that most of the rays end at, of those through all of them, and through half of them
/// side by side.
Common CommonEllipse(const Rim& rim, double tolerance_px) {
  constexpr int kSpan = 3;  // rays
  constexpr int kSpans = kRays / kSpan;
  constexpr int kPick = kSpans / 2;
  double unit = 0;
  for (int i = 0; i < kRays; ++i) {
    if (rim.present[i]) unit = std::max(unit, std::hypot(rim.points[i].x, rim.points[i].y));
  }
  std::array<EllipseSums, kSpans> spans{};
  EllipseSums all;
  for (int i = 0; i < kRays; ++i) {
    if (rim.present[i]) spans[i / kSpan].Add(rim.points[i].x / unit, rim.points[i].y / unit);
  }
  for (const EllipseSums& span : spans) all += span;
  const Agreement agreement(rim, tolerance_px);
  Common best;
  const auto judge = [&](const EllipseSums& sums) {
    const std::optional<DiscModel> disc = sums.Ellipse(unit);
    if (!disc) return;
    const auto agrees = agreement.With(*disc);
    const int agreed = static_cast<int>(std::count(agrees.begin(), agrees.end(), true));
    if (agreed > best.agreed) best = {disc, agreed};
  };
  judge(all);
  for (int first = 0; first < kSpans && best.agreed < kPlainlyAgreed; ++first) {
    EllipseSums half;
    for (int i = 0; i < kPick; ++i) half += spans[(first + i) % kSpans];
    judge(half);
  }
  if (best.agreed < kRays / 2) return {};
  const auto agrees = agreement.With(*best.disc);
  EllipseSums agreed;
  for (int i = 0; i < kRays; ++i) {
    if (agrees[i]) agreed.Add(rim.points[i].x / unit, rim.points[i].y / unit);
  }
  judge(agreed);
  return best;
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
    if (rim.count < kRays / 2) break;
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
