// A part of a JPEG taken out undecoded, beside the same pixels of the whole.
#include "image/jpeg_excerpt.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "image/jpeg_kinds_test_support.h"
#include "image/jpeg_reader.h"

namespace trammel::image {
namespace {

const std::vector<Kind> kKinds = KindsOfCameras();

/// Pixels of `part` of the whole, decoded from what was taken out.
Result<Bytes> ReadExcerpt(const JpegExcerpter& excerpter, const PixelRect& part) {
  auto reader = JpegReader::Open(excerpter.bytes(), JpegDamage::kRefuse);
  if (!reader) return tl::unexpected(reader.error());
  const PixelRect& rect = excerpter.rect();
  auto started = reader->StartPart(JpegPixels::kBgr,
                                   {part.x - rect.x, part.y - rect.y, part.width, part.height});
  if (!started) return tl::unexpected(started.error());
  return ReadRows(*reader, 3);
}

std::size_t Anywhere(std::size_t size, Random& random) {
  return std::min(size - 1, static_cast<std::size_t>(random.Uniform() * static_cast<double>(size)));
}

TEST(JpegExcerpt, HasThePixelsOfTheWholeToTheBit) {
  Random random(31);
  for (const Kind& kind : kKinds) {
    JpegExcerpter excerpter;
    for (const auto& [width, height] :
         {std::pair(1, 1), {16, 16}, {67, 33}, {131, 90}, {160, 121}}) {
      const Bytes jpeg = EncodeKind(kind, width, height, random);
      const auto whole = ReadWhole(jpeg, JpegPixels::kBgr);
      ASSERT_TRUE(whole) << kind.name;
      for (const PixelRect& part : PartsOf(width, height, 40, random)) {
        const auto where = ::testing::Message()
                           << kind.name << ", " << part.width << "x" << part.height << " at ("
                           << part.x << ", " << part.y << ") of " << width << "x" << height;
        ASSERT_TRUE(excerpter.Take(jpeg, part)) << where;
        const auto read = ReadExcerpt(excerpter, part);
        ASSERT_TRUE(read) << where << ": " << read.error().message;
        EXPECT_EQ(*read, PartOf(*whole, width, 3, part)) << where;
      }
    }
  }
}

// One excerpter is for a camera, which may change its tables from picture to picture.
TEST(JpegExcerpt, FollowsTablesThatChange) {
  Random random(32);
  const PixelRect part{40, 40, 30, 30};
  JpegExcerpter excerpter;
  for (int round = 0; round < 2; ++round) {
    for (const Kind& kind : kKinds) {
      const Bytes jpeg = EncodeKind(kind, 160, 120, random);
      ASSERT_TRUE(excerpter.Take(jpeg, part)) << kind.name;
      EXPECT_EQ(ReadExcerpt(excerpter, part).value_or(Bytes{}),
                PartOf(*ReadWhole(jpeg, JpegPixels::kBgr), 160, 3, part))
          << kind.name;
    }
  }
}

TEST(JpegExcerpt, LeavesOtherKindsToTheDecoder) {
  Random random(33);
  JpegExcerpter excerpter;
  for (const Kind& kind :
       {Kind{.name = "progressive", .progressive = true},
        Kind{.name = "arithmetic", .arithmetic = true}, Kind{.name = "four inks", .components = 4},
        Kind{.name = "grey in blocks", .components = 1, .across = 2}}) {
    EXPECT_FALSE(excerpter.Take(EncodeKind(kind, 160, 120, random), {40, 40, 30, 30})) << kind.name;
  }
  EXPECT_FALSE(excerpter.Take({}, {0, 0, 8, 8}));
}

// Bytes lost before the part move the picture, those behind it cannot: both are missed, as by a
// decoder that reads all of it.
TEST(JpegExcerpt, MissesBytesLostAnywhere) {
  Random random(34);
  const PixelRect part{150, 120, 45, 30};
  for (const Kind& kind : kKinds) {
    const Bytes jpeg = EncodeKind(kind, 320, 240, random);
    JpegExcerpter excerpter;
    int missed = 0;
    constexpr int kLosses = 60;
    constexpr int kFewest = 58;  // what is left may by chance be as many blocks as before
    for (int i = 0; i < kLosses; ++i) {
      Bytes lost = jpeg;
      const auto at = static_cast<std::ptrdiff_t>(700 + Anywhere(jpeg.size() - 1200, random));
      lost.erase(lost.begin() + at, lost.begin() + at + 400);
      const bool taken = excerpter.Take(lost, part);
      missed += taken ? 0 : 1;
      if (taken) EXPECT_TRUE(ReadWhole(lost, JpegPixels::kBgr)) << kind.name << ", loss " << i;
    }
    EXPECT_GE(missed, kFewest) << kind.name;
  }
}

// Whatever the damage: what is taken out is what the decoder makes of the whole, or nothing is.
TEST(JpegExcerpt, TakesNothingThatTheDecoderWouldRefuse) {
  Random random(35);
  const PixelRect part{40, 40, 30, 30};
  int taken = 0;
  for (const Kind& kind : kKinds) {
    const Bytes jpeg = EncodeKind(kind, 160, 120, random);
    JpegExcerpter excerpter;
    for (int i = 0; i < 400; ++i) {
      Bytes damaged = jpeg;
      if (i % 4 == 0) {
        damaged.resize(Anywhere(jpeg.size(), random));
      } else {
        damaged[Anywhere(jpeg.size(), random)] = static_cast<std::uint8_t>(256 * random.Uniform());
      }
      const auto reader = JpegReader::Open(damaged, JpegDamage::kRefuse);
      const int width = reader ? reader->header().width_px : 0;
      const int height = reader ? reader->header().height_px : 0;
      if (width < part.x + part.width || height < part.y + part.height) continue;
      if (!excerpter.Take(damaged, part)) continue;
      ++taken;
      const auto read = ReadExcerpt(excerpter, part);
      if (!read) continue;  // the caller turns to the whole
      const auto whole = ReadWhole(damaged, JpegPixels::kBgr);
      ASSERT_TRUE(whole) << kind.name << ", damage " << i << ": " << whole.error().message;
      EXPECT_EQ(*read, PartOf(*whole, width, 3, part)) << kind.name << ", damage " << i;
    }
  }
  EXPECT_GT(taken, 100);  // a byte of a number, or of the header's remarks
}

}  // namespace
}  // namespace trammel::image
