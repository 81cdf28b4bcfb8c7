#include "machine/video/video_input.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/mem.h>
}

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <span>
#include <utility>
#include <vector>

#include "machine/net/file_bytes.h"
#include "machine/video/movie_tables.h"
#include "machine/video/riff_head.h"

namespace trammel::machine {
namespace {

constexpr std::array kCodecs = {AV_CODEC_ID_MJPEG, AV_CODEC_ID_RAWVIDEO, AV_CODEC_ID_H264,
                                AV_CODEC_ID_HEVC,  AV_CODEC_ID_MPEG4,    AV_CODEC_ID_VP8,
                                AV_CODEC_ID_VP9,   AV_CODEC_ID_FFV1};
// Decoders of the same, for what libav opens by itself.
constexpr const char* kDecoders = "mjpeg,rawvideo,h264,hevc,mpeg4,vp8,vp9,ffv1";

constexpr std::size_t kStart = 12;

/// libav's name of the container that begins so; null where it is none that is read.
const char* ContainerOf(std::span<const std::uint8_t> start) {
  const std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
  if (text.starts_with("RIFF")) return "avi";
  if (text.starts_with("\x1A\x45\xDF\xA3")) return "matroska";
  if (text.size() < 8) return nullptr;
  for (const std::string_view box : {"ftyp", "moov", "mdat", "free", "skip", "wide", "pnot"}) {
    if (text.substr(4, 4) == box) return "mov";
  }
  return nullptr;
}

std::string NoContainer(std::span<const std::uint8_t> start) {
  const std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
  if (text.starts_with("#EXTM3U") || text.starts_with("ffconcat")) {
    return "it is a playlist, which names other files, and no video; record it as MJPEG in AVI";
  }
  return "not a video that can be read: it begins like no AVI, MP4, MOV, Matroska or WebM file; "
         "record it as MJPEG in AVI";
}

tl::unexpected<Error> Broken(std::string what) {
  return Fail(std::move(what), ErrorKind::kMeasurement);
}

int RefuseName(AVFormatContext* /*format*/, AVIOContext** /*io*/, const char* /*name*/,
               int /*flags*/, AVDictionary** /*options*/) {
  return AVERROR(EPERM);
}

/// The open file, as libav reads it: as large as it was when it was opened.
struct FileBytes {
  OpenFile file;
  std::int64_t at = 0;
  std::int64_t may_read = 0;  ///< bytes; libav may go back and forth, but not for ever
};

int ReadBytes(void* opaque, std::uint8_t* out, int size) {
  auto& bytes = *static_cast<FileBytes*>(opaque);
  const std::int64_t left = std::min<std::int64_t>(size, bytes.file.size() - bytes.at);
  if (left <= 0) return AVERROR_EOF;
  if (left > bytes.may_read) return AVERROR(EFBIG);
  const ssize_t count = pread(bytes.file.fd(), out, static_cast<std::size_t>(left), bytes.at);
  if (count < 0) return AVERROR(errno);
  if (count == 0) return AVERROR_EOF;
  bytes.at += count;
  bytes.may_read -= count;
  return static_cast<int>(count);
}

std::int64_t SeekBytes(void* opaque, std::int64_t offset, int whence) {
  auto& bytes = *static_cast<FileBytes*>(opaque);
  if ((whence & AVSEEK_SIZE) != 0) return bytes.file.size();
  const int from = whence & ~AVSEEK_FORCE;
  const std::int64_t start =
      from == SEEK_SET ? 0 : (from == SEEK_CUR ? bytes.at : bytes.file.size());
  if (offset < -start || offset > bytes.file.size() - start) return AVERROR(EINVAL);
  return bytes.at = start + offset;
}

struct FreeIo {
  void operator()(AVIOContext* io) const {
    av_freep(&io->buffer);
    avio_context_free(&io);
  }
};
struct CloseFormat {
  void operator()(AVFormatContext* p) const { avformat_close_input(&p); }
};

// Of libav's own buffers and tables while it reads the head of a file.
constexpr std::int64_t kMostOfHead = 5 << 20;

}  // namespace

struct VideoInput::State {
  explicit State(OpenFile file) : bytes{std::move(file)} {}

  FileBytes bytes;
  std::unique_ptr<AVIOContext, FreeIo> io;
  std::unique_ptr<AVFormatContext, CloseFormat> format;  // goes before what it reads from
  int stream = -1;
  bool unfinished = false;
  std::int64_t packet_bytes = 0;
  std::int64_t packets = 0;
  std::string fault;

  Result<void> OpenFormat(const char* container);
  Result<void> FindStream(std::size_t most_pixels);
  Result<void> Probe(std::size_t most_pixels);
};

VideoInput::VideoInput(std::unique_ptr<State> state) : state_(std::move(state)) {}
VideoInput::VideoInput(VideoInput&&) noexcept = default;
VideoInput& VideoInput::operator=(VideoInput&&) noexcept = default;
VideoInput::~VideoInput() = default;

AVFormatContext* VideoInput::format() const { return state_->format.get(); }
int VideoInput::stream() const { return state_->stream; }
std::int64_t VideoInput::bytes() const { return state_->bytes.file.size(); }
bool VideoInput::unfinished() const { return state_->unfinished; }
const std::string& VideoInput::fault() const { return state_->fault; }

bool IsRecordingCodec(int codec_id) {
  return std::find(kCodecs.begin(), kCodecs.end(), codec_id) != kCodecs.end();
}

std::size_t MostPixelsOf(int codec_id, std::size_t most) {
  constexpr std::size_t kMostOfDependent = 16'000'000;  // 4K has 9
  const bool alone = codec_id == AV_CODEC_ID_MJPEG || codec_id == AV_CODEC_ID_RAWVIDEO ||
                     codec_id == AV_CODEC_ID_FFV1;
  return alone ? most : std::min(most, kMostOfDependent);
}

std::string ExplainLibav(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  return text.data();
}

Result<void> VideoInput::State::OpenFormat(const char* container) {
  constexpr int kBuffer = 1 << 16;
  auto* const buffer = static_cast<std::uint8_t*>(av_malloc(kBuffer));
  if (buffer == nullptr) return Broken("out of memory");
  io.reset(avio_alloc_context(buffer, kBuffer, 0, &bytes, ReadBytes, nullptr, SeekBytes));
  AVFormatContext* opened = avformat_alloc_context();
  if (!io || opened == nullptr) {
    avformat_free_context(opened);
    return Broken("out of memory");
  }
  opened->pb = io.get();
  opened->io_open = RefuseName;
  opened->codec_whitelist = av_strdup(kDecoders);
  opened->format_whitelist = av_strdup(container);
  opened->protocol_whitelist = av_strdup("none");
  bytes.may_read = kMostOfHead;
  // A context that fails to open is freed by the call.
  const int error = avformat_open_input(&opened, "", av_find_input_format(container), nullptr);
  if (error < 0) {
    return Broken(
        bytes.may_read < kBuffer
            ? fmt::format("its head takes more than {} MB before the first frame; record it as "
                          "MJPEG in AVI",
                          kMostOfHead >> 20)
            : fmt::format("not a video that can be read ({}); record it as MJPEG in AVI",
                          ExplainLibav(error)));
  }
  format.reset(opened);
  // Each byte of a recording is read about once; an index may say otherwise.
  constexpr std::int64_t kTimes = 64;
  bytes.may_read = kTimes * bytes.file.size() + (std::int64_t{64} << 20);
  return {};
}

/// Has libav decode the first frames where the head does not say enough.
Result<void> VideoInput::State::Probe(std::size_t most_pixels) {
  std::vector<AVDictionary*> options(format->nb_streams, nullptr);
  for (AVDictionary*& entry : options) {
    av_dict_set_int(&entry, "max_pixels", static_cast<std::int64_t>(most_pixels), 0);
    av_dict_set(&entry, "threads", "1", 0);
  }
  const std::size_t streams = options.size();
  const int error = avformat_find_stream_info(format.get(), options.data());
  for (std::size_t i = 0; i < streams; ++i) av_dict_free(&options[i]);
  if (error < 0) {
    return Broken(
        fmt::format("holds no video stream that can be decoded ({}); record it as MJPEG "
                    "in AVI",
                    ExplainLibav(error)));
  }
  return {};
}

Result<void> VideoInput::State::FindStream(std::size_t most_pixels) {
  stream = av_find_best_stream(format.get(), AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (stream < 0) {
    return Broken("holds no video stream that can be decoded; record it as MJPEG in AVI");
  }
  for (unsigned i = 0; i < format->nb_streams; ++i) {
    if (static_cast<int>(i) != stream) format->streams[i]->discard = AVDISCARD_ALL;
  }
  const AVCodecParameters& parameters = *format->streams[stream]->codecpar;
  if (!IsRecordingCodec(parameters.codec_id)) {
    return Broken(fmt::format(
        "its codec '{}' is none that is read; convert it: ffmpeg -i IN -c:v mjpeg -q:v 2 OUT.avi",
        avcodec_get_name(parameters.codec_id)));
  }
  most_pixels = MostPixelsOf(parameters.codec_id, most_pixels);
  const double pixels = static_cast<double>(parameters.width) * parameters.height;
  if (pixels > static_cast<double>(most_pixels)) {
    return Broken(fmt::format("frames of {}x{} px; at most {} megapixels are read",
                              parameters.width, parameters.height, most_pixels / 1'000'000));
  }
  // A JPEG's cost is judged before it is decoded, which libav would not.
  if (parameters.codec_id == AV_CODEC_ID_MJPEG) return {};
  return Probe(most_pixels);
}

Result<VideoInput> VideoInput::Open(const std::filesystem::path& path, std::size_t most_pixels) {
  av_log_set_level(AV_LOG_QUIET);
  auto file = OpenFile::Open(path);
  if (!file) return Broken(file.error().message);
  if (file->size() == 0) return Broken("the file is empty (0 bytes); record the line again");
  auto state = std::make_unique<State>(std::move(*file));
  std::array<std::uint8_t, kStart> first{};
  const ssize_t count = pread(state->bytes.file.fd(), first.data(), first.size(), 0);
  if (count < 0) return Broken("cannot be read beyond its first bytes; check its permissions");
  const auto start = std::span(first).first(static_cast<std::size_t>(count));
  const char* const container = ContainerOf(start);
  if (container == nullptr) return Broken(NoContainer(start));
  std::string wrong;
  if (std::string_view(container) == "avi") {
    wrong = InspectRiff(start, state->bytes.file.size(), state->unfinished);
  } else if (std::string_view(container) == "mov") {
    wrong = InspectMovieTables(state->bytes.file.fd(), state->bytes.file.size());
  }
  if (!wrong.empty()) return Broken(wrong);
  if (auto opened = state->OpenFormat(container); !opened) return tl::unexpected(opened.error());
  if (auto found = state->FindStream(most_pixels); !found) return tl::unexpected(found.error());
  return VideoInput(std::move(state));
}

int VideoInput::Next(AVPacket* packet) {
  constexpr std::int64_t kAlways = 1 << 20;  // packed tracks grow a little
  State& state = *state_;
  const std::int64_t size = state.bytes.file.size();
  for (;;) {
    const int read = av_read_frame(state.format.get(), packet);
    if (read < 0) return read;
    state.packet_bytes += packet->size;
    if (state.packet_bytes > 2 * size + kAlways || ++state.packets > size) {
      av_packet_unref(packet);
      state.fault = fmt::format(
          "its index names the same bytes over and over: {} packets of {} bytes in all from a file "
          "of {}; record it again",
          state.packets, state.packet_bytes, size);
      return AVERROR(ELOOP);
    }
    if (packet->stream_index == state.stream && packet->size > 0) return 0;
    av_packet_unref(packet);
  }
}

}  // namespace trammel::machine
