// Noise of a picture, and discs that no single shade tells from their surroundings.
#include "part_alignment/targets/disc_by_rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/random.h"
#include "part_alignment/targets/code_book.h"
#include "part_alignment/targets/quieten.h"
#include "part_alignment/targets/ring_reader.h"
#include "support/target_picture.h"

namespace trammel::part_alignment {
namespace {

using test::DrawnTarget;
using test::Look;

Page Noise(int width, int height, double sigma, Random& random) {
  Page page;
  page.width = width;
  page.height = height;
  for (int i = 0; i < width * height; ++i) {
    page.samples.push_back(
        static_cast<std::uint8_t>(std::clamp(std::lround(random.Normal(120, sigma)), 0L, 255L)));
  }
  return page;
}

double Scatter(const std::uint8_t* first, std::size_t count) {
  double sum = 0;
  double squares = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += first[i];
    squares += first[i] * first[i];
  }
  const double mean = sum / static_cast<double>(count);
  return std::sqrt(squares / static_cast<double>(count) - mean * mean);
}

// 16 rows of 160 differences: their median is known to 3.5 %. Rounding to grey levels adds 1/12 of
// variance.
TEST(PixelNoise, IsWithinATenthOfWhatWasAdded) {
  Random random(2);
  for (const double sigma : {0.7, 1.0, 2.0, 3.3, 6.0}) {
    const Page page = Noise(640, 480, sigma, random);
    EXPECT_NEAR(PixelNoise(page.view()), std::hypot(sigma, 0.29), 0.1 * sigma + 0.05) << sigma;
  }
}

TEST(PixelNoise, OfAPictureOfOneShadeIsNone) {
  Random random(2);
  EXPECT_EQ(PixelNoise(Noise(64, 48, 0, random).view()), 0);
}

TEST(Quieten, LeavesThreeEighthsOfWhiteNoise) {
  Random random(3);
  const Page page = Noise(401, 300, 8, random);
  std::vector<std::uint8_t> quiet;
  Quieten(page.view(), quiet);
  ASSERT_EQ(quiet.size(), page.samples.size());
  // Rounding adds 1/12 of variance.
  EXPECT_NEAR(Scatter(quiet.data(), quiet.size()), 8 * 0.375, 0.2);
}

TEST(Quieten, MovesNothing) {
  Page page;
  page.width = 20;
  page.height = 18;
  page.samples.assign(20 * 18, 10);
  page.row(7)[11] = 210;
  std::vector<std::uint8_t> quiet;
  Quieten(page.view(), quiet);
  const auto at = [&](int x, int y) { return quiet[static_cast<std::size_t>(y * 20 + x)]; };
  EXPECT_NEAR(at(11, 7), 60, 1);
  EXPECT_EQ(at(10, 7), at(12, 7));
  EXPECT_EQ(at(11, 6), at(11, 8));
  EXPECT_EQ(at(10, 6), at(12, 8));
  EXPECT_EQ(at(0, 0), 10);
  EXPECT_EQ(at(19, 17), 10);
}

constexpr double kMiddle_px = 90;
constexpr double kRadius_px = 15;

Page OneTarget(const Look& look, double noise, int bits = 14) {
  DrawnTarget target = test::AffineTarget(kMiddle_px, kMiddle_px, kRadius_px, 0.5, 1, 2);
  target.bits = bits;
  target.word = MakeCodeBook(14).value().words[5];
  Random random(3);
  return test::Expose(test::Draw(180, 180, {target}, look), noise, random);
}

Run Across(int row, int first, int last) {
  Run run;
  run.row = row;
  run.first = first;
  run.last = last;
  run.dark = true;
  return run;
}

// Ink in the light is brighter than paper in the shade. The run is its lit part.
TEST(DiscByRays, FindsTheRimWithinATenthWhereAShadowsEdgeCrossesTheDisc) {
  Look look;
  look.shadow = {kMiddle_px, kMiddle_px, 0, 1, 0.1};
  const Page page = OneTarget(look, 1);
  const auto disc = FindDiscByRays(page.view(), Across(90, 75, 90), {.noise = 1});
  ASSERT_TRUE(disc);
  constexpr double kTenth_px = 0.1 * kRadius_px;
  EXPECT_NEAR(disc->column_px, kMiddle_px, kTenth_px);
  EXPECT_NEAR(disc->row_px, kMiddle_px, kTenth_px);
  EXPECT_NEAR(MeanRadius(*disc), kRadius_px * std::sqrt(std::cos(0.5)), kTenth_px);
  const auto ring = FindRingEvidence(page.view(), *disc, 1);
  ASSERT_TRUE(ring);
  EXPECT_TRUE(ring->uneven);
}

TEST(DiscByRays, SeesARingOnlyWhereThereIsOne) {
  const Look look;
  const Page with = OneTarget(look, 1);
  const Page without = OneTarget(look, 1, 0);
  const auto run = Across(90, 76, 104);
  const auto disc = FindDiscByRays(with.view(), run, {.noise = 1});
  const auto alone = FindDiscByRays(without.view(), run, {.noise = 1});
  ASSERT_TRUE(disc && alone);
  const auto ring = FindRingEvidence(with.view(), *disc, 1);
  ASSERT_TRUE(ring);
  EXPECT_FALSE(ring->uneven);
  EXPECT_NEAR(ring->contrast, -150, 5);
  EXPECT_FALSE(FindRingEvidence(without.view(), *alone, 1));
}

// Takes a view of half a target, which is enough of its ring to be seen. The rows above the view
// are in memory: a ring is seen where they are read.
TEST(DiscByRays, SeesNoRingAboutAMiddleBeyondThePicture) {
  constexpr int kCentre_px = 120;
  DrawnTarget target = test::AffineTarget(kCentre_px, kCentre_px, 40, 1, 1);
  target.bits = 14;
  target.word = 0b01010101010101;
  Random random(4);
  const Page page =
      test::Expose(test::Draw(2 * kCentre_px, 2 * kCentre_px, {target}, {}), 1, random);
  const auto disc = FindDiscByRays(page.view(), Across(kCentre_px, 96, 144), {.noise = 1});
  ASSERT_TRUE(disc);
  const auto seen_from_row = [&](int row) {
    PageView part = page.view();
    part.data = part.row(row);
    part.height -= row;
    DiscModel moved = *disc;
    moved.row_px -= row;
    return FindRingEvidence(part, moved, 1).has_value();
  };
  EXPECT_TRUE(seen_from_row(kCentre_px - 1));
  EXPECT_FALSE(seen_from_row(kCentre_px + 1));
}

TEST(DiscByRays, SeesNothingInNoise) {
  Random random(5);
  const test::GreyImage grey{180, 180, std::vector<double>(180 * 180, 128)};
  for (const double noise : {0.0, 1.0, 8.0}) {
    const Page page = test::Expose(grey, noise, random);
    for (int row = 10; row < 170; row += 8) {
      const auto run = Across(row, row - 5, row + 5);
      const auto disc = FindDiscByRays(page.view(), run, {.noise = noise});
      EXPECT_FALSE(disc && FindRingEvidence(page.view(), *disc, noise)) << noise << " row " << row;
    }
  }
}

// Every run of a small picture, those at its border and of its whole width too.
TEST(DiscByRays, LooksAtNothingBeyondThePicture) {
  const Page page = OneTarget({}, 1);
  PageView part = page.view();
  part.width = 40;
  part.height = 30;
  for (int row = 0; row < part.height; ++row) {
    for (int first = 0; first < part.width; first += 3) {
      for (int last = first; last < part.width; last += 3) {
        const auto disc = FindDiscByRays(part, Across(row, first, last), {.noise = 1});
        if (disc) (void)FindRingEvidence(part, *disc, 1);
      }
    }
  }
}

TEST(RingEvidence, LeavesOutWhatIsSeenTwiceOrWithinARing) {
  const auto at = [](double column, double radius, int clear) {
    UnreadTarget one;
    one.disc.column_px = column;
    one.disc.wxx = one.disc.wyy = 1 / radius;
    one.ring.clear = clear;
    return one;
  };
  // The same disc twice, a segment of its ring, and another target beyond it.
  std::vector<UnreadTarget> unread{at(101, 10, 30), at(100, 10, 38), at(125, 5, 35),
                                   at(175, 10, 20)};
  LeaveOutParts(unread);
  ASSERT_EQ(unread.size(), 2U);
  EXPECT_EQ(unread[0].disc.column_px, 100);
  EXPECT_EQ(unread[1].disc.column_px, 175);
}

/// A row of `values`, each as many pixels wide as stated, in a picture of rows that are all alike.
std::vector<Run> RunsOf(const std::vector<std::pair<int, int>>& values) {
  Page page;
  std::vector<std::uint8_t> row;
  for (const auto& [grey, count] : values) {
    row.insert(row.end(), static_cast<std::size_t>(count), static_cast<std::uint8_t>(grey));
  }
  page.width = static_cast<int>(row.size());
  page.height = 3;
  for (int y = 0; y < 3; ++y) page.samples.insert(page.samples.end(), row.begin(), row.end());
  RowMemory memory;
  const std::span<const Run> runs =
      RunsOfRow(page.view(), 1, {.min_px = 3, .max_px = 60, .edge_step = 5}, memory);
  return {runs.begin(), runs.end()};
}

TEST(RowRuns, TakeAShadowsEdgeWithinADiscForASideOfIt) {
  const auto runs = RunsOf({{200, 30}, {50, 15}, {10, 15}, {40, 30}});
  const auto lit = [](const auto& run) { return run.dark && run.first < 31; };
  EXPECT_TRUE(std::any_of(runs.begin(), runs.end(), lit));
}

TEST(RowRuns, LeaveOutASlightEdgeBetweenSteepOnes) {
  const auto runs = RunsOf({{200, 30}, {44, 10}, {50, 10}, {200, 30}});
  ASSERT_EQ(runs.size(), 1U);
  EXPECT_TRUE(runs[0].dark);
  EXPECT_NEAR(runs[0].last - runs[0].first, 20, 1);
}

}  // namespace
}  // namespace trammel::part_alignment
