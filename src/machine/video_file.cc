#include "machine/video_file.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/imgutils.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace trammel::machine {
namespace {

struct CloseFormat {
  void operator()(AVFormatContext* p) const { avformat_close_input(&p); }
};
struct FreeCodec {
  void operator()(AVCodecContext* p) const { avcodec_free_context(&p); }
};
struct FreeFrame {
  void operator()(AVFrame* p) const { av_frame_free(&p); }
};
struct FreePacket {
  void operator()(AVPacket* p) const { av_packet_free(&p); }
};
struct FreeScaler {
  void operator()(SwsContext* p) const { sws_freeContext(p); }
};

std::string Explain(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  return text.data();
}

tl::unexpected<Error> Broken(const std::filesystem::path& path, const std::string& what) {
  return Fail(fmt::format("video '{}': {}", path.string(), what), ErrorKind::kMeasurement);
}

/// The full-range "J" formats are deprecated twins; the range is told to the scaler instead.
AVPixelFormat WithoutRange(AVPixelFormat format) {
  switch (format) {
    case AV_PIX_FMT_YUVJ420P:
      return AV_PIX_FMT_YUV420P;
    case AV_PIX_FMT_YUVJ422P:
      return AV_PIX_FMT_YUV422P;
    case AV_PIX_FMT_YUVJ444P:
      return AV_PIX_FMT_YUV444P;
    case AV_PIX_FMT_YUVJ440P:
      return AV_PIX_FMT_YUV440P;
    default:
      return format;
  }
}

/// What is wrong with the file before any frame is read; empty where nothing is. `unfinished` tells
/// a recording whose recorder was killed.
std::string Inspect(const std::filesystem::path& path, bool& unfinished) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (error || !std::filesystem::exists(status)) {
    return "there is no such file; record the line again or correct its name in scan.json";
  }
  if (!std::filesystem::is_regular_file(status)) {
    return "this is not a regular file; name a video file";
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) {
    return fmt::format("its size cannot be read: {}", error.message());
  }
  if (size == 0) {
    return "the file is empty (0 bytes); record the line again";
  }
  std::ifstream stream(path, std::ios::binary);
  std::array<unsigned char, 8> head{};
  if (!stream.read(reinterpret_cast<char*>(head.data()), head.size())) {
    return fmt::format("cannot be read beyond its first bytes ({} in all); check its permissions",
                       size);
  }
  if (head[0] == 'R' && head[1] == 'I' && head[2] == 'F' && head[3] == 'F') {
    const std::uintmax_t riff = head[4] + (std::uintmax_t{head[5]} << 8) +
                                (std::uintmax_t{head[6]} << 16) + (std::uintmax_t{head[7]} << 24);
    // A recorder that was killed leaves 0 or all ones here; those say nothing.
    unfinished = riff == 0xFFFFFFFF || riff == 0;
    if (riff != 0xFFFFFFFF && riff + 8 > size) {
      return fmt::format(
          "truncated: its header announces {} bytes, there are {}; copy it again or record again",
          riff + 8, size);
    }
  }
  return {};
}

}  // namespace

struct VideoFile::State {
  std::filesystem::path path;
  VideoLimits limits;
  std::unique_ptr<AVFormatContext, CloseFormat> format;
  std::unique_ptr<AVCodecContext, FreeCodec> codec;
  std::unique_ptr<AVFrame, FreeFrame> decoded;
  std::unique_ptr<AVPacket, FreePacket> packet;
  std::unique_ptr<SwsContext, FreeScaler> scaler;
  int stream = -1;
  int scaler_format = AV_PIX_FMT_NONE;
  bool drained = false;
  bool unfinished = false;  ///< its recorder was killed; the last frame may be cut off
  std::size_t frames = 0;
  std::vector<std::uint8_t> padded;
  Frame frame;

  [[nodiscard]] tl::unexpected<Error> Fault(const std::string& what) const {
    return Broken(path, what);
  }
  Result<bool> Decode();
  Result<void> Feed();
  Result<void> Convert();
};

VideoFile::VideoFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;
VideoFile::~VideoFile() = default;

Result<VideoFile> VideoFile::Open(const std::filesystem::path& path, const VideoLimits& limits) {
  av_log_set_level(AV_LOG_QUIET);
  auto state = std::make_unique<State>();
  if (const std::string fault = Inspect(path, state->unfinished); !fault.empty()) {
    return Broken(path, fault);
  }
  state->path = path;
  state->limits = limits;
  AVFormatContext* format = nullptr;
  // The protocol is spelled out: a name such as "http:x" must stay a file's name.
  const std::string url = "file:" + path.string();
  if (const int error = avformat_open_input(&format, url.c_str(), nullptr, nullptr); error < 0) {
    return Broken(path, fmt::format("not a video that can be read ({}); record it as MJPEG in AVI",
                                    Explain(error)));
  }
  state->format.reset(format);
  const AVCodec* codec = nullptr;
  if (avformat_find_stream_info(format, nullptr) < 0 ||
      (state->stream = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0)) < 0 ||
      codec == nullptr) {
    return Broken(path, "holds no video stream that can be decoded; record it as MJPEG in AVI");
  }
  const AVCodecParameters* parameters = format->streams[state->stream]->codecpar;
  if (parameters->width > limits.max_width_px || parameters->height > limits.max_height_px) {
    return Broken(path, fmt::format("frames of {}x{} px; at most {}x{} are read", parameters->width,
                                    parameters->height, limits.max_width_px, limits.max_height_px));
  }
  state->codec.reset(avcodec_alloc_context3(codec));
  state->decoded.reset(av_frame_alloc());
  state->packet.reset(av_packet_alloc());
  if (!state->codec || !state->decoded || !state->packet) {
    return Broken(path, "out of memory");
  }
  avcodec_parameters_to_context(state->codec.get(), parameters);
  state->codec->err_recognition = AV_EF_EXPLODE | AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER;
  state->codec->max_pixels = static_cast<std::int64_t>(limits.max_pixels);
  if (const int error = avcodec_open2(state->codec.get(), codec, nullptr); error < 0) {
    return Broken(path, fmt::format("its codec '{}' cannot be opened ({}); record it as MJPEG",
                                    codec->name, Explain(error)));
  }
  return VideoFile(std::move(state));
}

/// Hands one packet of the stream to the decoder, or tells it that there are no more.
Result<void> VideoFile::State::Feed() {
  for (;;) {
    const int read = av_read_frame(format.get(), packet.get());
    if (read == AVERROR_EOF) {
      drained = true;
      avcodec_send_packet(codec.get(), nullptr);
      return {};
    }
    if (read < 0) {
      return Fault(fmt::format("reading after frame {} failed ({}); record the line again", frames,
                               Explain(read)));
    }
    if (packet->stream_index != stream || packet->size == 0) {
      av_packet_unref(packet.get());
      continue;
    }
    const bool corrupt = (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
    if (corrupt && unfinished) {
      av_packet_unref(packet.get());
      drained = true;
      avcodec_send_packet(codec.get(), nullptr);
      return {};
    }
    const int sent = corrupt ? AVERROR_INVALIDDATA : avcodec_send_packet(codec.get(), packet.get());
    av_packet_unref(packet.get());
    if (sent < 0) {
      return Fault(fmt::format("frame {} is damaged or cut off ({}); record the line again",
                               frames + 1, Explain(sent)));
    }
    return {};
  }
}

/// Fills `decoded`; false at the end of the video.
Result<bool> VideoFile::State::Decode() {
  for (;;) {
    const int received = avcodec_receive_frame(codec.get(), decoded.get());
    if (received == AVERROR_EOF) {
      return false;
    }
    if (received == AVERROR(EAGAIN)) {
      if (auto fed = Feed(); !fed) {
        return tl::unexpected(fed.error());
      }
      continue;
    }
    if (received < 0 || (decoded->flags & AV_FRAME_FLAG_CORRUPT) != 0 ||
        decoded->decode_error_flags != 0) {
      return Fault(fmt::format("frame {} is damaged or cut off ({}); record the line again",
                               frames + 1, received < 0 ? Explain(received) : "decoder's flag"));
    }
    return true;
  }
}

/// `decoded` -> `frame`, BGR.
Result<void> VideoFile::State::Convert() {
  const int width = decoded->width;
  const int height = decoded->height;
  if (width < 1 || height < 1 || width > limits.max_width_px || height > limits.max_height_px ||
      static_cast<std::size_t>(width) * static_cast<std::size_t>(height) > limits.max_pixels) {
    return Fault(fmt::format("frame {} has {}x{} px; at most {}x{} and {} in all are read",
                             frames + 1, width, height, limits.max_width_px, limits.max_height_px,
                             limits.max_pixels));
  }
  if (frames > 0 && (width != frame.width || height != frame.height)) {
    return Fault(
        fmt::format("frame {} has {}x{} px, those before it {}x{}; record the line again "
                    "with one camera mode",
                    frames + 1, width, height, frame.width, frame.height));
  }
  if (frames == 0) {
    frame = Frame(width, height);
  }
  const auto source = static_cast<AVPixelFormat>(decoded->format);
  if (!scaler || scaler_format != decoded->format) {
    scaler.reset(sws_getContext(
        width, height, WithoutRange(source), width, height, AV_PIX_FMT_BGR24,
        SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, nullptr, nullptr, nullptr));
    if (!scaler) {
      return Fault("its pixel format cannot be turned into colours; record it as MJPEG");
    }
    scaler_format = decoded->format;
    const bool full = decoded->color_range == AVCOL_RANGE_JPEG || WithoutRange(source) != source;
    const int* matrix = sws_getCoefficients(SWS_CS_DEFAULT);
    sws_setColorspaceDetails(scaler.get(), matrix, full ? 1 : 0, matrix, 1, 0, 1 << 16, 1 << 16);
  }
  // The scaler's fast paths write whole vectors, beyond the end of a row; hence rows of its own.
  const std::size_t row_bytes = static_cast<std::size_t>(width) * 3;
  const std::size_t stride = (row_bytes + 127) / 64 * 64;
  padded.resize(stride * static_cast<std::size_t>(height));
  std::array<std::uint8_t*, 4> planes{padded.data(), nullptr, nullptr, nullptr};
  std::array<int, 4> strides{static_cast<int>(stride), 0, 0, 0};
  sws_scale(scaler.get(), decoded->data, decoded->linesize, 0, height, planes.data(),
            strides.data());
  for (int y = 0; y < height; ++y) {
    std::copy_n(padded.data() + static_cast<std::size_t>(y) * stride, row_bytes, frame.row(y));
  }
  const std::int64_t stamp = decoded->best_effort_timestamp;
  frame.time_s.reset();
  if (stamp != AV_NOPTS_VALUE) {
    frame.time_s = static_cast<double>(stamp) * av_q2d(format->streams[stream]->time_base);
  }
  return {};
}

Result<const Frame*> VideoFile::Next() {
  State& state = *state_;
  auto more = state.Decode();
  if (!more) {
    return tl::unexpected(more.error());
  }
  if (!*more) {
    if (state.frames == 0) {
      return state.Fault("holds no frames; record the line again");
    }
    return nullptr;
  }
  if (state.frames == state.limits.max_frames) {
    return state.Fault(
        fmt::format("more than {} frames; record one sweep per file", state.limits.max_frames));
  }
  if (auto converted = state.Convert(); !converted) {
    return tl::unexpected(converted.error());
  }
  ++state.frames;
  return &state.frame;
}

}  // namespace trammel::machine
