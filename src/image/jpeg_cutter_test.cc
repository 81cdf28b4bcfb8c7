// A JPEG cut to a part of itself, beside the same pixels of the whole.
#include "image/jpeg_cutter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "image/jpeg_kinds_test_support.h"

namespace trammel::image {
namespace {

using ::testing::HasSubstr;

const std::vector<Kind> kKinds =
    KindsOfCamerasAnd({{.name = "grey in blocks of four", .components = 1, .across = 2, .down = 2},
                       {.name = "arithmetic", .across = 2, .down = 2, .arithmetic = true}});

/// Pixels of `part` of the whole, decoded from its cut.
Result<Bytes> ReadCut(const Bytes& cut, const PixelRect& part, JpegPixels pixels) {
  auto reader = TRY(JpegReader::Open(cut, JpegDamage::kRefuse));
  const JpegHeader& header = reader.header();
  const JpegPlace place = header.place.value_or(JpegPlace{0, 0, header.width_px, header.height_px});
  const PixelRect exact = ExactPart(place, header.grid());
  if (part.x < exact.x || part.y < exact.y || part.x + part.width > exact.x + exact.width ||
      part.y + part.height > exact.y + exact.height) {
    return Fail("the part is not exact in the cut");
  }
  TRY(reader.StartPart(pixels, {part.x - place.x, part.y - place.y, part.width, part.height}));
  return ReadRows(reader, pixels == JpegPixels::kGrey ? 1 : 3);
}

TEST(JpegCutter, KeepsEveryPixelOfThePartToTheBit) {
  Random random(21);
  for (const Kind& kind : kKinds) {
    for (const auto& [width, height] :
         {std::pair(1, 1), {16, 16}, {67, 33}, {131, 90}, {160, 121}}) {
      const Bytes jpeg = EncodeKind(kind, width, height, random);
      const auto bgr = ReadWhole(jpeg, JpegPixels::kBgr);
      const auto grey = ReadWhole(jpeg, JpegPixels::kGrey);
      ASSERT_TRUE(bgr && grey) << kind.name;
      Bytes cut;
      for (const PixelRect& part : PartsOf(width, height, 40, random)) {
        const auto where = ::testing::Message()
                           << kind.name << ", " << part.width << "x" << part.height << " at ("
                           << part.x << ", " << part.y << ") of " << width << "x" << height;
        const auto done = CutJpeg(jpeg, part, cut);
        ASSERT_TRUE(done) << where << ": " << done.error().message;
        const auto cut_bgr = ReadCut(cut, part, JpegPixels::kBgr);
        const auto cut_grey = ReadCut(cut, part, JpegPixels::kGrey);
        ASSERT_TRUE(cut_bgr) << where << ": " << cut_bgr.error().message;
        ASSERT_TRUE(cut_grey) << where << ": " << cut_grey.error().message;
        EXPECT_EQ(*cut_bgr, PartOf(*bgr, width, 3, part)) << where;
        EXPECT_EQ(*cut_grey, PartOf(*grey, width, 1, part)) << where;
      }
    }
  }
}

// Without the margin chroma at the part's ends would be interpolated from other neighbours.
TEST(JpegCutter, KeepsWholeMcusAndAChromaSampleAround) {
  const auto numbers = [](const PixelRect& rect) {
    return std::tuple(rect.x, rect.y, rect.width, rect.height);
  };
  const JpegGrid grid{1280, 720, 16, 8};
  EXPECT_EQ(numbers(CutAround({838, 341, 45, 60}, grid)), std::tuple(832, 336, 64, 72));
  EXPECT_EQ(numbers(CutAround({834, 337, 60, 62}, grid)), std::tuple(832, 336, 64, 64));
  EXPECT_EQ(numbers(CutAround({833, 336, 62, 64}, grid)), std::tuple(816, 328, 96, 80));
  EXPECT_EQ(numbers(CutAround({1270, 0, 10, 7}, {1280, 715, 16, 8})), std::tuple(1264, 0, 16, 8));
  EXPECT_EQ(numbers(CutAround({98, 0, 1, 1}, {99, 50, 16, 8})), std::tuple(80, 0, 19, 8));
  EXPECT_EQ(numbers(CutAround({99, 0, 2, 1}, {101, 50, 16, 8})), std::tuple(96, 0, 5, 8));
  EXPECT_EQ(numbers(ExactPart({816, 328, 1280, 720}, {96, 88, 16, 8})),
            std::tuple(818, 329, 92, 86));
  EXPECT_EQ(numbers(ExactPart({1248, 0, 1280, 715}, {32, 24, 16, 8})), std::tuple(1250, 0, 30, 23));
}

TEST(JpegCutter, SaysWhereTheCutLies) {
  Random random(22);
  const Bytes jpeg = EncodeKind({.name = "4:2:2", .across = 2}, 320, 200, random);
  Bytes cut;
  ASSERT_TRUE(CutJpeg(jpeg, {100, 50, 20, 30}, cut));
  const auto reader = JpegReader::Open(cut, JpegDamage::kRefuse);
  ASSERT_TRUE(reader);
  const auto& place = reader->header().place;
  ASSERT_TRUE(place);
  EXPECT_EQ(std::tuple(place->x, place->y, place->whole_width, place->whole_height),
            std::tuple(96, 48, 320, 200));
  EXPECT_EQ(std::pair(reader->header().width_px, reader->header().height_px), std::pair(32, 40));
  EXPECT_FALSE(JpegReader::Open(jpeg, JpegDamage::kRefuse)->header().place);
}

TEST(JpegCutter, IsOfAFewBytesOfTheWhole) {
  Random random(23);
  const Bytes jpeg = EncodeKind({.name = "4:2:2", .across = 2}, 640, 480, random);
  Bytes cut;
  ASSERT_TRUE(CutJpeg(jpeg, {300, 200, 45, 60}, cut));
  EXPECT_LT(cut.size(), jpeg.size() / 20);  // of a thirtieth of the pixels
}

TEST(JpegCutter, RefusesByNameWhatItCannotCut) {
  Random random(24);
  const PixelRect part{20, 20, 10, 10};
  Bytes cut;
  const auto why = [&](const Bytes& jpeg, const PixelRect& of) {
    const auto done = CutJpeg(jpeg, of, cut);
    return done ? std::string("cut") : done.error().message;
  };
  const auto encode = [&](const Kind& kind) { return EncodeKind(kind, 200, 100, random); };
  EXPECT_THAT(why(encode({.name = "progressive", .progressive = true}), part),
              HasSubstr("several scans"));
  EXPECT_THAT(why(encode({.name = "four inks", .components = 4}), part),
              HasSubstr("neither grey nor of 3 colours"));
  Bytes jpeg = encode({.name = "chroma of two thirds", .across = 2});
  constexpr std::uint8_t kStartOfFrame = 0xC0;
  const auto frame = std::adjacent_find(
      jpeg.begin(), jpeg.end(), [](int a, int b) { return a == 0xFF && b == kStartOfFrame; });
  *(frame + 14) = 0x31;  // of the second component
  EXPECT_THAT(why(jpeg, part), HasSubstr("ampling"));
  jpeg = encode({.name = "4:4:4"});
  for (const PixelRect& outside : {PixelRect{-1, 0, 9, 9},
                                   {0, 95, 9, 9},
                                   {195, 0, 9, 9},
                                   {10, 10, 0, 5},
                                   {10, 10, 5, -5},
                                   {0, 0, 201, 100}}) {
    EXPECT_THAT(why(jpeg, outside), HasSubstr("does not lie within it"));
  }
  ASSERT_EQ(why(jpeg, part), "cut");
  const Bytes once = cut;
  EXPECT_THAT(why(once, {0, 0, 8, 8}), HasSubstr("cut before"));
  EXPECT_THAT(why({}, part), HasSubstr("rejects"));
}

// Neither a crash nor a picture that the reader would have refused.
TEST(JpegCutter, RefusesDamageWhereverItIs) {
  Random random(25);
  const PixelRect part{40, 40, 30, 30};
  const auto at = [&](const Bytes& jpeg) {
    return std::min(jpeg.size() - 1,
                    static_cast<std::size_t>(random.Uniform() * static_cast<double>(jpeg.size())));
  };
  Bytes cut;
  for (const Kind& kind : kKinds) {
    const Bytes jpeg = EncodeKind(kind, 160, 120, random);
    for (int i = 0; i < 200; ++i) {
      Bytes damaged = jpeg;
      if (i % 2 == 0) {
        damaged.resize(at(jpeg));
      } else {
        for (int k = 0; k < 3; ++k) {
          damaged[at(jpeg)] = static_cast<std::uint8_t>(256 * random.Uniform());
        }
      }
      if (!CutJpeg(damaged, part, cut)) continue;
      const auto whole = ReadWhole(damaged, JpegPixels::kBgr);
      ASSERT_TRUE(whole) << kind.name << ", damage " << i << ": " << whole.error().message;
      EXPECT_EQ(ReadCut(cut, part, JpegPixels::kBgr).value_or(Bytes{}),
                PartOf(*whole, JpegReader::Open(damaged, JpegDamage::kRefuse)->header().width_px, 3,
                       part))
          << kind.name << ", damage " << i;
    }
  }
}

TEST(JpegPlace, ThatCannotBeIsRefused) {
  Random random(26);
  const Bytes jpeg = EncodeKind({.name = "4:2:0", .across = 2, .down = 2}, 64, 48, random);
  const auto with = [&](const JpegPlace& place) {
    const auto bytes = FormatPlace(place);
    Bytes marked = {0xFF, 0xD8, 0xFF, kPlaceMarker, 0, kPlaceBytes + 2};
    marked.insert(marked.end(), bytes.begin(), bytes.end());
    marked.insert(marked.end(), jpeg.begin() + 2, jpeg.end());
    return JpegReader::Open(marked, JpegDamage::kRefuse);
  };
  EXPECT_TRUE(with({16, 32, 100, 100}));
  EXPECT_TRUE(with({16, 32, 80, 80}));
  for (const JpegPlace& wrong : {JpegPlace{16, 32, 79, 100},
                                 {16, 32, 100, 79},
                                 {8, 32, 100, 100},
                                 {16, 40, 100, 100},
                                 {0, 0, 0, 0},
                                 {65520, 0, 65535, 100}}) {
    const auto read = with(wrong);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, HasSubstr("cannot be"));
  }
}

}  // namespace
}  // namespace trammel::image
