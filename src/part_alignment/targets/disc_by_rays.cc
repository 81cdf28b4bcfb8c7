#include "part_alignment/targets/disc_by_rays.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/quieten.h"

namespace trammel::part_alignment {
namespace {

using Edge = RowMemory::Edge;

/// The steepest places of what changes one way, side by side.
void FindEdges(const std::uint8_t* line, int width, int least, std::vector<Edge>& edges) {
  edges.clear();
  int next = 0;  // column, where the edge would go on
  for (int x = 1; x + 1 < width; ++x) {
    const int step = line[x + 1] - line[x - 1];
    if (std::abs(step) < least) continue;
    if (x != next || (step > 0) != (edges.back().step > 0)) {
      edges.push_back({x, step});
    } else if (std::abs(step) > std::abs(edges.back().step)) {
      edges.back() = {x, step};
    }
    next = x + 1;
  }
}

/// Leaves out edges that both neighbours are much steeper than: dirt, or light that changes within
/// a disc.
void LeaveOutSlight(std::vector<Edge>& edges) {
  constexpr int kMuch = 4;
  if (edges.size() < 3) return;
  std::size_t kept = 1;
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const int steep = kMuch * std::abs(edges[i].step);
    const bool is_slight = i + 1 < edges.size() && steep < std::abs(edges[kept - 1].step) &&
                           steep < std::abs(edges[i + 1].step);
    if (!is_slight) edges[kept++] = edges[i];
  }
  edges.resize(kept);
}

constexpr int kRays = 24;
constexpr int kLeastRays = kRays / 2;          ///< that end somewhere, and that agree
constexpr int kPlainlyAgreed = kRays * 5 / 6;  ///< rays that leave nothing to look for
constexpr double kMostRatio = 3.5;             ///< of a disc's chords: tilted by 73 degrees

/// A step of shade outwards that is no noise, in soft grey over 2 px.
int LeastStep(double noise) {
  constexpr double kSigmas = 4;
  constexpr double kLeast = 1.5;  // grey levels: rounding makes less
  return static_cast<int>(kSoftUnit * std::max(kLeast, kSigmas * kQuietStepNoise * noise));
}

/// Where rays begin, and how large a disc about it may be.
struct Start {
  double column_px = 0;
  double row_px = 0;
  double radius_px = 0;
};

/// A picture in soft grey, by the nearest pixel.
class SoftPicture {
 public:
  explicit SoftPicture(const PageView& picture) : picture_(picture) {}
  [[nodiscard]] bool Has(double x, double y) const {
    return x >= 0.5 && y >= 0.5 && x < picture_.width - 1.5 && y < picture_.height - 1.5;
  }
  /// REQUIRES Has(x, y).
  [[nodiscard]] int At(double x, double y) const {
    return SoftGrey(picture_.row(static_cast<int>(y + 0.5)) + static_cast<int>(x + 0.5),
                    picture_.stride);
  }

 private:
  const PageView& picture_;
};

/// Whether shade differs between what is within chords and what is beyond: in most of the few
/// directions in which both are in the picture.
/// @param least_step  outwards, in soft grey; its sign counts.
bool IsBounded(const SoftPicture& soft, const Start& middle, const Offset& chords, int least_step) {
  constexpr std::size_t kAround = 8;
  constexpr int kLeastInPicture = 4;
  constexpr double kWithin = 0.6;  // of the chords
  constexpr double kBeyond = 1.5;
  static const auto kDirections = AllAround<kAround>(0.1);
  const int sign = least_step > 0 ? 1 : -1;
  int differ = 0;
  int alike = 0;
  for (const Offset& to : kDirections) {
    const Offset near{middle.column_px + kWithin * chords.x * to.x,
                      middle.row_px + kWithin * chords.y * to.y};
    const Offset far{middle.column_px + kBeyond * chords.x * to.x,
                     middle.row_px + kBeyond * chords.y * to.y};
    if (!soft.Has(near.x, near.y) || !soft.Has(far.x, far.y)) continue;
    const int change = soft.At(far.x, far.y) - soft.At(near.x, near.y);
    ++(2 * sign * change > sign * least_step ? differ : alike);
  }
  return differ >= kLeastInPicture && differ >= 2 * alike;
}

/// Pixels from a place to the first step outwards along a row or a column, (dx, dy) being one
/// pixel; -1 where there is none within `most` pixels or the picture.
int StepsTo(const PageView& picture, int column, int row, int dx, int dy, int signed_least,
            int most) {
  // Soft grey is had a pixel from the border, and the step looks a pixel ahead.
  const int left = dx > 0   ? picture.width - 1 - column
                   : dx < 0 ? column
                   : dy > 0 ? picture.height - 1 - row
                            : row;
  const int room = std::min(most, left - 2);
  constexpr int kAhead_px = 1;  // soft grey feels a rim before it is reached
  const std::ptrdiff_t along = dy * picture.stride + dx;
  const std::uint8_t* p = picture.row(row) + column;
  const int least = std::abs(signed_least);
  int behind = SoftGrey(p, picture.stride);
  int here = SoftGrey(p + along, picture.stride);
  for (int i = 1; i <= room; ++i) {
    const int ahead = SoftGrey(p + (i + 1) * along, picture.stride);
    const int step = signed_least > 0 ? ahead - behind : behind - ahead;
    if (step >= least) return i + kAhead_px;
    behind = here;
    here = ahead;
  }
  return -1;
}

/// Whether the chords through a run's middle, ended by steps outwards, may be a disc's, with its
/// surroundings beyond them. Little is looked at: most runs are dismissed here.
std::optional<Start> StartWithin(const PageView& picture, const Run& run, int least_step,
                                 const DiscByRaysRules& rules) {
  constexpr int kBorder_px = 2;
  const int length = run.last - run.first;
  const int most =
      std::min(static_cast<int>(2 * rules.max_radius_px), static_cast<int>(kMostRatio * length)) +
      2;
  constexpr double kChordError_px = 1;  // of a half: the step of a rim is felt early or late
  const double least_half = 0.5 * rules.min_radius_px + kChordError_px;
  const int column = (run.first + run.last + 1) / 2;
  if (column < kBorder_px || run.row < kBorder_px || column >= picture.width - kBorder_px ||
      run.row >= picture.height - kBorder_px) {
    return std::nullopt;
  }
  const int outwards = run.dark ? least_step : -least_step;
  const int below = StepsTo(picture, column, run.row, 0, 1, outwards, most);
  if (below < 0) return std::nullopt;
  const int above = StepsTo(picture, column, run.row, 0, -1, outwards, most);
  if (above < 0 || below + above + 1 < 2 * least_half) return std::nullopt;
  const int row = run.row + (below - above) / 2;
  const int right = StepsTo(picture, column, row, 1, 0, outwards, most);
  if (right < 0) return std::nullopt;
  const int left = StepsTo(picture, column, row, -1, 0, outwards, most);
  if (left < 0) return std::nullopt;
  const double across = 0.5 * (left + right + 1);
  if (across < least_half || 2.4 * across < length) return std::nullopt;
  // The column may pass beside the middle.
  const double beside = 0.5 * (right - left) / across;
  const double down = 0.5 * (below + above + 1) / std::sqrt(std::max(0.1, 1 - beside * beside));
  if (across > kMostRatio * down + 1 || down > kMostRatio * across + 1) return std::nullopt;
  const double least = rules.min_radius_px + kChordError_px;
  if (across * down < least * least) return std::nullopt;
  const Start middle{column + 0.5 * (right - left), static_cast<double>(row), 0};
  if (!IsBounded(SoftPicture(picture), middle, {across, down}, outwards)) return std::nullopt;
  return Start{static_cast<double>(column), static_cast<double>(row), std::sqrt(across * down)};
}

struct RayRules {
  int sign = 1;  ///< of a step outwards
  int least_step = 0;
  double pace_px = 1;
  double farthest_px = 0;
};

/// Where the rays end, about their start; absent where one ends nowhere.
using Rim = std::array<std::optional<Offset>, kRays>;
using Rays = std::bitset<kRays>;

/// The first steep place along a ray, px; absent where there is none before the picture or the way
/// ends.
std::optional<double> SteepPlace(const SoftPicture& soft, const Start& start, const Offset& along,
                                 const RayRules& rules) {
  const int most = static_cast<int>(rules.farthest_px / rules.pace_px) + 1;
  int behind = soft.At(start.column_px, start.row_px);
  int here = behind;
  int steepest = 0;
  int place = 0;
  for (int i = 1; i <= most; ++i) {
    const double x = start.column_px + i * rules.pace_px * along.x;
    const double y = start.row_px + i * rules.pace_px * along.y;
    if (!soft.Has(x, y)) break;
    const int ahead = soft.At(x, y);
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
  if (place == 0) return std::nullopt;
  return place * rules.pace_px;
}

/// Stops as soon as less than kLeastRays can end anywhere.
Rim CastRays(const SoftPicture& soft, const Start& start, const RayRules& rules) {
  static const auto kAlong = AllAround<kRays>(0);
  Rim rim;
  int count = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    if (const auto at = SteepPlace(soft, start, kAlong[i], rules)) {
      rim[i] = Offset{*at * kAlong[i].x, *at * kAlong[i].y};
      ++count;
    }
    const int left = kRays - 1 - static_cast<int>(i);
    if (count + left < kLeastRays) break;
  }
  return rim;
}

/// The rays that end on an ellipse.
Rays AgreeWith(const Rim& rim, const DiscModel& disc, double tolerance_px) {
  constexpr double kOfRadius = 0.06;
  const double tolerance = tolerance_px + kOfRadius * MeanRadius(disc);
  Rays agree;
  for (std::size_t i = 0; i < kRays; ++i) {
    if (!rim[i]) continue;
    const double x = rim[i]->x - disc.column_px;
    const double y = rim[i]->y - disc.row_px;
    const double u = disc.wxx * x + disc.wxy * y;
    const double v = disc.wxy * x + disc.wyy * y;
    // |W d|² - 1, and half its gradient.
    const double off = u * u + v * v - 1;
    const double gradient = std::hypot(disc.wxx * u + disc.wxy * v, disc.wxy * u + disc.wyy * v);
    agree[i] = std::abs(off) < 2 * tolerance * gradient;
  }
  return agree;
}

struct Common {
  std::optional<DiscModel> disc;  ///< about the rays' start
  Rays agree;
};

/// The ellipse that most of the rays end at, of those through all of them, and through half of them
/// side by side.
Common CommonEllipse(const Rim& rim, double tolerance_px) {
  double unit = 0;
  std::size_t count = 0;
  for (const auto& point : rim) {
    if (!point) continue;
    ++count;
    unit = std::max(unit, std::hypot(point->x, point->y));
  }
  Common best;
  if (static_cast<int>(count) < kLeastRays) return best;
  std::vector<Offset> points;
  const auto try_those = [&](const Rays& chosen) {
    points.clear();
    for (std::size_t i = 0; i < kRays; ++i) {
      if (chosen[i] && rim[i]) points.push_back(*rim[i]);
    }
    const auto disc = EllipseThrough(points, unit);
    if (!disc) return;
    const Rays agree = AgreeWith(rim, *disc, tolerance_px);
    if (agree.count() > best.agree.count()) best = {disc, agree};
  };
  const std::size_t enough = std::min<std::size_t>(kPlainlyAgreed, count);
  try_those(Rays{}.set());
  constexpr std::size_t kSpan = 3;  // rays
  for (std::size_t first = 0; first < kRays && best.agree.count() < enough; first += kSpan) {
    Rays half;
    for (std::size_t i = 0; i < kRays / 2; ++i) half.set((first + i) % kRays);
    try_those(half);
  }
  if (static_cast<int>(best.agree.count()) < kLeastRays) return {};
  try_those(Rays(best.agree));
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

std::span<const Run> RunsOfRow(const PageView& picture, int row, const RunRules& rules,
                               RowMemory& memory) {
  std::vector<Edge>& edges = memory.edges;
  FindEdges(picture.row(row), picture.width, rules.edge_step, edges);
  LeaveOutSlight(edges);
  memory.runs.clear();
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const Edge& first = edges[i - 1];
    const Edge& last = edges[i];
    const int length = last.column - first.column;
    if (length < rules.min_px || length > rules.max_px) continue;
    const int before = first.column - (i > 1 ? edges[i - 2].column : 0);
    const int after = (i + 1 < edges.size() ? edges[i + 1].column : picture.width) - last.column;
    // A disc's gap is half as wide as its chord or more, from wherever it is seen.
    if (20 * std::min(before, after) < 9 * length) continue;
    const bool falls = first.step < 0;
    memory.runs.push_back({row, first.column, last.column, falls});
    if (falls == (last.step < 0)) memory.runs.push_back({row, first.column, last.column, !falls});
  }
  return memory.runs;
}

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
  for (int round = 0; round < 2 && best.agree.count() < kPlainlyAgreed; ++round) {
    const RayRules rays{run.dark ? 1 : -1, least_step, PaceFor(start.radius_px),
                        std::min(2 * rules.max_radius_px, reach_px)};
    Common common = CommonEllipse(CastRays(soft, start, rays), 0.3 + 0.6 * rays.pace_px);
    if (!common.disc) break;
    common.disc->column_px += start.column_px;
    common.disc->row_px += start.row_px;
    if (!IsDisc(*common.disc, rules)) break;
    start = {common.disc->column_px, common.disc->row_px, MeanRadius(*common.disc)};
    if (common.agree.count() > best.agree.count()) best = common;
    if (!soft.Has(start.column_px, start.row_px)) break;
    reach_px = 4 * start.radius_px;
  }
  if (best.disc) best.disc->contrast = run.dark ? -1 : 1;
  return best.disc;
}

}  // namespace trammel::part_alignment
