#include "part_alignment/survey/survey_advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/statistics.h"

namespace trammel::part_alignment {
namespace {

// The axis of the survey's frame nearest to a direction.
std::string SideOf(const Eigen::Vector3d& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return fmt::format("{}{}", direction[axis] < 0 ? '-' : '+', "xyz"[axis]);
}

}  // namespace

std::vector<std::string> AdvisePictures(const Survey& survey) {
  constexpr int kFewObservations = 6;
  constexpr int kMostNamed = 12;
  constexpr double kMuchWorse = 2;  // than the median target
  std::vector<double> sigmas_mm;
  for (const SurveyedTarget& target : survey.targets) sigmas_mm.push_back(target.sigma_mm.norm());
  if (sigmas_mm.empty()) return {};
  const double usual_mm = Median(sigmas_mm);
  struct Weak {
    std::string ids;
    int more = 0;  // beyond those named
    int named = 0;
    double worst_mm = 0;
    int fewest = 0;
  };
  std::map<std::string, Weak> weak_from;
  for (std::size_t i = 0; i < survey.targets.size(); ++i) {
    const SurveyedTarget& target = survey.targets[i];
    if (target.observations >= kFewObservations && sigmas_mm[i] < kMuchWorse * usual_mm) continue;
    Weak& weak = weak_from[SideOf(target.seen_from)];
    weak.fewest =
        weak.ids.empty() ? target.observations : std::min(weak.fewest, target.observations);
    if (weak.named < kMostNamed) {
      weak.ids += (weak.ids.empty() ? "" : ", ") + target.id;
      ++weak.named;
    } else {
      ++weak.more;
    }
    weak.worst_mm = std::max(weak.worst_mm, sigmas_mm[i] / std::sqrt(3.0));
  }
  std::vector<std::string> advice;
  for (const auto& [side, weak] : weak_from) {
    advice.push_back(fmt::format(
        "more pictures from the {} side, from directions far apart, that show {}{}: seen {} times "
        "at least, known to {:.3f} mm at worst (k = 1, per axis); the usual target to {:.3f} mm",
        side, weak.ids, weak.more > 0 ? fmt::format(" and {} more", weak.more) : "", weak.fewest,
        weak.worst_mm, usual_mm / std::sqrt(3.0)));
  }
  return advice;
}

}  // namespace trammel::part_alignment
