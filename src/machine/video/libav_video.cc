#include "machine/video/libav_video.h"

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

#include "machine/video/video_budget.h"
#include "machine/video/video_input.h"

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

class LibavVideo final : public VideoDecoder {
 public:
  LibavVideo(std::filesystem::path of, const VideoLimits& within, VideoInput from)
      : path_(std::move(of)), input_(std::move(from)), budget_(within, input_.bytes()) {}

  Result<void> OpenCodec();
  Result<bool> Advance() override;
  [[nodiscard]] int width_px() const override { return decoded_->width; }
  [[nodiscard]] int height_px() const override { return decoded_->height; }
  Result<const Frame*> Decode(const PixelRect& part) override;

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] tl::unexpected<Error> Fault(const std::string& what) const {
    return Broken(path_, what);
  }
  Result<bool> DecodeWithin();
  Result<bool> DecodeNext();
  Result<void> Feed();
  Result<void> Drain();
  Result<void> Convert();

  std::filesystem::path path_;
  VideoInput input_;
  VideoBudget budget_;
  std::unique_ptr<AVCodecContext, FreeCodec> codec_;
  std::unique_ptr<AVFrame, FreeFrame> decoded_;
  std::unique_ptr<AVPacket, FreePacket> packet_;
  std::unique_ptr<SwsContext, FreeScaler> scaler_;
  int scaler_format_ = AV_PIX_FMT_NONE;
  bool drained_ = false;
  std::vector<std::uint8_t> padded_;
  Frame frame_;
  Frame part_;
};

Result<void> LibavVideo::OpenCodec() {
  const AVCodecParameters* parameters = input_.format()->streams[input_.stream()]->codecpar;
  if (parameters->width > budget_.limits().max_width_px ||
      parameters->height > budget_.limits().max_height_px) {
    return Fault(fmt::format("frames of {}x{} px; at most {}x{} are read", parameters->width,
                             parameters->height, budget_.limits().max_width_px,
                             budget_.limits().max_height_px));
  }
  const AVCodec* found = avcodec_find_decoder(parameters->codec_id);
  if (found == nullptr) {
    return Fault(fmt::format("libav has no decoder for '{}' here; record it as MJPEG",
                             avcodec_get_name(parameters->codec_id)));
  }
  codec_.reset(avcodec_alloc_context3(found));
  decoded_.reset(av_frame_alloc());
  packet_.reset(av_packet_alloc());
  if (!codec_ || !decoded_ || !packet_) return Fault("out of memory");
  avcodec_parameters_to_context(codec_.get(), parameters);
  codec_->err_recognition = AV_EF_EXPLODE | AV_EF_CRCCHECK | AV_EF_BITSTREAM | AV_EF_BUFFER;
  codec_->max_pixels =
      static_cast<std::int64_t>(MostPixelsOf(parameters->codec_id, budget_.limits().max_pixels));
  if (const int error = avcodec_open2(codec_.get(), found, nullptr); error < 0) {
    return Fault(fmt::format("its codec '{}' cannot be opened ({}); record it as MJPEG",
                             found->name, ExplainLibav(error)));
  }
  return {};
}

/// Tells the decoder that there are no more packets.
Result<void> LibavVideo::Drain() {
  drained_ = true;
  avcodec_send_packet(codec_.get(), nullptr);
  return {};
}

/// Hands one packet of the stream to the decoder, or tells it that there are no more.
Result<void> LibavVideo::Feed() {
  const int read = input_.Next(packet_.get());
  if (read == AVERROR_EOF) return Drain();
  if (read < 0) {
    return Fault(!input_.fault().empty()
                     ? input_.fault()
                     : fmt::format("reading after frame {} failed ({}); record the line again",
                                   budget_.frames(), ExplainLibav(read)));
  }
  const bool corrupt = (packet_->flags & AV_PKT_FLAG_CORRUPT) != 0;
  if (corrupt && input_.unfinished()) {
    av_packet_unref(packet_.get());
    return Drain();
  }
  const auto cost = codec_->codec_id == AV_CODEC_ID_MJPEG && !corrupt
                        ? CheckMjpegFrame({packet_->data, static_cast<std::size_t>(packet_->size)},
                                          budget_.limits().max_pixels)
                        : Result<void>();
  const int sent =
      corrupt || !cost ? AVERROR_INVALIDDATA : avcodec_send_packet(codec_.get(), packet_.get());
  av_packet_unref(packet_.get());
  if (!cost) return Fault(fmt::format("frame {}: {}", budget_.frames() + 1, cost.error().message));
  if (sent < 0) {
    return Fault(fmt::format("frame {} is damaged or cut off ({}); record the line again",
                             budget_.frames() + 1, ExplainLibav(sent)));
  }
  return {};
}

/// Fills `decoded_`; false at the end of the video.
Result<bool> LibavVideo::DecodeNext() {
  for (;;) {
    const int received = avcodec_receive_frame(codec_.get(), decoded_.get());
    if (received == AVERROR_EOF) {
      return false;
    }
    if (received == AVERROR(EAGAIN)) {
      if (auto fed = Feed(); !fed) {
        return tl::unexpected(fed.error());
      }
      continue;
    }
    if (received < 0 || (decoded_->flags & AV_FRAME_FLAG_CORRUPT) != 0 ||
        decoded_->decode_error_flags != 0) {
      return Fault(fmt::format("frame {} is damaged or cut off ({}); record the line again",
                               budget_.frames() + 1,
                               received < 0 ? ExplainLibav(received) : "decoder's flag"));
    }
    return true;
  }
}

/// DecodeNext(), whose time is bounded: what a packet costs depends on the codec, not on its bytes.
Result<bool> LibavVideo::DecodeWithin() {
  const Clock::time_point begin = Clock::now();
  auto more = DecodeNext();
  const auto in_time = budget_.AddTime(Clock::now() - begin);
  if (more && !in_time) return Fault(in_time.error().message);
  return more;
}

/// Turns `decoded_` into `frame_`, BGR.
Result<void> LibavVideo::Convert() {
  const int width = decoded_->width;
  const int height = decoded_->height;
  if (frame_.width == 0) frame_ = Frame(width, height);
  const auto source = static_cast<AVPixelFormat>(decoded_->format);
  if (!scaler_ || scaler_format_ != decoded_->format) {
    scaler_.reset(sws_getContext(
        width, height, WithoutRange(source), width, height, AV_PIX_FMT_BGR24,
        SWS_BILINEAR | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, nullptr, nullptr, nullptr));
    if (!scaler_) {
      return Fault("its pixel format cannot be turned into colours; record it as MJPEG");
    }
    scaler_format_ = decoded_->format;
    const bool full = decoded_->color_range == AVCOL_RANGE_JPEG || WithoutRange(source) != source;
    const int* matrix = sws_getCoefficients(SWS_CS_DEFAULT);
    sws_setColorspaceDetails(scaler_.get(), matrix, full ? 1 : 0, matrix, 1, 0, 1 << 16, 1 << 16);
  }
  // The scaler's fast paths write whole vectors, beyond the end of a row; hence rows of its own.
  const std::size_t row_bytes = static_cast<std::size_t>(width) * 3;
  const std::size_t stride = (row_bytes + 127) / 64 * 64;
  padded_.resize(stride * static_cast<std::size_t>(height));
  std::array<std::uint8_t*, 4> planes{padded_.data(), nullptr, nullptr, nullptr};
  std::array<int, 4> strides{static_cast<int>(stride), 0, 0, 0};
  sws_scale(scaler_.get(), decoded_->data, decoded_->linesize, 0, height, planes.data(),
            strides.data());
  for (int y = 0; y < height; ++y) {
    std::copy_n(padded_.data() + static_cast<std::size_t>(y) * stride, row_bytes, frame_.row(y));
  }
  const std::int64_t stamp = decoded_->best_effort_timestamp;
  frame_.time_s.reset();
  if (stamp != AV_NOPTS_VALUE) {
    frame_.time_s =
        static_cast<double>(stamp) * av_q2d(input_.format()->streams[input_.stream()]->time_base);
  }
  return {};
}

Result<bool> LibavVideo::Advance() {
  auto more = DecodeWithin();
  if (!more) return more;
  if (!*more) {
    if (budget_.frames() == 0) return Fault("holds no frames; record the line again");
    return false;
  }
  const double pixels = static_cast<double>(decoded_->width) * decoded_->height;
  if (auto added = budget_.AddFrame(decoded_->width, decoded_->height, pixels); !added) {
    return Fault(added.error().message);
  }
  return true;
}

Result<const Frame*> LibavVideo::Decode(const PixelRect& part) {
  if (auto converted = Convert(); !converted) return tl::unexpected(converted.error());
  if (part.width == frame_.width && part.height == frame_.height) return &frame_;
  const BgrView view = Crop(frame_.view(), part);
  if (part_.width != part.width || part_.height != part.height) {
    part_ = Frame(part.width, part.height);
  }
  for (int y = 0; y < part.height; ++y) {
    std::copy_n(view.row(y), std::size_t{3} * static_cast<std::size_t>(part.width), part_.row(y));
  }
  part_.time_s = frame_.time_s;
  return &part_;
}

}  // namespace

Result<std::unique_ptr<VideoDecoder>> OpenLibavVideo(const std::filesystem::path& path,
                                                     const VideoLimits& limits) {
  auto input = VideoInput::Open(path, limits.max_pixels);
  if (!input) return Broken(path, input.error().message);
  auto video = std::make_unique<LibavVideo>(path, limits, std::move(*input));
  if (auto opened = video->OpenCodec(); !opened) return tl::unexpected(opened.error());
  return video;
}

}  // namespace trammel::machine
