#include "tap/two_line/kneedle.h"

#include <algorithm>

namespace trammel::tap {
namespace {

constexpr std::size_t kSmoothing = 4;  // samples to either side

// Mean around a sample, of as many to either side as the stretch has.
float Smooth(std::span<const float> forces, std::size_t i) {
  const std::size_t reach = std::min({kSmoothing, i, forces.size() - 1 - i});
  float sum = 0;
  for (std::size_t k = i - reach; k <= i + reach; ++k) {
    sum += forces[k];
  }
  return sum / static_cast<float>(2 * reach + 1);
}

}  // namespace

std::size_t FindKnee(const Samples& samples, std::size_t first, std::size_t end, bool late_bend) {
  constexpr std::size_t kLeast = 4;
  if (end < first + kLeast) {
    return end;
  }
  const auto forces = samples.force_g.subspan(first, end - first);
  const auto [lowest, highest] = std::minmax_element(forces.begin(), forces.end());
  const float height = *highest - *lowest;
  const float duration = samples.time_s[end - 1] - samples.time_s[first];
  if (!(height > 0) || !(duration > 0)) {
    return end;
  }
  const bool rises = forces.back() > forces.front();
  // Distance from the diagonal, positive at a bend: a curve that starts flat lies below the
  // diagonal of its scaled, rising form, one that starts steep above it.
  const auto distance = [&](std::size_t i) {
    const float x = (samples.time_s[i] - samples.time_s[first]) / duration;
    const float scaled = (Smooth(forces, i - first) - *lowest) / height;
    const float y = rises ? scaled : 1 - scaled;
    return late_bend ? x - y : y - x;
  };
  const float fall = 1.0F / static_cast<float>(end - first - 1);  // sensitivity 1
  std::size_t farthest = first + 1;
  std::size_t maximum = end;
  float at_maximum = 0;
  float before = distance(first);
  float here = distance(first + 1);
  float at_farthest = here;
  for (std::size_t i = first + 1; i + 1 < end; ++i) {
    const float after = distance(i + 1);
    if (here > at_farthest) {
      farthest = i;
      at_farthest = here;
    }
    if (here > before && here >= after) {
      maximum = i;
      at_maximum = here;
    } else if (maximum != end && here < at_maximum - fall) {
      return std::clamp(maximum, first + 1, end - 1);
    }
    before = here;
    here = after;
  }
  return farthest;
}

}  // namespace trammel::tap
