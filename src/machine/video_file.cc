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
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "machine/video_input.h"

namespace trammel::machine {
namespace {

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

}  // namespace

struct VideoFile::State {
  using Clock = std::chrono::steady_clock;

  State(std::filesystem::path of, const VideoLimits& within, VideoInput from)
      : path(std::move(of)), limits(within), input(std::move(from)) {}

  std::filesystem::path path;
  VideoLimits limits;
  VideoInput input;
  std::unique_ptr<AVCodecContext, FreeCodec> codec;
  std::unique_ptr<AVFrame, FreeFrame> decoded;
  std::unique_ptr<AVPacket, FreePacket> packet;
  std::unique_ptr<SwsContext, FreeScaler> scaler;
  int scaler_format = AV_PIX_FMT_NONE;
  bool drained = false;
  std::size_t frames = 0;
  double pixels = 0;  ///< of all frames
  Clock::duration decoding{};
  std::vector<std::uint8_t> padded;
  Frame frame;

  [[nodiscard]] tl::unexpected<Error> Fault(const std::string& what) const {
    return Broken(path, what);
  }
  Result<bool> DecodeWithin();
  Result<bool> Decode();
  Result<void> Feed();
  Result<void> Drain();
  Result<void> CheckPixels();
  Result<void> Convert();
};

VideoFile::VideoFile(std::unique_ptr<State> state) : state_(std::move(state)) {}
VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;
VideoFile::~VideoFile() = default;

Result<VideoFile> VideoFile::Open(const std::filesystem::path& path, const VideoLimits& limits) {
  auto input = VideoInput::Open(path, limits.max_pixels);
  if (!input) return Broken(path, input.error().message);
  auto state = std::make_unique<State>(path, limits, std::move(*input));
  const AVCodecParameters* parameters =
      state->input.format()->streams[state->input.stream()]->codecpar;
  if (parameters->width > limits.max_width_px || parameters->height > limits.max_height_px) {
    return Broken(path, fmt::format("frames of {}x{} px; at most {}x{} are read", parameters->width,
                                    parameters->height, limits.max_width_px, limits.max_height_px));
  }
  const AVCodec* codec = avcodec_find_decoder(parameters->codec_id);
  if (codec == nullptr) {
    return Broken(path, fmt::format("libav has no decoder for '{}' here; record it as MJPEG",
                                    avcodec_get_name(parameters->codec_id)));
  }
  state->codec.reset(avcodec_alloc_context3(codec));
  state->decoded.reset(av_frame_alloc());
  state->packet.reset(av_packet_alloc());
  if (!state->codec || !state->decoded || !state->packet) {
    return Broken(path, "out of memory");
  }
  avcodec_parameters_to_context(state->codec.get(), parameters);
  state->codec->err_recognition = AV_EF_EXPLODE | AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER;
  state->codec->max_pixels =
      static_cast<std::int64_t>(MostPixelsOf(parameters->codec_id, limits.max_pixels));
  if (const int error = avcodec_open2(state->codec.get(), codec, nullptr); error < 0) {
    return Broken(path, fmt::format("its codec '{}' cannot be opened ({}); record it as MJPEG",
                                    codec->name, ExplainLibav(error)));
  }
  return VideoFile(std::move(state));
}

/// Tells the decoder that there are no more packets.
Result<void> VideoFile::State::Drain() {
  drained = true;
  avcodec_send_packet(codec.get(), nullptr);
  return {};
}

/// Hands one packet of the stream to the decoder, or tells it that there are no more.
Result<void> VideoFile::State::Feed() {
  const int read = input.Next(packet.get());
  if (read == AVERROR_EOF) return Drain();
  if (read < 0) {
    return Fault(!input.fault().empty()
                     ? input.fault()
                     : fmt::format("reading after frame {} failed ({}); record the line again",
                                   frames, ExplainLibav(read)));
  }
  const bool corrupt = (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
  if (corrupt && input.unfinished()) {
    av_packet_unref(packet.get());
    return Drain();
  }
  const auto cost = codec->codec_id == AV_CODEC_ID_MJPEG && !corrupt
                        ? CheckMjpegFrame(*packet, limits.max_pixels)
                        : Result<void>();
  const int sent =
      corrupt || !cost ? AVERROR_INVALIDDATA : avcodec_send_packet(codec.get(), packet.get());
  av_packet_unref(packet.get());
  if (!cost) return Fault(fmt::format("frame {}: {}", frames + 1, cost.error().message));
  if (sent < 0) {
    return Fault(fmt::format("frame {} is damaged or cut off ({}); record the line again",
                             frames + 1, ExplainLibav(sent)));
  }
  return {};
}

/// Counts the pixels of the frames: a few bytes can stand for millions of them.
Result<void> VideoFile::State::CheckPixels() {
  pixels += static_cast<double>(decoded->width) * decoded->height;
  if (pixels > limits.max_pixels_in_all) {
    return Fault(
        fmt::format("its first {} frames have more than {:.0f} megapixels in all; record "
                    "one sweep per file, or with smaller frames",
                    frames + 1, limits.max_pixels_in_all / 1e6));
  }
  const double spared = std::max(0.0, pixels - limits.pixels_for_nothing);
  if (spared > limits.max_pixels_per_byte * static_cast<double>(input.bytes())) {
    return Fault(
        fmt::format("its first {} frames have {:.0f} megapixels from {} bytes, more than {:.0f} "
                    "pixels a byte: nothing moves in them; record the line again",
                    frames + 1, pixels / 1e6, input.bytes(), limits.max_pixels_per_byte));
  }
  return {};
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
                               frames + 1,
                               received < 0 ? ExplainLibav(received) : "decoder's flag"));
    }
    return true;
  }
}

/// Decode(), whose time is bounded: what a packet costs depends on the codec, not on its bytes.
Result<bool> VideoFile::State::DecodeWithin() {
  const Clock::time_point begin = Clock::now();
  auto more = Decode();
  decoding += Clock::now() - begin;
  if (more && decoding > std::chrono::duration<double>(limits.max_decoding_s)) {
    return Fault(
        fmt::format("decoding the first {} frames took over {:g} s; record one sweep per file, or "
                    "as MJPEG",
                    frames + 1, limits.max_decoding_s));
  }
  return more;
}

/// `decoded` -> `frame`, BGR.
Result<void> VideoFile::State::Convert() {
  if (auto few = CheckPixels(); !few) return few;
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
    frame.time_s =
        static_cast<double>(stamp) * av_q2d(input.format()->streams[input.stream()]->time_base);
  }
  return {};
}

Result<const Frame*> VideoFile::Next() {
  State& state = *state_;
  auto more = state.DecodeWithin();
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
