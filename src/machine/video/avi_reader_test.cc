#include "machine/video/avi_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "support/matchers.h"
#include "support/sweep_world.h"

namespace trammel::machine {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::size_t kMaxBytes = 1 << 20;

std::string Little(std::uint64_t value, int bytes = 4) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i));
  return text;
}

std::string Chunk(const std::string& tag, const std::string& body) {
  return tag + Little(body.size()) + body + std::string(body.size() % 2, '\0');
}

/// The outline of a JPEG of 64 x 48 px with a number in it.
std::string Jpeg(int number) {
  return std::string("\xFF\xD8\xFF\xC0\0\x11\x08\0\x30\0\x40\3\1\x22\0\2\x11\1\3\x11\1", 21) +
         std::string(static_cast<std::size_t>(number), '\x2A') + "\xFF\xD9";
}

std::string Head(const std::string& codec, int streams_before = 0, std::uint32_t height = 48) {
  std::string streams;
  for (int i = 0; i < streams_before; ++i) {
    streams += Chunk("LIST", "strl" + Chunk("strh", "auds" + std::string(52, '\0')));
  }
  const std::string stream = "vids" + codec + std::string(12, '\0') + Little(2) + Little(50) +
                             Little(0) + std::string(24, '\0');
  const std::string format = Little(40) + Little(64) + Little(height) + Little(1, 2) +
                             Little(24, 2) + codec + std::string(20, '\0');
  streams += Chunk("LIST", "strl" + Chunk("strh", stream) + Chunk("strf", format));
  return Chunk("LIST", "hdrl" + Chunk("avih", std::string(56, '\0')) + streams);
}

std::string Riff(const std::string& body) { return Chunk("RIFF", "AVI " + body); }

class AviReaderTest : public testing::Test {
 protected:
  std::filesystem::path Written(const std::string& bytes) {
    test::WriteWhole(folder_.path() / "a.avi", bytes);
    return folder_.path() / "a.avi";
  }
  /// Bytes of each frame, or the error in its place.
  std::vector<std::string> Read(const std::string& bytes) {
    auto avi = AviReader::Open(Written(bytes), kMaxBytes);
    if (!avi) return {avi.error().message};
    std::vector<std::string> read;
    for (AviFrame frame;;) {
      const auto more = avi->Next(frame);
      if (!more) read.push_back(more.error().message);
      if (!more || !*more) return read;
      read.emplace_back(frame.bytes.begin(), frame.bytes.end());
    }
  }
  test::TemporaryFolder folder_;
};

TEST_F(AviReaderTest, GivesTheFramesInOrderWithTheirTimes) {
  const std::string movie =
      Chunk("00dc", Jpeg(1)) + Chunk("00dc", "") + Chunk("JUNK", "xyz") + Chunk("00db", Jpeg(2));
  auto avi =
      Must(AviReader::Open(Written(Riff(Head("MJPG") + Chunk("LIST", "movi" + movie))), kMaxBytes));
  EXPECT_EQ(avi.width_px(), 64);
  EXPECT_EQ(avi.height_px(), 48);
  AviFrame frame;
  ASSERT_EQ(avi.Next(frame).value_or(false), true);
  EXPECT_DOUBLE_EQ(frame.time_s.value_or(-1), 0);
  ASSERT_EQ(avi.Next(frame).value_or(false), true);
  constexpr double kPeriod_s = 2.0 / 50;
  EXPECT_DOUBLE_EQ(frame.time_s.value_or(-1), 2 * kPeriod_s) << "an empty chunk took one";
  EXPECT_EQ(avi.Next(frame).value_or(true), false);
}

TEST_F(AviReaderTest, ReadsListsWithinListsAndFurtherSegments) {
  const std::string first = Chunk("LIST", "rec " + Chunk("01dc", Jpeg(1)) + Chunk("00wb", "sound"));
  const std::string more = Chunk("RIFF", "AVIX" + Chunk("LIST", "movi" + Chunk("01dc", Jpeg(2))));
  EXPECT_THAT(
      Read(Riff(Head("mjpg", 1) + Chunk("LIST", "movi" + first) + Chunk("idx1", "wrong")) + more),
      ElementsAre(Jpeg(1), Jpeg(2)));
}

TEST_F(AviReaderTest, OtherVideosAreRefusedWithTheCommandThatConvertsThem) {
  const std::string movie = Chunk("LIST", "movi" + Chunk("00dc", Jpeg(1)));
  const auto foreign = ElementsAre(HasSubstr("ffmpeg -i IN -c:v mjpeg -q:v 2 OUT.avi"));
  EXPECT_THAT(Read(Riff(Head("H264") + movie)), foreign);
  EXPECT_THAT(Read(Riff(Head("MJPG", 0, 96) + movie)), foreign) << "two fields a frame";
  EXPECT_THAT(Read(Riff(movie)), foreign);
  EXPECT_THAT(Read("\x1A\x45\xDF\xA3 a Matroska file"), foreign);
  EXPECT_THAT(Read("#EXTM3U\n#EXTINF:10,\n/etc/passwd\n"), foreign) << "a list of other files";
}

TEST_F(AviReaderTest, NamesWhereAFinishedFileIsDamaged) {
  const std::string good = Chunk("00dc", Jpeg(1));
  const auto damaged = Read(Riff(
      Head("MJPG") + Chunk("LIST", "movi" + good + std::string(8, '\0') + Chunk("00dc", Jpeg(2)))));
  ASSERT_EQ(damaged.size(), 2U);
  EXPECT_THAT(damaged[1], HasSubstr("frame 2 is damaged or cut off, at byte"));
  std::string long_chunk = Chunk("00dc", Jpeg(2));
  long_chunk.replace(4, 4, "\xFF\xFF\xFF\xFF");
  const auto beyond = Read(Riff(Head("MJPG") + Chunk("LIST", "movi" + good + long_chunk)));
  ASSERT_EQ(beyond.size(), 2U);
  EXPECT_THAT(beyond[1], HasSubstr("frame 2"));
}

TEST_F(AviReaderTest, EndsWhereAKilledRecorderEnded) {
  std::string file = Riff(Head("MJPG") + Chunk("LIST", "movi"));
  file.replace(4, 4, std::string(4, '\0'));
  file.replace(file.size() - 8, 4, std::string(4, '\0'));
  file += Chunk("00dc", Jpeg(1)) + Chunk("00dc", Jpeg(2));
  EXPECT_THAT(Read(file), ElementsAre(Jpeg(1), Jpeg(2)));
  EXPECT_THAT(Read(file + std::string(100, '\0')), ElementsAre(Jpeg(1), Jpeg(2)));
  EXPECT_THAT(Read(file.substr(0, file.size() - 3)), ElementsAre(Jpeg(1)));
}

TEST_F(AviReaderTest, SkipsIndicesAndCountsThatLie) {
  const std::string movie = Chunk("LIST", "movi" + Chunk("00dc", Jpeg(1)));
  std::string index = Chunk("idx1", "00dc" + Little(0x10) + Little(0xFFFFFFF0U) + Little(1U << 30));
  EXPECT_THAT(Read(Riff(Head("MJPG") + movie + index)), ElementsAre(Jpeg(1)));
  index.replace(4, 4, "\xFF\xFF\xFF\x7F");
  EXPECT_THAT(Read(Riff(Head("MJPG") + movie + index)), ElementsAre(Jpeg(1)));
}

TEST_F(AviReaderTest, RefusesAFrameOfMoreBytesThanAskedFor) {
  const std::string movie = Chunk("00dc", Jpeg(1)) + Chunk("00dc", Jpeg(kMaxBytes));
  const auto read = Read(Riff(Head("MJPG") + Chunk("LIST", "movi" + movie)));
  ASSERT_EQ(read.size(), 2U);
  EXPECT_THAT(read[1], HasSubstr("more than the 1048576 that are read"));
}

TEST_F(AviReaderTest, ReadsFramesBeyondThreeGigabytes) {
  constexpr std::uint64_t kHole = 3'000'000'000;
  const std::string last = Chunk("00dc", Jpeg(2));
  const std::string list =
      "movi" + Chunk("00dc", Jpeg(1)) + "JUNK" + Little(kHole);  // and as many bytes
  const std::uint64_t list_bytes = list.size() + kHole + last.size();
  const std::string body = "AVI " + Head("MJPG") + "LIST" + Little(list_bytes) + list;
  const auto path = Written("RIFF" + Little(body.size() + kHole + last.size()) + body);
  const auto end = std::filesystem::file_size(path) + kHole;
  std::filesystem::resize_file(path, end);  // takes no room on the disk
  std::ofstream(path, std::ios::binary | std::ios::app) << last;
  auto avi = Must(AviReader::Open(path, kMaxBytes));
  AviFrame frame;
  ASSERT_TRUE(avi.Next(frame));
  ASSERT_EQ(avi.Next(frame).value_or(false), true);
  EXPECT_EQ(std::string(frame.bytes.begin(), frame.bytes.end()), Jpeg(2));
}

}  // namespace
}  // namespace trammel::machine
