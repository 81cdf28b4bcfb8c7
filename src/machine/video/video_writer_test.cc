#include "machine/video/video_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "machine/video/video_file.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"
#include "support/test_pictures.h"

namespace trammel::machine {
namespace {

using ::testing::ElementsAre;

CapturedFrame FrameOf(int phase, int width = 64, int height = 48) {
  const std::string jpeg = test::JpegOf(test::TestPicture(width, height, phase));
  CapturedFrame frame;
  frame.image.assign(jpeg.begin(), jpeg.end());
  frame.width_px = width;
  frame.height_px = height;
  frame.arrival_s = 100 + phase / 30.0;
  frame.captured = CameraTime{50 + phase / 30.0, CameraClock::kCameraMonotonic};
  return frame;
}

/// Frames that decode before the end or the first error, whose text follows.
std::pair<std::size_t, std::string> Decodable(const std::filesystem::path& path) {
  auto video = VideoFile::Open(path);
  if (!video) return {0, video.error().message};
  for (std::size_t frames = 0;; ++frames) {
    const auto next = video->Next();
    if (!next) return {frames, next.error().message};
    if (*next == nullptr) return {frames, ""};
  }
}

/// The lines of the times beside a video, without their two of head.
std::vector<std::string> TimesOf(const std::filesystem::path& video) {
  std::istringstream text(test::ReadWhole(FrameTimesPath(video)));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) {
    if (!line.starts_with('#')) lines.push_back(line);
  }
  return lines;
}

class VideoWriterTest : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path At(const std::string& name) const {
    return folder_.path() / name;
  }
  test::TemporaryFolder folder_;
};

TEST_F(VideoWriterTest, GivesBackPicturesByteForByteAndTimes) {
  auto writer = Must(VideoWriter::Create(At("a.avi")));
  for (int i = 0; i < 7; ++i) {
    CapturedFrame frame = FrameOf(i);
    if (i == 3) frame.fault = FrameFault::kCutOff;
    if (i == 4) frame.sequence = 17;
    ASSERT_TRUE(writer.Add(frame));
  }
  EXPECT_EQ(writer.frames(), 6);
  ASSERT_TRUE(writer.Finish());
  EXPECT_EQ(Decodable(At("a.avi")), (std::pair<std::size_t, std::string>{6, ""}));

  auto source = Must(OpenCamera(At("a.avi")));
  for (const int i : {0, 1, 2, 4, 5, 6}) {
    const auto frame = source->Next(1, {});
    ASSERT_TRUE(frame && *frame);
    EXPECT_EQ((*frame)->image, FrameOf(i).image) << i;
  }
  EXPECT_FALSE(*source->Next(1, {}));

  EXPECT_THAT(TimesOf(At("a.avi")), ElementsAre("0 100.000000 50.000000 camera - - - none",
                                                "1 100.033333 50.033333 camera - - - none",
                                                "2 100.066667 50.066667 camera - - - none",
                                                "- 100.100000 50.100000 camera - - - cut_off",
                                                "3 100.133333 50.133333 camera - - 17 none",
                                                "4 100.166667 50.166667 camera - - - none",
                                                "5 100.200000 50.200000 camera - - - none"));
}

TEST_F(VideoWriterTest, KeepsEveryFrameAddedBeforeAKill) {
  // A child adds frames and reports each by a byte; it is killed in the middle of its work.
  for (const int kill_after : {1, 2, 9, 40}) {
    const auto path = At("kill" + std::to_string(kill_after) + ".avi");
    int reports[2];
    ASSERT_EQ(pipe(reports), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      auto writer = VideoWriter::Create(path);
      const CapturedFrame frame = FrameOf(1);
      while (writer && writer->Add(frame) && write(reports[1], "x", 1) == 1) {
      }
      _exit(1);
    }
    close(reports[1]);
    std::size_t reported = 0;
    char byte = 0;
    while (reported < static_cast<std::size_t>(kill_after) && read(reports[0], &byte, 1) == 1) {
      ++reported;
    }
    kill(child, SIGKILL);
    while (read(reports[0], &byte, 1) == 1) ++reported;
    close(reports[0]);
    waitpid(child, nullptr, 0);
    const auto [frames, message] = Decodable(path);
    EXPECT_EQ(message, "");
    EXPECT_GE(frames, reported);
    EXPECT_GE(TimesOf(path).size(), reported);
  }
}

TEST_F(VideoWriterTest, IsReadableWhereverItsEndIsMissing) {
  std::size_t header = 0;
  std::size_t one = 0;
  {
    auto writer = Must(VideoWriter::Create(At("a.avi")));
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(writer.Add(FrameOf(0)));
      if (i == 0) one = std::filesystem::file_size(At("a.avi"));
    }
    const std::size_t all = std::filesystem::file_size(At("a.avi"));
    header = one - (all - one) / 2;
  }
  const std::string whole = test::ReadWhole(At("a.avi"));
  const std::size_t frame = one - header;
  // A frame whose chunk is not whole must be left out, and never make the others unreadable.
  for (std::size_t size = one; size <= whole.size(); size += 37) {
    test::WriteWhole(At("cut.avi"), whole.substr(0, size));
    const auto [frames, message] = Decodable(At("cut.avi"));
    EXPECT_EQ(message, "") << size;
    EXPECT_GE(frames, (size - header) / frame) << size;
    EXPECT_LE(frames, (size + 1 - header) / frame) << size;
  }
}

TEST_F(VideoWriterTest, SaysWhatIsSafeWhenTheDiskIsFull) {
  // A limit on the size of files answers a write like a full disk does: partly, then not at all.
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    auto writer = VideoWriter::Create(At("full.avi"));
    const rlimit limit{20'000, 20'000};
    if (!writer || setrlimit(RLIMIT_FSIZE, &limit) != 0) _exit(100);
    Result<void> added;
    while ((added = writer->Add(FrameOf(2)))) {
    }
    const auto again = writer->Add(FrameOf(2));
    const auto finished = writer->Finish();
    const std::string expected = "The " + std::to_string(Decodable(At("full.avi")).first);
    const bool right =
        added.error().kind == ErrorKind::kInput && !again && !finished &&
        added.error().message.find(expected + " frames before it are safe") != std::string::npos;
    std::ofstream(At("message")) << "x";
    _exit(right ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  const auto [frames, message] = Decodable(At("full.avi"));
  EXPECT_EQ(message, "");
  EXPECT_GT(frames, 3);
  EXPECT_EQ(TimesOf(At("full.avi")).size(), frames);
}

TEST_F(VideoWriterTest, RefusesWhatDoesNotFit) {
  EXPECT_THAT(VideoWriter::Create(At("none/a.avi")), FailsWith("none/a.avi"));
  auto writer = Must(VideoWriter::Create(At("a.avi")));
  EXPECT_THAT(VideoWriter::Create(At("a.avi")), FailsWith("exists already"));
  ASSERT_TRUE(writer.Add(FrameOf(0)));
  EXPECT_THAT(writer.Add(FrameOf(0, 32, 24)), FailsWith("32x24", "64x48"));
  CapturedFrame png = FrameOf(0);
  png.image[0] = 0x89;
  EXPECT_FALSE(writer.Add(png));
  ASSERT_TRUE(writer.Add(FrameOf(1)));
  ASSERT_TRUE(writer.Finish());
  EXPECT_EQ(Decodable(At("a.avi")).first, 2);
}

}  // namespace
}  // namespace trammel::machine
