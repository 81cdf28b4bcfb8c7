#include "pressure_advance/response/analyse.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "pressure_advance/response/repeats.h"

namespace trammel::pressure_advance {

namespace {

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
  static_cast<RangedAnswer&>(joint) = std::move(answer);
  for (const auto transition : {&ResponseResult::acceleration, &ResponseResult::deceleration}) {
    CombineTransition(profiles, alone, transition, tested_s, widest, joint);
  }
  analysis.repeats = std::move(repeats);
  if (std::string notice = NoticeOfRepeats(*analysis.repeats); !notice.empty()) {
    analysis.notices.push_back(std::move(notice));
  }
}

}  // namespace

Analysis Analyse(std::vector<LineProfile> profiles, const LineMotion& motion,
                 DeviationResult deviation, const ResponseOptions& options) {
  Analysis analysis = FitResponse(profiles, motion, options);
  CompareRepeats(profiles, options, analysis);
  static_cast<RangedAnswer&>(analysis) = static_cast<const RangedAnswer&>(analysis.response);
  analysis.profiles = std::move(profiles);
  analysis.deviation = std::move(deviation);
  return analysis;
}

}  // namespace trammel::pressure_advance
