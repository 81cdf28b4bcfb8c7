extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <fmt/format.h>

#include <array>
#include <string>
#include <utility>

#include "machine/frame_check.h"
#include "machine/frame_files.h"
#include "machine/host_clock.h"

namespace trammel::machine {
namespace {

struct CloseFormat {
  void operator()(AVFormatContext* p) const { avformat_close_input(&p); }
};
struct FreePacket {
  void operator()(AVPacket* p) const { av_packet_free(&p); }
};

std::string Explain(int error) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(error, text.data(), text.size());
  return text.data();
}

class VideoFrames final : public FrameSource {
 public:
  VideoFrames(std::filesystem::path path, std::size_t most_bytes)
      : path_(std::move(path)), most_bytes_(most_bytes), packet_(av_packet_alloc()) {}

  Result<void> Open();
  Result<std::optional<CapturedFrame>> Next(double time_limit_s, std::stop_token stop) override;
  [[nodiscard]] std::string Describe() const override {
    return fmt::format("video {}, {}x{} px", path_.string(),
                       format_->streams[stream_]->codecpar->width,
                       format_->streams[stream_]->codecpar->height);
  }
  [[nodiscard]] bool live() const override { return false; }

 private:
  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("video '{}': {}", path_.string(), what), ErrorKind::kMeasurement);
  }

  std::filesystem::path path_;
  std::size_t most_bytes_;
  std::unique_ptr<AVFormatContext, CloseFormat> format_;
  std::unique_ptr<AVPacket, FreePacket> packet_;
  int stream_ = -1;
  std::uint64_t frames_ = 0;
  FrameChecker checker_;
};

Result<void> VideoFrames::Open() {
  av_log_set_level(AV_LOG_QUIET);
  AVFormatContext* format = nullptr;
  // The protocol is spelled out: a name such as "http:x" must stay a file's name.
  const std::string url = "file:" + path_.string();
  if (const int error = avformat_open_input(&format, url.c_str(), nullptr, nullptr); error < 0) {
    return Broken(fmt::format("not a video that can be read ({})", Explain(error)));
  }
  format_.reset(format);
  if (avformat_find_stream_info(format, nullptr) < 0 ||
      (stream_ = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0)) < 0) {
    return Broken("holds no video");
  }
  const AVCodecID codec = format->streams[stream_]->codecpar->codec_id;
  if (codec != AV_CODEC_ID_MJPEG) {
    return Broken(
        fmt::format("holds {} rather than MJPEG; convert it with: ffmpeg -i IN -c:v mjpeg "
                    "-q:v 2 OUT.avi",
                    avcodec_get_name(codec)));
  }
  return {};
}

Result<std::optional<CapturedFrame>> VideoFrames::Next(double, std::stop_token stop) {
  for (;;) {
    if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
    const int read = av_read_frame(format_.get(), packet_.get());
    if (read == AVERROR_EOF) {
      if (frames_ == 0) return Broken("holds no frames");
      return std::nullopt;
    }
    if (read < 0) {
      return Broken(fmt::format("reading after frame {} failed ({})", frames_, Explain(read)));
    }
    const auto size = static_cast<std::size_t>(packet_->size);
    if (packet_->stream_index != stream_ || size == 0) {
      av_packet_unref(packet_.get());
      continue;
    }
    if (size > most_bytes_) {
      return Broken(fmt::format("frame {} has {} bytes, more than the {} that are read",
                                frames_ + 1, size, most_bytes_));
    }
    CapturedFrame frame;
    frame.arrival_s = HostNow();
    frame.image.assign(packet_->data, packet_->data + size);
    const std::int64_t stamp = packet_->pts != AV_NOPTS_VALUE ? packet_->pts : packet_->dts;
    if (stamp != AV_NOPTS_VALUE) {
      frame.captured =
          CameraTime{static_cast<double>(stamp) * av_q2d(format_->streams[stream_]->time_base),
                     CameraClock::kRecording};
    }
    frame.sequence = frames_++;
    av_packet_unref(packet_.get());
    checker_.Check(frame);
    return frame;
  }
}

}  // namespace

Result<std::unique_ptr<FrameSource>> OpenVideoFrames(const std::filesystem::path& path,
                                                     const CameraOptions& options) {
  auto video = std::make_unique<VideoFrames>(path, options.max_frame_bytes);
  if (auto opened = video->Open(); !opened) return tl::unexpected(opened.error());
  return video;
}

}  // namespace trammel::machine
