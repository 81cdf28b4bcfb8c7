// Raw pixels of every format that is read, and the wall clock's stamps.
#include "machine/camera/raw_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "machine/camera/camera.h"
#include "support/matchers.h"

namespace trammel::machine {
namespace {

constexpr std::uint32_t kMono8 = 0x01080001;
constexpr std::uint32_t kRgb8 = 0x02180014;
constexpr std::uint32_t kBgr8 = 0x02180015;
constexpr std::uint32_t kMono16 = 0x01100007;

Frame Decoded(const Result<std::vector<std::uint8_t>>& picture) {
  EXPECT_TRUE(picture) << (picture ? "" : picture.error().message);
  if (!picture) return {};
  CapturedFrame captured;
  captured.image = *picture;
  return Must(DecodeFrame(captured));
}

TEST(RawPicture, GreyComesBackAsItWasWithoutTheRowsPadding) {
  constexpr int kWidth = 7;
  constexpr int kHeight = 5;
  constexpr std::size_t kPadding = 3;
  std::vector<std::uint8_t> bytes;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) bytes.push_back(static_cast<std::uint8_t>(40 * y + 5 * x));
    bytes.insert(bytes.end(), kPadding, 255);
  }
  const Frame frame = Decoded(ToPicture({kMono8, kWidth, kHeight, kPadding, bytes}, 0));
  ASSERT_EQ(frame.width, kWidth);
  ASSERT_EQ(frame.height, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        EXPECT_EQ(frame.view().row(y)[3 * x + channel], 40 * y + 5 * x);
      }
    }
  }
}

TEST(RawPicture, ColoursOfBothOrders) {
  const std::array<std::uint8_t, 3> bytes = {10, 20, 30};
  EXPECT_EQ(Decoded(ToPicture({kRgb8, 1, 1, 0, bytes}, 0)).bgr,
            (std::vector<std::uint8_t>{30, 20, 10}));
  EXPECT_EQ(Decoded(ToPicture({kBgr8, 1, 1, 0, bytes}, 0)).bgr,
            (std::vector<std::uint8_t>{10, 20, 30}));
}

// A scene of one colour: whatever the pattern, each pixel of the picture has that colour.
TEST(RawPicture, EveryBayerPatternGivesTheColourOfTheScene) {
  constexpr std::uint8_t kRed = 200;
  constexpr std::uint8_t kGreen = 120;
  constexpr std::uint8_t kBlue = 40;
  struct Pattern {
    std::uint32_t code;
    std::string first_four;  ///< rows (0, 1) of columns (0, 1)
  };
  for (const Pattern& pattern : {Pattern{0x01080008, "GRBG"}, Pattern{0x01080009, "RGGB"},
                                 Pattern{0x0108000A, "GBRG"}, Pattern{0x0108000B, "BGGR"}}) {
    constexpr int kSize = 8;
    std::vector<std::uint8_t> bytes;
    for (int y = 0; y < kSize; ++y) {
      for (int x = 0; x < kSize; ++x) {
        const char colour = pattern.first_four[static_cast<std::size_t>(2 * (y % 2) + x % 2)];
        bytes.push_back(colour == 'R' ? kRed : colour == 'G' ? kGreen : kBlue);
      }
    }
    const Frame frame = Decoded(ToPicture({pattern.code, kSize, kSize, 0, bytes}, 0));
    ASSERT_EQ(frame.width, kSize) << pattern.first_four;
    for (std::size_t i = 0; i < frame.bgr.size(); i += 3) {
      ASSERT_EQ(frame.bgr[i], kBlue) << pattern.first_four;
      ASSERT_EQ(frame.bgr[i + 1], kGreen) << pattern.first_four;
      ASSERT_EQ(frame.bgr[i + 2], kRed) << pattern.first_four;
    }
  }
}

TEST(RawPicture, WhatCannotBeReadIsNamed) {
  const std::vector<std::uint8_t> bytes(16, 1);
  EXPECT_THAT(ToPicture({kMono16, 2, 4, 0, bytes}, 0),
              FailsWith("0x01100007", "Mono8", "BayerRG8"));
  EXPECT_THAT(ToPicture({kMono8, 5, 4, 0, bytes}, 0), FailsWith("16 bytes", "5x4"));
  EXPECT_FALSE(ToPicture({kMono8, 4, 4, 1, bytes}, 0));
  EXPECT_FALSE(ToPicture({kMono8, 4, 4, SIZE_MAX, bytes}, 0));
  EXPECT_FALSE(ToPicture({kMono8, 0, 4, 0, bytes}, 0));
  EXPECT_FALSE(ToPicture({kMono8, -4, -4, 0, bytes}, 0));
  EXPECT_FALSE(ToPicture({kMono8, 2'000'000'000, 2'000'000'000, 0, bytes}, 0));
  EXPECT_FALSE(ToPicture({kMono8, 4, 4, 0, {}}, 0));
  constexpr int kTooLong_px = 65501;
  const std::vector<std::uint8_t> line(kTooLong_px, 1);
  for (const int quality : {0, 95}) {
    EXPECT_THAT(ToPicture({kMono8, kTooLong_px, 1, 0, line}, quality),
                FailsWith("65501x1", "65500 px"));
    EXPECT_TRUE(ToPicture({kMono8, kTooLong_px - 1, 1, 0, line}, quality));
  }
}

constexpr double kEpoch_s = 1.7e9;
// Resolution of a double at 1.7e9 s.
constexpr double kGrain_s = 1e-6;

TEST(WallStamps, LieOnTheMonotonicClock) {
  WallStamps stamps;
  const auto stamp = Must(stamps.OnHostClock(kEpoch_s + 9.97, kEpoch_s + 10, 50));
  EXPECT_NEAR(stamp, 49.97, kGrain_s);
  EXPECT_FALSE(stamps.OnHostClock(0, kEpoch_s + 11, 51)) << "missing";
  EXPECT_FALSE(stamps.OnHostClock(kEpoch_s + 13, kEpoch_s + 12, 52)) << "in the future";
}

TEST(WallStamps, AreDoubtedForAWhileAfterTheClockWasSet) {
  WallStamps stamps;
  ASSERT_TRUE(stamps.OnHostClock(kEpoch_s + 9.97, kEpoch_s + 10, 50));
  constexpr double kSet_s = -3600;
  const auto at = [&](double host_s) {
    return stamps.OnHostClock(kEpoch_s + kSet_s + host_s - 40.03, kEpoch_s + kSet_s + host_s - 40,
                              host_s);
  };
  EXPECT_FALSE(at(51));
  EXPECT_FALSE(at(52.5));
  const auto again = Must(at(53.5));
  EXPECT_NEAR(again, 53.47, kGrain_s);
}

}  // namespace
}  // namespace trammel::machine
