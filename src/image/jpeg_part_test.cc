// A part of a JPEG, beside the same pixels of the whole.
#include <gtest/gtest.h>

#include "image/jpeg_kinds_test_support.h"

namespace trammel::image {
namespace {

const std::vector<Kind> kKinds =
    KindsOfCamerasAnd({{.name = "four inks", .components = 4},
                       {.name = "progressive", .across = 2, .down = 2, .progressive = true}});

Result<Bytes> ReadPart(const Bytes& jpeg, JpegPixels pixels, const PixelRect& part) {
  auto reader = TRY(JpegReader::Open(jpeg, JpegDamage::kRefuse));
  TRY(reader.StartPart(pixels, part));
  EXPECT_EQ(reader.row_px(), part.width);
  EXPECT_EQ(reader.rows(), part.height);
  auto read = ReadRows(reader, pixels == JpegPixels::kGrey ? 1 : 3);
  if (!read) return read;
  TRY(reader.ReadRest());
  return read;
}

TEST(JpegPart, IsTheSameToTheBitAsThatPartOfTheWhole) {
  Random random(11);
  for (const Kind& kind : kKinds) {
    for (const auto& [width, height] :
         {std::pair(1, 1), {16, 16}, {67, 33}, {131, 90}, {160, 121}}) {
      const Bytes jpeg = EncodeKind(kind, width, height, random);
      for (const JpegPixels pixels : {JpegPixels::kBgr, JpegPixels::kGrey}) {
        if (kind.components == 4 && pixels == JpegPixels::kGrey) continue;  // inks come as BGR
        const std::size_t samples = pixels == JpegPixels::kGrey ? 1 : 3;
        const auto whole = ReadWhole(jpeg, pixels);
        ASSERT_TRUE(whole) << kind.name << ": " << whole.error().message;
        for (const PixelRect& part : PartsOf(width, height, 60, random)) {
          const auto read = ReadPart(jpeg, pixels, part);
          ASSERT_TRUE(read) << kind.name << ": " << read.error().message;
          EXPECT_EQ(*read, PartOf(*whole, width, samples, part))
              << kind.name << ", " << part.width << "x" << part.height << " at (" << part.x << ", "
              << part.y << ") of " << width << "x" << height;
        }
      }
    }
  }
}

// Behind the loss the picture has moved, which nothing in the part itself tells.
TEST(JpegPart, FindsBytesLostBeforeItAtTheEndOfTheData) {
  Random random(12);
  const Bytes jpeg = EncodeKind({.name = "4:2:2", .across = 2}, 320, 240, random);
  const PixelRect part{150, 150, 45, 60};
  int found = 0;
  constexpr int kLosses = 40;
  for (int i = 0; i < kLosses; ++i) {
    Bytes lost = jpeg;
    const auto at = lost.begin() + 700 + static_cast<std::ptrdiff_t>(random.Uniform() * 3000);
    lost.erase(at, at + 400);
    found += ReadPart(lost, JpegPixels::kBgr, part) ? 0 : 1;
    EXPECT_EQ(ReadPart(lost, JpegPixels::kBgr, part).has_value(),
              ReadWhole(lost, JpegPixels::kBgr).has_value());
  }
  EXPECT_EQ(found, kLosses);
}

TEST(JpegPart, RefusesDataThatEndsBehindIt) {
  Random random(13);
  Bytes jpeg = EncodeKind({.name = "4:2:0", .across = 2, .down = 2}, 320, 240, random);
  jpeg.resize(jpeg.size() * 9 / 10);
  EXPECT_FALSE(ReadPart(jpeg, JpegPixels::kBgr, {10, 10, 40, 40}));
}

}  // namespace
}  // namespace trammel::image
