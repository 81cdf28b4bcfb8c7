extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "machine/frame_check.h"
#include "machine/frame_files.h"
#include "machine/host_clock.h"
#include "machine/video_input.h"

namespace trammel::machine {
namespace {

struct FreePacket {
  void operator()(AVPacket* p) const { av_packet_free(&p); }
};

class VideoFrames final : public FrameSource {
 public:
  VideoFrames(std::filesystem::path path, std::size_t most_bytes)
      : path_(std::move(path)), most_bytes_(most_bytes), packet_(av_packet_alloc()) {}

  Result<void> Open();
  Result<std::optional<CapturedFrame>> Next(double time_limit_s, std::stop_token stop) override;
  [[nodiscard]] std::string Describe() const override {
    const AVCodecParameters* parameters = Stream().codecpar;
    return fmt::format("video {}, {}x{} px", path_.string(), parameters->width, parameters->height);
  }
  [[nodiscard]] bool live() const override { return false; }

 private:
  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("video '{}': {}", path_.string(), what), ErrorKind::kMeasurement);
  }

  [[nodiscard]] const AVStream& Stream() const {
    return *input_->format()->streams[input_->stream()];
  }

  std::filesystem::path path_;
  std::size_t most_bytes_;
  std::optional<VideoInput> input_;
  std::unique_ptr<AVPacket, FreePacket> packet_;
  std::uint64_t frames_ = 0;
  FrameChecker checker_;
};

Result<void> VideoFrames::Open() {
  constexpr std::size_t kMostPixels = 50'000'000;  // that DecodeFrame() reads
  auto input = VideoInput::Open(path_, kMostPixels);
  if (!input) return Broken(input.error().message);
  input_.emplace(std::move(*input));
  const AVCodecID codec = Stream().codecpar->codec_id;
  if (codec != AV_CODEC_ID_MJPEG) {
    return Broken(
        fmt::format("holds {} rather than MJPEG; convert it with: ffmpeg -i IN -c:v mjpeg "
                    "-q:v 2 OUT.avi",
                    avcodec_get_name(codec)));
  }
  return {};
}

Result<std::optional<CapturedFrame>> VideoFrames::Next(double, std::stop_token stop) {
  if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
  const int read = input_->Next(packet_.get());
  if (read == AVERROR_EOF) {
    if (frames_ == 0) return Broken("holds no frames");
    return std::nullopt;
  }
  if (read < 0) {
    return Broken(!input_->fault().empty() ? input_->fault()
                                           : fmt::format("reading after frame {} failed ({})",
                                                         frames_, ExplainLibav(read)));
  }
  const auto size = static_cast<std::size_t>(packet_->size);
  if (size > most_bytes_) {
    av_packet_unref(packet_.get());
    return Broken(fmt::format("frame {} has {} bytes, more than the {} that are read", frames_ + 1,
                              size, most_bytes_));
  }
  CapturedFrame frame;
  frame.arrival_s = HostNow();
  frame.image.assign(packet_->data, packet_->data + size);
  const std::int64_t stamp = packet_->pts != AV_NOPTS_VALUE ? packet_->pts : packet_->dts;
  if (stamp != AV_NOPTS_VALUE) {
    frame.captured = CameraTime{static_cast<double>(stamp) * av_q2d(Stream().time_base),
                                CameraClock::kRecording};
  }
  frame.sequence = frames_++;
  av_packet_unref(packet_.get());
  checker_.Check(frame);
  return frame;
}

}  // namespace

Result<std::unique_ptr<FrameSource>> OpenVideoFrames(const std::filesystem::path& path,
                                                     const CameraOptions& options) {
  auto video = std::make_unique<VideoFrames>(path, options.max_frame_bytes);
  if (auto opened = video->Open(); !opened) return tl::unexpected(opened.error());
  return video;
}

}  // namespace trammel::machine
