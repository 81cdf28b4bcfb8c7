#include "pressure_advance/response/flow_ratio.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/square.h"
#include "base/statistics.h"
#include "pressure_advance/response/answer.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::pressure_advance {
namespace {

constexpr std::size_t kFewestInStretch = 3;
constexpr std::size_t kFewestSteadyLines = 5;
constexpr double kBrokenShare = 0.33;  // of the typical area: a bead below it has parted
// Flow of a print over that of many, 1 sigma, relative: gears and spools turn more slowly than a
// print lasts, and slow stretches hold what a change of speed left. Of virtual prints below
// seed 48.
constexpr double kFlowWander = 0.007;
// Share of an area that is read in one print over that in another on the same plate, 1 sigma: the
// beads' heights differ, and the plate's texture. Of pairs of virtual scans with seeds 321000 to
// 321095: 1.3 % between two, of which the lines' scatter and the wander explain 1.1 %.
constexpr double kReadingRepeat = 0.007;
// OrcaSlicer's first pass tests steps of 5 %: a wider interval does not choose between two.
constexpr double kWidestFlow = 0.05;
constexpr double kTrendSigmas = 3.5;  // sigmas from which a trend over the pattern counts

struct LineLevel {
  double area = 0;    // over the commanded one
  double height = 0;  // of the bead, in the profile's unit
};

bool IsSlowStretch(const LineMotion& motion, const Interval& stretch) {
  const double first_mm = motion.segments[0].fraction * *motion.length_mm;
  const double last_mm = first_mm + motion.segments[1].fraction * *motion.length_mm;
  return stretch.hi <= first_mm || stretch.lo >= last_mm;
}

std::vector<Interval> SteadyStretches(const LineMotion& motion, const TransitionPlan& plan,
                                      bool slow) {
  std::vector<Interval> stretches;
  for (const Interval& stretch : plan.reference) {
    if (IsSlowStretch(motion, stretch) == slow) stretches.push_back(stretch);
  }
  return stretches;
}

// StretchReadings of a line within some stretches.
struct StretchReadings {
  std::vector<double> areas, heights;
};

StretchReadings ReadingsIn(const LineProfile& profile, const std::vector<Interval>& stretches) {
  StretchReadings readings;
  for (const ProfileSample& sample : profile.samples) {
    const bool inside = std::ranges::any_of(stretches, [&](const Interval& stretch) {
      return sample.position >= stretch.lo && sample.position <= stretch.hi;
    });
    if (!inside || sample.gap || !sample.area.seen()) continue;
    readings.areas.push_back(sample.area.value);
    readings.heights.push_back(sample.height.value);
  }
  return readings;
}

// Returns the levels of lines that are steady and whole, in print order.
std::vector<LineLevel> LineLevels(const std::vector<LineProfile>& profiles,
                                  const std::vector<Interval>& stretches, double commanded_mm2,
                                  int& broken) {
  std::vector<StretchReadings> lines;
  std::vector<double> all;
  for (const LineProfile& profile : profiles) {
    if (!profile.unusable.empty()) continue;
    lines.push_back(ReadingsIn(profile, stretches));
    all.insert(all.end(), lines.back().areas.begin(), lines.back().areas.end());
  }
  std::vector<LineLevel> levels;
  if (all.empty()) return levels;
  const double least_mm2 = kBrokenShare * Median(all);
  for (const StretchReadings& line : lines) {
    if (line.areas.size() < kFewestInStretch) continue;
    if (std::ranges::min(line.areas) < least_mm2) {
      ++broken;
      continue;
    }
    levels.push_back({Mean(line.areas) / commanded_mm2, Mean(line.heights)});
  }
  return levels;
}

// Computes Tukey's biweight location. REQUIRES at least two values.
AreaShare CombineLevels(const std::vector<LineLevel>& levels) {
  std::vector<double> values;
  for (const LineLevel& level : levels) values.push_back(level.area);
  const double scatter = std::max(1e-6, RobustStandardDeviation(values));
  AreaShare share{.value = Median(values), .lines = static_cast<int>(values.size())};
  double weights = 0, squares = 0, leaves = 0;
  for (int pass = 0; pass < 10; ++pass) {
    constexpr double kFar = 6;  // scatters, from where a line counts nothing
    double sum = 0;
    weights = squares = leaves = 0;
    for (const double value : values) {
      const double off = (value - share.value) / (kFar * scatter);
      if (std::abs(off) >= 1) continue;
      const double weight = Square(1 - Square(off));
      sum += weight * value;
      weights += weight;
      squares += Square(weight);
      leaves += Square(weight * (value - share.value));
    }
    share.value = sum / weights;
  }
  const double count = Square(weights) / squares;  // effective number of lines
  share.freedom = std::max(1.0, count - 1);
  share.sigma = std::sqrt(leaves / Square(weights) * count / share.freedom);
  return share;
}

// Change of a quantity over the pattern, relative, and its significance.
struct LevelTrend {
  double change = 0;
  double sigmas = 0;
};

LevelTrend TrendOf(const std::vector<LineLevel>& levels, double LineLevel::*quantity) {
  const auto count = static_cast<double>(levels.size());
  double mean = 0;
  for (const LineLevel& level : levels) mean += level.*quantity / count;
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const double x = static_cast<double>(i) - 0.5 * (count - 1);
    xx += x * x;
    xy += x * (levels[i].*quantity - mean);
  }
  double rest = 0;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const double x = static_cast<double>(i) - 0.5 * (count - 1);
    rest += Square(levels[i].*quantity - mean - xy / xx * x);
  }
  const double sigma = std::sqrt(rest / (count - 2) / xx);
  if (!(sigma > 0) || !(mean > 0)) return {};
  return {xy / xx * (count - 1) / mean, xy / xx / sigma};
}

// Names a cause other than the flow: a bed that is not level.
std::string FaultOfBed(const SteadyAreas& areas, double half_width) {
  const bool both =
      std::abs(areas.area_sigmas) > kTrendSigmas && std::abs(areas.height_sigmas) > kTrendSigmas;
  const bool together = areas.area_change * areas.height_change > 0;
  if (!both || !together || std::abs(areas.area_change) < 2 * half_width) return {};
  return fmt::format(
      "the lines' areas change by {:+.1f} % from the first to the last, and their heights by "
      "{:+.1f} %: a tilted bed explains that as well; level it and print again",
      100 * areas.area_change, 100 * areas.height_change);
}

}  // namespace

AreaReading ReadingByReference(const AreaShare& reference, double known_ratio) {
  TRAMMEL_CHECK(known_ratio > 0 && reference.value > 0, "ratio {}, share {}", known_ratio,
                reference.value);
  const double share = reference.value * known_ratio;
  // The reference's flow wanders, too.
  const double lines = std::hypot(reference.sigma / reference.value, kFlowWander);
  return {share, share * std::hypot(lines, kReadingRepeat), true};
}

SteadyAreas MeasureSteadyAreas(const std::vector<LineProfile>& profiles, const LineMotion& motion,
                               double commanded_area_mm2) {
  SteadyAreas areas;
  double longest_s = 0;
  for (const LineProfile& profile : profiles) {
    longest_s = std::max(longest_s, profile.pressure_advance_s);
  }
  const auto plan = PlanTransitions(motion, PositionUnit::kMillimetre, longest_s);
  if (!plan) {
    areas.fault = plan.error().message;
    return areas;
  }
  int ignored = 0;
  const auto slow =
      LineLevels(profiles, SteadyStretches(motion, *plan, true), commanded_area_mm2, areas.broken);
  const auto fast =
      LineLevels(profiles, SteadyStretches(motion, *plan, false), commanded_area_mm2, ignored);
  if (slow.size() < kFewestSteadyLines) {
    areas.fault = fmt::format(
        "{} of {} lines have {} readings in a steady, whole slow stretch ({} are broken), at least "
        "{} lines are needed: scan more of each line, or print again",
        slow.size(), profiles.size(), kFewestInStretch, areas.broken, kFewestSteadyLines);
    return areas;
  }
  areas.slow = CombineLevels(slow);
  if (fast.size() >= kFewestSteadyLines) areas.fast = CombineLevels(fast);
  const LevelTrend area = TrendOf(slow, &LineLevel::area);
  const LevelTrend height = TrendOf(slow, &LineLevel::height);
  areas.area_change = area.change, areas.area_sigmas = area.sigmas;
  areas.height_change = height.change, areas.height_sigmas = height.sigmas;
  return areas;
}

FlowRatio EstimateFlowRatio(const std::vector<LineProfile>& profiles, const LineMotion& motion,
                            const FlowPremises& premises,
                            const std::optional<AreaReading>& reference) {
  FlowRatio flow;
  const std::optional<HeightScale>& scale = premises.scale;
  if (!premises.commanded_area_mm2) {
    flow.ratio = Measured::CannotTell(
        "the recording does not say how much was commanded (commanded_area_mm2 of scan.json); scan "
        "a pattern of this trammel");
    return flow;
  }
  if (!scale) {
    flow.ratio = Measured::CannotTell("the scale is not known; run trammel pa setup");
    return flow;
  }
  flow.areas = MeasureSteadyAreas(profiles, motion, *premises.commanded_area_mm2);
  if (!flow.areas->slow) {
    flow.ratio = Measured::CannotTell(flow.areas->fault);
    return flow;
  }
  if (!reference && !premises.opaque_plate) {
    flow.ratio = Measured::CannotTell(
        "a plate that light enters changes what the laser shows of a bead by 0 to 20 %; set "
        "opaque_plate = true in [camera] if yours is dark and opaque, or give a scan of a known "
        "flow ratio on it (pa analyze --flow-reference)");
    return flow;
  }
  if (!reference && !scale->area_share) {
    flow.ratio = Measured::CannotTell(
        "the scale's uncertainty is not known (px_per_mm_sigma, laser_angle_sigma); run trammel pa "
        "setup");
    return flow;
  }
  const AreaShare& slow = *flow.areas->slow;
  if (!(slow.value > 0)) {
    flow.ratio = Measured::CannotTell("the lines have no area");
    return flow;
  }
  const AreaReading reading = reference.value_or(kOpaqueReading);
  const double value = reading.share / slow.value;
  flow.by_reference = reference.has_value();
  flow.budget = {.lines = slow.sigma / slow.value,
                 .wander = kFlowWander,
                 .scale = reading.with_scale ? 0 : *scale->area_share,
                 .reading = reading.sigma / reading.share};
  const FlowBudget& parts = flow.budget;
  const UncertaintyBudget variances{.lines = Square(parts.lines),
                                    .unread = Square(parts.reading),
                                    .drift = Square(parts.wander),
                                    .picture = Square(parts.scale)};
  const double half = value * HalfWidth95(variances, slow.freedom);
  if (half > kWidestFlow) {
    const auto largest = std::max({std::pair{parts.lines, "the lines' scatter"},
                                   std::pair{parts.scale, "the scale of the camera's set-up"},
                                   std::pair{parts.reading, "what the laser shows of a bead"},
                                   std::pair{parts.wander, "the flow's wander"}});
    flow.ratio = Measured::CannotTell(fmt::format(
        "it would be known to +-{:.2f} only, and more than +-{} chooses no setting; most comes "
        "from "
        "{} (1 sigma {:.1f} %): {}",
        half, kWidestFlow, largest.second, 100 * largest.first,
        largest.first == parts.reading && !reference
            ? "give a scan of a known flow ratio on this plate (pa analyze --flow-reference)"
        : largest.first == parts.scale ? "run trammel pa setup again"
                                       : "print and scan again"));
    return flow;
  }
  if (std::string fault = FaultOfBed(*flow.areas, half / value); !fault.empty()) {
    flow.ratio = Measured::CannotTell(fault);
    return flow;
  }
  flow.ratio =
      Measured::Good({value, value * std::sqrt(variances.total()), {value - half, value + half}});
  return flow;
}

}  // namespace trammel::pressure_advance
