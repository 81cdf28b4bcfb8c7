#include "pressure_advance/laser/plate_level.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/random.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kForetoldPx = 0.05;
constexpr std::size_t kFrames = 60;

// Levels that scatter by `scatter_px` where the bead's two sides differ by `sides_px`.
Plate Scattered(double scatter_px, double sides_px) {
  Random random(3);
  Plate plate;
  for (std::size_t f = 0; f < kFrames; ++f) {
    plate.level.push_back(5 + 0.01 * static_cast<double>(f) + random.Normal(0, scatter_px));
    plate.sigma.push_back(kForetoldPx);
    // A bed's twist: the sides part steadily.
    plate.sides.push_back(0.1 * static_cast<double>(f) + random.Normal(0, sides_px));
  }
  return plate;
}

double ScatterOf(const Plate& plate) {
  double square = 0;
  for (std::size_t f = 0; f < kFrames; ++f) {
    square += std::pow(plate.level[f] - 5 - 0.01 * static_cast<double>(f), 2);
  }
  return std::sqrt(square / kFrames);
}

TEST(PlateLevel, IsItsTrendWhereTheSidesOfTheBeadDifferAsMuchAsItScatters) {
  Plate plate = Scattered(0.3, 0.3);
  ShrinkToTrend(1, plate);
  EXPECT_LT(ScatterOf(plate), 0.12);
  EXPECT_LT(plate.sigma[kFrames / 2], 0.02);
}

TEST(PlateLevel, IsWhatAFrameShowsWhereBothSidesMoveTogether) {
  Plate plate = Scattered(0.3, kForetoldPx);
  const Plate before = plate;
  ShrinkToTrend(1, plate);
  for (std::size_t f = 0; f < kFrames; ++f) EXPECT_NEAR(plate.level[f], before.level[f], 0.05);
  EXPECT_GT(plate.sigma[kFrames / 2], 0.9 * kForetoldPx);
}

TEST(PlateLevel, GoesByWhatIsForetoldWhereFramesShowOneSideAlone) {
  Plate plate = Scattered(0.3, 0.3);
  plate.sides.assign(kFrames, NAN);
  const Plate before = plate;
  ShrinkToTrend(1, plate);
  for (std::size_t f = 0; f < kFrames; ++f) EXPECT_NEAR(plate.level[f], before.level[f], 0.05);
}

}  // namespace
}  // namespace trammel::pressure_advance
