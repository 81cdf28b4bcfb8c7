#include "pressure_advance/response/analyse.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "pressure_advance/response/repeats.h"

namespace trammel::pressure_advance {

namespace {

RangedAnswer WithoutNumber(Measured why) { return {std::move(why), std::nullopt}; }

// Where a cubic without a minimum inside falls to.
RangedAnswer NoMinimum(const std::vector<double>& cubic, const Interval& tested) {
  const auto score = [&cubic](double p) {
    return cubic[0] + p * (cubic[1] + p * (cubic[2] + p * cubic[3]));
  };
  const std::string why =
      fmt::format("the cubic has no minimum between {:.4g} and {:.4g} s", tested.lo, tested.hi);
  const bool above = score(tested.hi) < score(tested.lo);
  if (!above && tested.lo <= 0) {
    return WithoutNumber(
        Measured::CannotTell(why + " and is lowest at 0, below which nothing can be printed"));
  }
  const Interval next = PrintNext(above ? tested.hi : tested.lo, tested);
  return {Measured::CannotTell(fmt::format("{} and falls towards {} ones: print a pattern from "
                                           "{:.3g} to {:.3g} s",
                                           why, above ? "higher" : "lower", next.lo, next.hi)),
          next};
}

// Lines by their pattern, in the order of the patterns.
std::vector<std::vector<LineProfile>> ByPattern(const std::vector<LineProfile>& profiles) {
  std::map<int, std::vector<LineProfile>> patterns;
  for (const LineProfile& profile : profiles) patterns[profile.pattern].push_back(profile);
  std::vector<std::vector<LineProfile>> sorted;
  for (auto& [index, lines] : patterns) sorted.push_back(std::move(lines));
  return sorted;
}

// Moves a transition's points and curve so that they fall through zero where its value is now.
void MoveZero(const std::vector<LineProfile>& profiles, double by_s, TransitionResult& result) {
  const auto by_value = [&](std::size_t a, std::size_t b) {
    return profiles[a].pressure_advance_s < profiles[b].pressure_advance_s;
  };
  std::vector<std::size_t> lines(profiles.size());
  std::iota(lines.begin(), lines.end(), 0U);
  const auto [least, most] = std::ranges::minmax_element(lines, by_value);
  const double range_s = profiles[*most].pressure_advance_s - profiles[*least].pressure_advance_s;
  const double slope = (result.fitted_s[*least] - result.fitted_s[*most]) / range_s;
  for (double& excess_s : result.excess_s) excess_s += slope * by_s;
  for (double& fitted_s : result.fitted_s) fitted_s += slope * by_s;
}

// Each transition's value as the answer's: both come of the patterns one by one.
void CombineTransition(const std::vector<LineProfile>& profiles,
                       const std::vector<ResponseResult>& alone,
                       TransitionResult ResponseResult::*transition, const Interval& tested_s,
                       double widest, ResponseResult& joint) {
  TransitionResult& result = joint.*transition;
  if (!result.pressure_advance.good()) return;
  std::vector<Measured> pattern_s;
  for (const ResponseResult& one : alone) pattern_s.push_back((one.*transition).pressure_advance);
  Measured combined =
      CombineRepeats(result.pressure_advance.quantity(), std::move(pattern_s), tested_s, widest)
          .first.pressure_advance;
  if (combined.good()) {
    MoveZero(profiles, combined.quantity().value - result.pressure_advance.quantity().value,
             result);
  }
  result.pressure_advance = std::move(combined);
}

// What several patterns on one plate say one by one, and what that makes of the answer.
void CompareRepeats(const std::vector<LineProfile>& profiles, const ResponseOptions& options,
                    Analysis& analysis) {
  const auto patterns = ByPattern(profiles);
  if (patterns.size() < 2) return;
  std::vector<ResponseResult> alone;
  std::vector<Measured> pattern_s;
  for (const auto& lines : patterns) {
    alone.push_back(FitResponse(lines, analysis.motion, options).response);
    pattern_s.push_back(alone.back().pressure_advance);
  }
  ResponseResult& joint = analysis.response;
  if (!joint.pressure_advance.good()) {
    analysis.repeats.emplace().pattern_s = std::move(pattern_s);
    return;
  }
  std::vector<double> values_s;
  for (const LineProfile& profile : profiles) values_s.push_back(profile.pressure_advance_s);
  const Interval tested_s = RangeOf(values_s);
  const double widest = options.widest_interval;
  auto [answer, repeats] =
      CombineRepeats(joint.pressure_advance.quantity(), std::move(pattern_s), tested_s, widest);
  joint.pressure_advance = std::move(answer.pressure_advance);
  joint.print_next_s = answer.print_next_s;
  for (const auto transition : {&ResponseResult::acceleration, &ResponseResult::deceleration}) {
    CombineTransition(profiles, alone, transition, tested_s, widest, joint);
  }
  analysis.repeats = std::move(repeats);
  if (std::string notice = NoticeOfRepeats(*analysis.repeats); !notice.empty()) {
    analysis.notices.push_back(std::move(notice));
  }
}

}  // namespace

RangedAnswer JudgeDeviation(const DeviationResult& deviation,
                            const std::vector<double>& pressure_advance_s) {
  std::vector<double> pa, score;
  for (std::size_t i = 0; i < deviation.score_px.size(); ++i) {
    if (!deviation.score_px[i]) continue;
    pa.push_back(pressure_advance_s.at(i));
    score.push_back(*deviation.score_px[i]);
  }
  if (pa.size() < 5 || deviation.cubic.size() != 4) {
    return WithoutNumber(Measured::Refused(
        fmt::format("{} lines have a score; a cubic with something left over needs 5", pa.size())));
  }
  const Interval tested = RangeOf(pa);
  if (!deviation.cubic_minimum_s) return NoMinimum(deviation.cubic, tested);
  constexpr double kLeastRSquared = 0.5;  // the worst of the paper's twelve conditions has 0.54
  if (deviation.r_squared.value_or(0) < kLeastRSquared) {
    return WithoutNumber(Measured::CannotTell(
        fmt::format("the scores do not follow a curve (R squared {:.2f}, {:.1f} is needed): clean "
                    "the plate and scan again",
                    deviation.r_squared.value_or(0), kLeastRSquared)));
  }
  // Var(minimum) = Var(f'(minimum)) / f''(minimum)^2, with x scaled to the range for conditioning.
  const double range = tested.hi - tested.lo;
  const auto n = static_cast<Eigen::Index>(pa.size());
  Eigen::MatrixXd design(n, 4);
  double squares = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double p = pa[static_cast<std::size_t>(i)];
    const double x = (p - tested.lo) / range;
    design.row(i) << 1, x, x * x, x * x * x;
    const auto& c = deviation.cubic;
    const double fitted = c[0] + p * (c[1] + p * (c[2] + p * c[3]));
    squares += std::pow(score[static_cast<std::size_t>(i)] - fitted, 2);
  }
  const double at = *deviation.cubic_minimum_s;
  const double x = (at - tested.lo) / range;
  const Eigen::Vector4d slope(0, 1, 2 * x, 3 * x * x);
  const Eigen::Vector4d solved = geometry::SolveSymmetric(design.transpose() * design, slope);
  const double freedom = static_cast<double>(n) - 4;
  const double slope_sigma = std::sqrt(squares / freedom * slope.dot(solved));
  const double curvature =
      std::abs(2 * deviation.cubic[2] + 6 * deviation.cubic[3] * at) * range * range;
  if (!(curvature > 0)) {
    return WithoutNumber(Measured::CannotTell("the score curve is flat at its minimum"));
  }
  const double step = range / (static_cast<double>(n) - 1);
  const double u = std::hypot(slope_sigma / curvature * range, step / std::sqrt(12.0));
  constexpr double kAnyWidth = 1;  // of the tested range: what is wider reaches past an edge
  return JudgeInRange(at, u, StudentT95(freedom) * u, tested, kAnyWidth,
                      "the score curve is flat about its minimum");
}

Analysis Analyse(std::vector<LineProfile> profiles, const LineMotion& motion,
                 DeviationResult deviation, Method method, const ResponseOptions& options) {
  Analysis analysis = FitResponse(profiles, motion, options);
  analysis.method = method;
  CompareRepeats(profiles, options, analysis);
  if (method == Method::kResponse) {
    analysis.pressure_advance = analysis.response.pressure_advance;
    analysis.print_next_s = analysis.response.print_next_s;
  } else if (deviation.score_px.empty()) {
    analysis.pressure_advance = Measured::Refused(
        "the deviation needs heights, which a photo does not have: use the response");
  } else {
    std::vector<double> pa;
    for (const LineProfile& profile : profiles) pa.push_back(profile.pressure_advance_s);
    RangedAnswer judged = JudgeDeviation(deviation, pa);
    analysis.pressure_advance = std::move(judged.pressure_advance);
    analysis.print_next_s = judged.print_next_s;
  }
  analysis.profiles = std::move(profiles);
  analysis.deviation = std::move(deviation);
  return analysis;
}

}  // namespace trammel::pressure_advance
