#include "pressure_advance/laser/shared_scatter.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/statistics.h"

namespace trammel::pressure_advance {

void ShareScatter(std::span<LineProfile> lines) {
  std::vector<double> typical;
  for (const LineProfile& line : lines) {
    std::vector<double> sigmas;
    for (const ProfileSample& sample : line.samples) {
      if (sample.area.seen()) sigmas.push_back(sample.area.sigma);
    }
    if (!sigmas.empty()) typical.push_back(Median(sigmas));
  }
  if (typical.empty()) return;
  const double shared = Median(typical);
  constexpr double kMost = 1.5;
  for (LineProfile& line : lines) {
    for (ProfileSample& sample : line.samples) {
      if (!sample.area.seen()) continue;
      const double half_way = std::sqrt(shared / sample.area.sigma);
      sample.area.sigma *= std::clamp(half_way, 1 / kMost, kMost);
    }
  }
}

}  // namespace trammel::pressure_advance
