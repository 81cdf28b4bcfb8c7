#include "machine/video/video_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "support/little_memory.h"
#include "support/sweep_world.h"

namespace trammel::machine {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

Frame Ramp(int width, int height, int phase) {
  Frame frame(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      frame.row(y)[3 * x] = static_cast<std::uint8_t>(40 + 2 * x);
      frame.row(y)[3 * x + 1] = static_cast<std::uint8_t>(60 + 2 * y);
      frame.row(y)[3 * x + 2] = static_cast<std::uint8_t>(100 + 10 * phase);
    }
  }
  return frame;
}

class VideoFileTest : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path At(const std::string& name) const {
    return folder_.path() / name;
  }
  /// Frames read before the end or the error; the error's message, if any.
  static std::pair<int, std::string> ReadAll(const std::filesystem::path& path,
                                             const VideoLimits& limits = {}) {
    auto video = VideoFile::Open(path, limits);
    if (!video) {
      EXPECT_EQ(video.error().kind, ErrorKind::kMeasurement);
      return {0, video.error().message};
    }
    for (int frames = 0;; ++frames) {
      const auto next = video->Next();
      if (!next) {
        EXPECT_EQ(next.error().kind, ErrorKind::kMeasurement);
        return {frames, next.error().message};
      }
      if (*next == nullptr) return {frames, ""};
    }
  }
  test::TemporaryFolder folder_;
};

TEST_F(VideoFileTest, GivesBackTheColoursAtOddSizes) {
  // 33 and 41: neither a multiple of the scaler's vectors nor of JPEG's blocks.
  test::WriteAvi(At("a.avi"), {Ramp(33, 41, 0), Ramp(33, 41, 5)}, 2);
  auto video = VideoFile::Open(At("a.avi"));
  ASSERT_TRUE(video.has_value()) << video.error().message;
  for (const int phase : {0, 5}) {
    const auto next = video->Next();
    ASSERT_TRUE(next.has_value() && *next != nullptr);
    const Frame expected = Ramp(33, 41, phase);
    ASSERT_EQ((*next)->bgr.size(), expected.bgr.size());
    double off = 0;
    for (std::size_t i = 0; i < expected.bgr.size(); ++i) {
      off += std::abs(int{(*next)->bgr[i]} - int{expected.bgr[i]});
    }
    // JPEG at quality 95 and halved chroma cost about a level and a half.
    EXPECT_LT(off / static_cast<double>(expected.bgr.size()), 3);
  }
}

TEST_F(VideoFileTest, APartIsThatPartOfTheWholeFrame) {
  std::vector<Frame> frames;
  for (int phase = 0; phase < 6; ++phase) frames.push_back(Ramp(67, 51, phase));
  test::WriteAvi(At("a.avi"), frames, 6);
  auto whole = VideoFile::Open(At("a.avi"));
  auto parts = VideoFile::Open(At("a.avi"));
  ASSERT_TRUE(whole && parts);
  for (const PixelRect& part : {PixelRect{0, 0, 67, 51},
                                {20, 31, 30, 11},
                                {0, 0, 5, 5},
                                {66, 50, 1, 1},
                                {20, 31, 30, 11}}) {
    const auto frame = whole->Next();
    ASSERT_TRUE(frame && *frame != nullptr);
    ASSERT_EQ(parts->Advance().value_or(false), true);
    EXPECT_EQ(parts->width_px(), 67);
    EXPECT_EQ(parts->height_px(), 51);
    const auto read = parts->Decode(part);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ((*read)->width, part.width);
    ASSERT_EQ((*read)->height, part.height);
    const BgrView expected = Crop((*frame)->view(), part);
    for (int y = 0; y < part.height; ++y) {
      EXPECT_TRUE(
          std::equal(expected.row(y), expected.row(y) + 3 * part.width, (*read)->view().row(y)))
          << y;
    }
    EXPECT_EQ((*read)->time_s, (*frame)->time_s);
  }
  // One that nobody decodes counts like the others.
  EXPECT_EQ(parts->Advance().value_or(false), true);
  EXPECT_EQ(parts->Advance().value_or(true), false);
}

TEST_F(VideoFileTest, RefusesFramesThatChangeSize) {
  test::WriteAvi(At("a.avi"), {Ramp(48, 32, 0), Ramp(48, 32, 0), Ramp(64, 32, 0)}, 3);
  const auto [frames, message] = ReadAll(At("a.avi"));
  EXPECT_EQ(frames, 2);
  EXPECT_THAT(message, AllOf(HasSubstr("64x32"), HasSubstr("48x32")));
}

TEST_F(VideoFileTest, AFrameOfAGigapixelIsRefusedBeforeItIsDecoded) {
  test::WriteAvi(At("a.avi"), std::vector<Frame>(2, Frame(64, 48)), 2);
  std::string avi = test::ReadWhole(At("a.avi"));
  const std::size_t frame = avi.find("\xFF\xC0");
  ASSERT_NE(frame, std::string::npos);
  avi.replace(frame + 5, 4, "\xFF\xDC\xFF\xDC");
  test::WriteWhole(At("large.avi"), avi);
  EXPECT_THAT(test::WithLittleMemory([&] { return ReadAll(At("large.avi")).second; }),
              AllOf(HasSubstr("frame 1"), HasSubstr("65500x65500 px")));
}

TEST_F(VideoFileTest, PixelsAndTimeInAllAreLimited) {
  test::WriteAvi(At("a.avi"), std::vector<Frame>(20, Frame(64, 48)), 20);
  VideoLimits limits;
  limits.max_pixels_in_all = 10 * 64 * 48;
  EXPECT_THAT(ReadAll(At("a.avi"), limits).second, HasSubstr("its first 11 frames"));
  limits = {};
  limits.max_decoding_s = 0;
  EXPECT_THAT(ReadAll(At("a.avi"), limits).second, HasSubstr("took over 0 s"));
}

}  // namespace
}  // namespace trammel::machine
