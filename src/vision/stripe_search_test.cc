#include "vision/stripe_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
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

/// Price of a path's steps and of its pixels, each of which costs what it lacks of its row's best.
class PathPrices {
 public:
  PathPrices(const ImageSize& size, float sigma, float noise, const LaserLineOptions& options,
             const LaserLineWorkspace& workspace)
      : size_(size),
        floor_(options.detection * noise),
        slope_(options.slope_cost),
        jump_(options.jump_cost * sigma),
        response_(workspace.response) {}

  [[nodiscard]] double Pixel(int x, int y) const {
    double best = floor_;
    for (int i = 0; i < size_.width; ++i) best = std::max(best, At(i, y));
    return 1 - std::clamp(At(x, y) / best, 0.0, 1.0);
  }
  [[nodiscard]] double Step(int from, int to) const {
    return std::min(slope_ * std::abs(to - from), jump_);
  }
  /// Of the cheapest path, by trying every step.
  [[nodiscard]] double Least() const {
    std::vector<double> cost(static_cast<std::size_t>(size_.width), 0.0);
    for (int y = 0; y < size_.height; ++y) {
      std::vector<double> next(cost.size(), std::numeric_limits<double>::max());
      for (int to = 0; to < size_.width; ++to) {
        double& least = next[static_cast<std::size_t>(to)];
        for (int from = 0; from < size_.width; ++from) {
          least = std::min(least, cost[static_cast<std::size_t>(from)] +
                                      (y == 0 ? (from == to ? 0 : 1e9) : Step(from, to)));
        }
        least += Pixel(to, y);
      }
      cost = next;
    }
    return *std::min_element(cost.begin(), cost.end());
  }

 private:
  [[nodiscard]] double At(int x, int y) const { return response_[size_.at(x, y)]; }
  ImageSize size_;
  double floor_;
  double slope_;
  double jump_;
  const std::vector<float>& response_;
};

TEST(StripePath, IsAsCheapAsTheCheapestOfAllPaths) {
  Random random(6);
  for (int trial = 0; trial < 200; ++trial) {
    const ImageSize size{3 + static_cast<int>(random.Below(40)),
                         1 + static_cast<int>(random.Below(20))};
    const float sigma = static_cast<float>(random.Uniform(1, 4));
    LaserLineOptions options;
    options.slope_cost = random.Uniform(0.01, 0.3);
    options.jump_cost = random.Uniform(0.1, 2);
    LaserLineWorkspace workspace;
    workspace.response.assign(size.stored(), 0.0F);
    workspace.best.assign(static_cast<std::size_t>(size.bands()) * kBandRows, 0.0F);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const auto response = static_cast<float>(random.Normal());
        workspace.response[size.at(x, y)] = response;
        float& best = workspace.best[static_cast<std::size_t>(y)];
        best = std::max(best, response);
      }
    }
    constexpr float kNoise = 0.2F;
    ShortestPath(size, sigma, kNoise, options, workspace);
    const PathPrices prices(size, sigma, kNoise, options, workspace);
    double price = 0;
    for (int y = 0; y < size.height; ++y) {
      const int x = workspace.path[static_cast<std::size_t>(y)];
      price += prices.Pixel(x, y);
      if (y > 0) price += prices.Step(workspace.path[static_cast<std::size_t>(y) - 1], x);
    }
    constexpr double kRounding = 1e-4;  // single precision, over 20 rows
    EXPECT_NEAR(price, prices.Least(), kRounding) << size.width << "x" << size.height;
  }
}

}  // namespace
}  // namespace trammel::vision
