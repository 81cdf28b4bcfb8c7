// Files in a recording's place that are no recordings: none may open another file, wait for ever,
// or take more memory and time than a video of its size.
#include "machine/video/video_input.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "machine/camera/camera.h"
#include "machine/video/video_file.h"
#include "support/laser_world.h"
#include "support/little_memory.h"

namespace trammel::machine {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;

/// The words with which a file is refused, from opening to its last frame; else how many it had.
std::string Outcome(const std::filesystem::path& path, const VideoLimits& limits = {}) {
  auto video = VideoFile::Open(path, limits);
  if (!video) return video.error().message;
  for (int frames = 0;; ++frames) {
    const auto next = video->Next();
    if (!next) return next.error().message;
    if (*next == nullptr) return std::to_string(frames) + " frames";
  }
}

std::string BigEndian(std::uint32_t value) {
  return {static_cast<char>(value >> 24U), static_cast<char>(value >> 16U),
          static_cast<char>(value >> 8U), static_cast<char>(value)};
}

std::string Box(const std::string& name, const std::string& content) {
  return BigEndian(static_cast<std::uint32_t>(content.size() + 8)) + name + content;
}

/// An MP4 of MJPEG whose samples all lie at the same place: `listed` of them have an offset.
std::string SamePlaceMovie(const std::string& jpeg, std::uint32_t listed, std::uint32_t stated) {
  const std::string zero = BigEndian(0);
  const std::string head = Box("ftyp", "isom" + zero + "isom") + Box("mdat", jpeg);
  const auto at = static_cast<std::uint32_t>(head.size() - jpeg.size());
  const std::string entry = std::string(6, '\0') + std::string("\0\1", 2) + std::string(16, '\0') +
                            std::string("\0\x40\0\x30", 4) + BigEndian(0x480000) +
                            BigEndian(0x480000) + zero + std::string("\0\1", 2) +
                            std::string(32, '\0') + std::string("\0\x18\xFF\xFF", 4);
  std::string offsets = zero + BigEndian(listed);
  for (std::uint32_t i = 0; i < listed; ++i) offsets += BigEndian(at);
  const std::string tables =
      Box("stsd", zero + BigEndian(1) + Box("jpeg", entry)) +
      Box("stts", zero + BigEndian(1) + BigEndian(stated) + BigEndian(1)) +
      Box("stsc", zero + BigEndian(1) + BigEndian(1) + BigEndian(stated / listed) + BigEndian(1)) +
      Box("stsz", zero + BigEndian(static_cast<std::uint32_t>(jpeg.size())) + BigEndian(stated)) +
      Box("stco", offsets);
  const std::string media =
      Box("mdhd", zero + zero + zero + BigEndian(30) + BigEndian(stated) + zero) +
      Box("hdlr", zero + zero + "vide" + std::string(13, '\0')) + Box("minf", Box("stbl", tables));
  return head + Box("moov", Box("trak", Box("tkhd", std::string(84, '\0')) + Box("mdia", media)));
}

/// Writes grey frames, ever brighter, with one of libav's encoders; false where it has none.
bool Encode(const std::filesystem::path& path, AVCodecID id, AVPixelFormat pixels, int frames) {
  const AVCodec* codec = avcodec_find_encoder(id);
  AVFormatContext* format = nullptr;
  if (codec == nullptr ||
      avformat_alloc_output_context2(&format, nullptr, nullptr, path.c_str()) < 0) {
    return false;
  }
  AVCodecContext* encoder = avcodec_alloc_context3(codec);
  encoder->width = 64;
  encoder->height = 48;
  encoder->pix_fmt = pixels;
  encoder->time_base = {1, 30};
  encoder->strict_std_compliance = FF_COMPLIANCE_EXPERIMENTAL;
  if ((format->oformat->flags & AVFMT_GLOBALHEADER) != 0) {
    encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  }
  AVStream* stream = avformat_new_stream(format, nullptr);
  bool good = avcodec_open2(encoder, codec, nullptr) >= 0 &&
              avcodec_parameters_from_context(stream->codecpar, encoder) >= 0 &&
              avio_open(&format->pb, path.c_str(), AVIO_FLAG_WRITE) >= 0;
  stream->time_base = encoder->time_base;
  good = good && avformat_write_header(format, nullptr) >= 0;
  AVFrame* frame = av_frame_alloc();
  frame->width = encoder->width;
  frame->height = encoder->height;
  frame->format = pixels;
  good = good && av_frame_get_buffer(frame, 0) >= 0;
  AVPacket* packet = av_packet_alloc();
  for (int i = 0; good && i <= frames; ++i) {
    for (int plane = 0; plane < 3 && frame->data[plane] != nullptr && i < frames; ++plane) {
      const int rows = plane == 0 ? 48 : 24;
      av_frame_make_writable(frame);
      std::fill_n(frame->data[plane], frame->linesize[plane] * rows,
                  static_cast<std::uint8_t>(plane == 0 ? 60 + 10 * i : 128));
    }
    frame->pts = i;
    avcodec_send_frame(encoder, i < frames ? frame : nullptr);
    while (avcodec_receive_packet(encoder, packet) >= 0) {
      packet->stream_index = stream->index;
      packet->duration = 1;
      av_packet_rescale_ts(packet, encoder->time_base, stream->time_base);
      good = good && av_interleaved_write_frame(format, packet) >= 0;
    }
  }
  good = good && av_write_trailer(format) >= 0;
  av_packet_free(&packet);
  av_frame_free(&frame);
  if (format->pb != nullptr) avio_closep(&format->pb);
  avcodec_free_context(&encoder);
  avformat_free_context(format);
  return good;
}

class VideoInputTest : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path At(const std::string& name) const {
    return folder_.path() / name;
  }
  std::filesystem::path Written(const std::string& name, const std::string& bytes) {
    test::WriteWhole(At(name), bytes);
    return At(name);
  }
  /// A sound video of so many frames of 64 x 48 px.
  std::string Avi(int frames) {
    test::WriteAvi(At("sound.avi"),
                   std::vector<Frame>(static_cast<std::size_t>(frames), Frame(64, 48)),
                   static_cast<std::uint32_t>(frames));
    return test::ReadWhole(At("sound.avi"));
  }
  std::string Jpeg() {
    const std::string avi = Avi(1);
    const std::size_t start = avi.find("\xFF\xD8\xFF");
    return avi.substr(start, avi.rfind("\xFF\xD9") + 2 - start);
  }
  test::TemporaryFolder folder_;
};

TEST_F(VideoInputTest, APlaylistOpensNoOtherFile) {
  Avi(2);
  const std::string other = At("sound.avi").string();
  const std::string list =
      "#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\n" + other + "\n#EXT-X-ENDLIST\n";
  const std::string live = "#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\n" + other + "\n";
  for (const std::string& text :
       {list, live, std::string("ffconcat version 1.0\nfile 'sound.avi'\n"),
        std::string("ffconcat version 1.0\nfile 'l.avi'\n")}) {
    const auto path = Written("l.avi", text);
    EXPECT_THAT(Outcome(path), AllOf(HasSubstr("l.avi"), HasSubstr("playlist"))) << text;
    EXPECT_FALSE(OpenCamera(path.string())) << text;
  }
  const std::string jpeg = Jpeg();
  for (const char* name : {"l0.jpg", "l1.jpg", "l2.jpg"}) Written(name, jpeg);
  EXPECT_THAT(Outcome(Written("l%d.jpg", "no picture, no picture")), HasSubstr("no AVI, MP4"));
}

TEST_F(VideoInputTest, ReadsTheContainersAndCodecsOfRecordings) {
  struct Kind {
    const char* name;
    AVCodecID codec;
    AVPixelFormat pixels = AV_PIX_FMT_YUV420P;
  };
  int read = 0;
  for (const Kind& kind : {Kind{"a.avi", AV_CODEC_ID_MPEG4}, Kind{"a.mp4", AV_CODEC_ID_MPEG4},
                           Kind{"a.mkv", AV_CODEC_ID_MPEG4}, Kind{"b.mp4", AV_CODEC_ID_H264},
                           Kind{"b.mkv", AV_CODEC_ID_H264}, Kind{"b.avi", AV_CODEC_ID_H264},
                           Kind{"b.mov", AV_CODEC_ID_HEVC}, Kind{"c.webm", AV_CODEC_ID_VP8},
                           Kind{"d.webm", AV_CODEC_ID_VP9}, Kind{"e.mkv", AV_CODEC_ID_FFV1},
                           Kind{"e.avi", AV_CODEC_ID_FFV1}, Kind{"f.avi", AV_CODEC_ID_RAWVIDEO},
                           Kind{"g.mov", AV_CODEC_ID_MJPEG, AV_PIX_FMT_YUVJ420P},
                           Kind{"g.mkv", AV_CODEC_ID_MJPEG, AV_PIX_FMT_YUVJ420P}}) {
    if (!Encode(At(kind.name), kind.codec, kind.pixels, 8)) continue;  // not in this libav
    EXPECT_EQ(Outcome(At(kind.name)), "8 frames") << kind.name << " " << kind.codec;
    ++read;
  }
  EXPECT_GE(read, 6);  // what libav can always write
  if (Encode(At("h.avi"), AV_CODEC_ID_FLV1, AV_PIX_FMT_YUV420P, 8)) {
    EXPECT_THAT(Outcome(At("h.avi")), AllOf(HasSubstr("'flv1'"), HasSubstr("ffmpeg -i IN")));
  }
}

TEST_F(VideoInputTest, APartIsThatPartOfTheWholeFrame) {
  ASSERT_TRUE(Encode(At("a.mkv"), AV_CODEC_ID_MPEG4, AV_PIX_FMT_YUV420P, 3));
  auto whole = VideoFile::Open(At("a.mkv"));
  auto parts = VideoFile::Open(At("a.mkv"));
  ASSERT_TRUE(whole && parts);
  for (int i = 0; i < 3; ++i) {
    const auto frame = whole->Next();
    ASSERT_TRUE(frame && *frame != nullptr);
    ASSERT_EQ(parts->Advance().value_or(false), true);
    if (i == 1) continue;  // not asked for
    const auto part = parts->Decode({13, 7, 31, 41});
    ASSERT_TRUE(part) << part.error().message;
    ASSERT_EQ((*part)->bgr.size(), std::size_t{3 * 31 * 41});
    const BgrView expected = Crop((*frame)->view(), {13, 7, 31, 41});
    for (int y = 0; y < 41; ++y) {
      EXPECT_TRUE(std::equal(expected.row(y), expected.row(y) + 3 * 31, (*part)->view().row(y)));
    }
    EXPECT_EQ((*part)->time_s, (*frame)->time_s);
  }
}

TEST_F(VideoInputTest, OnlyRegularFilesAreOpened) {
  ASSERT_EQ(mkfifo(At("pipe.avi").c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/zero", At("zero.avi"));
  EXPECT_THAT(Outcome(At("pipe.avi")), HasSubstr("not a regular file"));
  EXPECT_THAT(Outcome(At("zero.avi")), HasSubstr("not a regular file"));
}

TEST_F(VideoInputTest, AFrameOfAGigapixelIsRefusedBeforeItIsDecoded) {
  std::string avi = Avi(2);
  const std::size_t frame = avi.find("\xFF\xC0");
  ASSERT_NE(frame, std::string::npos);
  avi.replace(frame + 5, 4, "\xFF\xDC\xFF\xDC");
  const auto path = Written("large.avi", avi);
  EXPECT_THAT(test::WithLittleMemory([&] { return Outcome(path); }),
              AllOf(HasSubstr("frame 1"), HasSubstr("65500x65500 px")));
  std::string stated = Avi(2);
  const std::size_t format = stated.find("strf");
  ASSERT_NE(format, std::string::npos);
  stated.replace(format + 12, 8, std::string("\xDC\xFF\0\0\xDC\xFF\0\0", 8));
  const auto head = Written("stated.avi", stated);
  EXPECT_THAT(test::WithLittleMemory([&] { return Outcome(head); }), HasSubstr("65500x65500 px"));
}

TEST_F(VideoInputTest, FramesThatADecoderKeepsManyOfAreSmaller) {
  ASSERT_TRUE(Encode(At("a.avi"), AV_CODEC_ID_MPEG4, AV_PIX_FMT_YUV420P, 2));
  std::string avi = test::ReadWhole(At("a.avi"));
  const std::size_t format = avi.find("strf");
  ASSERT_NE(format, std::string::npos);
  avi.replace(format + 12, 8, std::string("\x88\x13\0\0\x88\x13\0\0", 8));  // 5000 x 5000
  EXPECT_THAT(Outcome(Written("large.avi", avi)),
              AllOf(HasSubstr("5000x5000"), HasSubstr("16 megapixels")));
}

TEST_F(VideoInputTest, AnIndexMayNotNameTheSameBytesOverAndOver) {
  const std::string jpeg = Jpeg();
  EXPECT_EQ(Outcome(Written("once.mp4", SamePlaceMovie(jpeg, 3, 3))), "3 frames");
  EXPECT_THAT(Outcome(Written("often.mp4", SamePlaceMovie(jpeg, 4000, 4000))),
              HasSubstr("same bytes over and over"));
}

TEST_F(VideoInputTest, ATableOfAFewBytesMayNotStateMillionsOfSamples) {
  const auto path = Written("many.mp4", SamePlaceMovie(Jpeg(), 1, 100'000'000));
  EXPECT_THAT(test::WithLittleMemory([&] { return Outcome(path); }),
              HasSubstr("its tables state 100000000 entries"));
}

TEST_F(VideoInputTest, FramesOfNextToNothingEnd) {
  const auto path = Written("a.avi", Avi(20));
  VideoLimits limits;
  limits.max_pixels_in_all = 10 * 64 * 48;
  EXPECT_THAT(Outcome(path, limits), HasSubstr("its first 11 frames"));
  limits = {};
  limits.pixels_for_nothing = 0;
  limits.max_pixels_per_byte = 1;
  EXPECT_THAT(Outcome(path, limits), HasSubstr("pixels a byte"));
}

TEST_F(VideoInputTest, DecodingHasATimeLimit) {
  const auto path = Written("a.avi", Avi(20));
  VideoLimits limits;
  limits.max_decoding_s = 0;
  EXPECT_THAT(Outcome(path, limits), HasSubstr("took over 0 s"));
}

TEST_F(VideoInputTest, RealPlaylistsAreRefused) {
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  const std::filesystem::path lists =
      std::filesystem::path(data != nullptr ? data : "") / "hostile" / "playlists";
  if (data == nullptr || !std::filesystem::is_directory(lists)) {
    GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with hostile/playlists/";
  }
  int seen = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(lists)) {
    const std::string name = entry.path().filename();
    if (name != "l.avi" && name != "l%d.jpg") continue;
    EXPECT_THAT(Outcome(entry.path()), AnyOf(HasSubstr("playlist"), HasSubstr("no AVI, MP4")));
    ++seen;
  }
  EXPECT_GE(seen, 6);
}

}  // namespace
}  // namespace trammel::machine
