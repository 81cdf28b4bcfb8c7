#include "pressure_advance/laser/plate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/random.h"
#include "pressure_advance/laser/bead_area.h"

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

constexpr double kBandRows = 20;
constexpr double kHeightPx = 9;

// A bead with an elliptic section that ends `half` rows beside its middle, `middle` rows beside the
// band's centre, on a plate whose heights scatter by `noise_px`.
BeadSection Bead(double half, double middle = 0, double noise_px = 0, Random* random = nullptr) {
  BeadSection section;
  section.first_row = -kBandRows;
  section.band = {-kBandRows, kBandRows};
  for (double row = -kBandRows; row <= kBandRows; row += 1) {
    const double t = (row - middle) / half;
    double height = std::abs(t) < 1 ? kHeightPx * std::sqrt(1 - t * t) : 0;
    if (random != nullptr && height == 0) height = noise_px * random->Normal();
    section.height.push_back(height);
    section.variance.push_back(noise_px * noise_px);
  }
  return section;
}

std::vector<Interval> ReachOf(const std::vector<BeadSection>& sections, double noise_px = 0.1) {
  return FindReach(sections, std::vector<bool>(sections.size(), true), noise_px);
}

TEST(BeadReach, FollowsTheSizeOfTheBead) {
  std::vector<BeadSection> sections;
  std::vector<double> halves;
  for (int i = 0; i < 40; ++i) {
    halves.push_back(7 + 0.15 * ((7 * i) % 40));
    sections.push_back(Bead(halves.back(), 1.5));
  }
  const std::vector<Interval> reach = ReachOf(sections);
  for (std::size_t i = 0; i < sections.size(); ++i) {
    EXPECT_NEAR(reach[i].hi, 1.5 + halves[i] + 1, 1.2) << halves[i];
    EXPECT_NEAR(reach[i].lo, 1.5 - halves[i] - 1, 1.2) << halves[i];
    EXPECT_NEAR(sections[i].Sum(reach[i]), sections[i].Sum(sections[i].band), 0.5) << halves[i];
  }
}

TEST(BeadReach, LeavesMostOfThePlatesNoiseOut) {
  constexpr int kFrames = 200;
  constexpr double kNoisePx = 0.9;
  Random random(4);
  std::vector<BeadSection> sections;
  for (int i = 0; i < kFrames; ++i)
    sections.push_back(Bead(9 + (i % 9) * 0.5, 0, kNoisePx, &random));
  const std::vector<Interval> reach = ReachOf(sections, kNoisePx);
  double narrow = 0;
  double whole = 0;
  double bias = 0;
  for (int i = 0; i < kFrames; ++i) {
    const auto f = static_cast<std::size_t>(i);
    const double truth = Bead(9 + (i % 9) * 0.5).Sum(sections[f].band);
    bias += (sections[f].Sum(reach[f]) - truth) / kFrames;
    narrow += std::pow(sections[f].Sum(reach[f]) - truth, 2);
    whole += std::pow(sections[f].Sum(sections[f].band) - truth, 2);
  }
  EXPECT_LT(narrow, 0.4 * whole);
  EXPECT_NEAR(bias, 0, 0.01 * Bead(11).Sum({-kBandRows, kBandRows}));
}

TEST(BeadReach, IsTheWholeBandWhereTooFewFramesTell) {
  std::vector<BeadSection> sections(40, Bead(9));
  std::vector<bool> tells(sections.size());
  for (std::size_t i = 0; i < 11; ++i) tells[i] = true;
  for (const Interval& range : FindReach(sections, tells, 0.1)) {
    EXPECT_EQ(range.lo, -kBandRows);
    EXPECT_EQ(range.hi, kBandRows);
  }
  tells[11] = true;
  const std::vector<Interval> reach = FindReach(sections, tells, 0.1);
  EXPECT_LT(reach[0].hi, 12);
  EXPECT_EQ(reach[12].hi, kBandRows) << "a frame that does not tell keeps its band";
}

}  // namespace
}  // namespace trammel::pressure_advance
