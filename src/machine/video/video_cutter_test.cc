#include "machine/video/video_cutter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <iterator>
#include <string>
#include <vector>

#include "base/frame.h"
#include "machine/video/video_file.h"
#include "machine/video/video_writer.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"
#include "support/test_pictures.h"

namespace trammel::machine {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 200;
constexpr PixelRect kPart{100, 60, 45, 50};

class VideoCutterTest : public testing::Test {
 protected:
  VideoCutterTest() { Record(video(), 9); }

  static void Record(const std::filesystem::path& path, int frames) {
    auto writer = Must(VideoWriter::Create(path, 25));
    for (int i = 0; i < frames; ++i) {
      const std::string jpeg = test::JpegOf(test::TestPicture(kWidth, kHeight, 5 * i));
      CapturedFrame frame;
      frame.image.assign(jpeg.begin(), jpeg.end());
      frame.width_px = kWidth;
      frame.height_px = kHeight;
      ASSERT_TRUE(writer.Add(frame));
    }
    ASSERT_TRUE(writer.Finish());
  }
  /// The part in every frame, one after the other; the error's message behind, if any.
  static std::pair<std::vector<Frame>, std::string> ReadParts(const std::filesystem::path& path,
                                                              const PixelRect& part = kPart) {
    std::vector<Frame> frames;
    auto video = VideoFile::Open(path);
    if (!video) return {frames, video.error().message};
    for (;;) {
      const auto more = video->Advance();
      if (!more || !*more) return {frames, more ? "" : more.error().message};
      const auto frame = video->Decode(part);
      if (!frame) return {frames, frame.error().message};
      frames.push_back(**frame);
    }
  }
  [[nodiscard]] std::filesystem::path video() const { return folder_.path() / "line0.avi"; }
  [[nodiscard]] std::ptrdiff_t FilesThere() const {
    return std::distance(std::filesystem::directory_iterator(folder_.path()), {});
  }

  test::TemporaryFolder folder_;
};

void ExpectSame(const std::vector<Frame>& one, const std::vector<Frame>& other) {
  ASSERT_EQ(one.size(), other.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].bgr, other[i].bgr) << i;
    EXPECT_EQ(one[i].time_s, other[i].time_s) << i;
  }
}

TEST_F(VideoCutterTest, KeepsThePartToTheBitAndSomeFramesWhole) {
  const auto [before, fault] = ReadParts(video());
  ASSERT_EQ(fault, "");
  const auto bytes = std::filesystem::file_size(video());
  auto cut = Must(CutVideo::Write(video(), {kPart, 4, 25}, {}));
  EXPECT_EQ(std::filesystem::file_size(video()), bytes);
  ExpectSame(ReadParts(cut.path()).first, before);
  ASSERT_TRUE(cut.TakePlace());
  ExpectSame(ReadParts(video()).first, before);
  EXPECT_LT(std::filesystem::file_size(video()), bytes / 2);

  auto read = Must(VideoFile::Open(video()));
  for (int i = 0; i < 9; ++i) {
    ASSERT_EQ(read.Advance().value_or(false), true);
    EXPECT_EQ(std::pair(read.width_px(), read.height_px()), std::pair(kWidth, kHeight));
    const PixelRect held = read.readable();
    EXPECT_TRUE(Contains(held, kPart));
    EXPECT_EQ(held.width == kWidth && held.height == kHeight, i % 4 == 0) << i;
  }
}

TEST_F(VideoCutterTest, PixelsOutsideOfTheCutAreRefusedByName) {
  auto cut = CutVideo::Write(video(), {kPart, 4, 25}, {});
  ASSERT_TRUE(cut && cut->TakePlace());
  const auto [frames, message] = ReadParts(video(), {60, 60, 45, 50});
  EXPECT_EQ(frames.size(), 1U);  // the whole one
  EXPECT_THAT(message, Containing("line0.avi", "frame 2 was cut", "45x50 at (60, 60)"));
  auto whole = VideoFile::Open(video());
  ASSERT_TRUE(whole && whole->Next());
  EXPECT_FALSE(whole->Next());
}

TEST_F(VideoCutterTest, LeavesTheVideoAsItIsWhereItIsDroppedStoppedOrFindsDamage) {
  const auto bytes = std::filesystem::file_size(video());
  const auto files = FilesThere();
  { EXPECT_TRUE(CutVideo::Write(video(), {kPart, 4, 25}, {})); }
  std::stop_source stopped;
  stopped.request_stop();
  EXPECT_THAT(CutVideo::Write(video(), {kPart, 4, 25}, stopped.get_token()),
              FailsWith(ErrorKind::kInterrupted));
  EXPECT_EQ(std::filesystem::file_size(video()), bytes);
  std::filesystem::resize_file(video(), bytes / 2);
  EXPECT_FALSE(CutVideo::Write(video(), {kPart, 4, 25}, {}));
  EXPECT_EQ(std::filesystem::file_size(video()), bytes / 2);
  EXPECT_EQ(FilesThere(), files);
}

TEST_F(VideoCutterTest, AFullDiskLeavesTheVideoAsItIs) {
  const auto [before, fault] = ReadParts(video());
  const auto files = FilesThere();
  // The child's writing fails beyond a limit, as it does on a full disk.
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{5000, 5000};
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) _exit(100);
    const auto cut = CutVideo::Write(video(), {kPart, 4, 25}, {});
    _exit(cut ? 101 : cut.error().message.find("ulimit") != std::string::npos ? 0 : 102);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  ExpectSame(ReadParts(video()).first, before);
  EXPECT_EQ(FilesThere(), files);
}

TEST_F(VideoCutterTest, AKillAtAnyMomentLeavesTheWholeVideoOrTheCutOne) {
  const auto [before, fault] = ReadParts(video());
  for (int i = 0; i < 40; ++i) {
    const auto path = folder_.path() / ("kill" + std::to_string(i) + ".avi");
    std::filesystem::copy_file(video(), path);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      auto cut = CutVideo::Write(path, {kPart, 4, 25}, {});
      if (cut) (void)cut->TakePlace();
      for (;;) pause();
    }
    usleep(static_cast<useconds_t>(500 * i));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const auto [after, message] = ReadParts(path);
    EXPECT_EQ(message, "");
    ExpectSame(after, before);
  }
}

}  // namespace
}  // namespace trammel::machine
