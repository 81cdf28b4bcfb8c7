#include "vision/stripe_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/random.h"

namespace trammel::vision {
namespace {

TEST(StripePath, MedianMagnitudeIsTheMiddleOfTheOrderedMagnitudes) {
  Random random(5);
  EXPECT_EQ(MedianMagnitude({}), 0);
  for (std::size_t count = 1; count < 300; ++count) {
    std::vector<float> sample;
    for (std::size_t i = 0; i < count; ++i) {
      // Many decades, both signs, and many that are alike.
      const double level = random.Normal() * std::pow(10, random.Uniform(-40, 38));
      sample.push_back(
          static_cast<float>(random.Below(3) == 0 ? std::round(3 * random.Normal()) : level));
    }
    if (count % 7 == 0) sample[0] = std::numeric_limits<float>::infinity();
    std::vector<float> ordered;
    for (const float v : sample) ordered.push_back(std::abs(v));
    std::sort(ordered.begin(), ordered.end());
    EXPECT_EQ(MedianMagnitude(sample), ordered[count / 2]) << count;
  }
}

}  // namespace
}  // namespace trammel::vision
