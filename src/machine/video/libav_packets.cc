#include "machine/video/libav_packets.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <fmt/format.h>

#include <utility>

#include "machine/video/video_input.h"

namespace trammel::machine {
namespace {

struct FreePacket {
  void operator()(AVPacket* p) const { av_packet_free(&p); }
};

class LibavPackets final : public VideoPackets {
 public:
  LibavPackets(std::filesystem::path path, std::size_t most_bytes, VideoInput input)
      : path_(std::move(path)),
        most_bytes_(most_bytes),
        input_(std::move(input)),
        packet_(av_packet_alloc()) {}

  Result<bool> Next(VideoPacket& packet) override;
  [[nodiscard]] int width_px() const override { return Stream().codecpar->width; }
  [[nodiscard]] int height_px() const override { return Stream().codecpar->height; }
  [[nodiscard]] std::int64_t file_bytes() const override { return input_.bytes(); }

 private:
  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("video '{}': {}", path_.string(), what), ErrorKind::kMeasurement);
  }
  [[nodiscard]] const AVStream& Stream() const {
    return *input_.format()->streams[input_.stream()];
  }

  std::filesystem::path path_;
  std::size_t most_bytes_;
  VideoInput input_;
  std::unique_ptr<AVPacket, FreePacket> packet_;
  std::uint64_t packets_ = 0;
};

Result<bool> LibavPackets::Next(VideoPacket& packet) {
  const int read = input_.Next(packet_.get());
  if (read == AVERROR_EOF) {
    if (packets_ == 0) return Broken("holds no frames");
    return false;
  }
  if (read < 0) {
    return Broken(!input_.fault().empty() ? input_.fault()
                                          : fmt::format("reading after frame {} failed ({})",
                                                        packets_, ExplainLibav(read)));
  }
  ++packets_;
  const auto size = static_cast<std::size_t>(packet_->size);
  if (size > most_bytes_) {
    av_packet_unref(packet_.get());
    return Broken(fmt::format("frame {} has {} bytes, more than the {} that are read", packets_,
                              size, most_bytes_));
  }
  packet.time_s.reset();
  packet.bytes.assign(packet_->data, packet_->data + size);
  const std::int64_t stamp = packet_->pts != AV_NOPTS_VALUE ? packet_->pts : packet_->dts;
  if (stamp != AV_NOPTS_VALUE) {
    packet.time_s = static_cast<double>(stamp) * av_q2d(Stream().time_base);
  }
  av_packet_unref(packet_.get());
  return true;
}

}  // namespace

Result<std::unique_ptr<VideoPackets>> OpenLibavPackets(const std::filesystem::path& path,
                                                       std::size_t most_bytes) {
  const auto broken = [&](const std::string& what) {
    return Fail(fmt::format("video '{}': {}", path.string(), what), ErrorKind::kMeasurement);
  };
  constexpr std::size_t kMostPixels = 50'000'000;  // that DecodeFrame() reads
  auto input = VideoInput::Open(path, kMostPixels);
  if (!input) return broken(input.error().message);
  const AVCodecID codec = input->format()->streams[input->stream()]->codecpar->codec_id;
  if (codec != AV_CODEC_ID_MJPEG) {
    return broken(
        fmt::format("holds {} rather than MJPEG; convert it with: ffmpeg -i IN -c:v mjpeg "
                    "-q:v 2 OUT.avi",
                    avcodec_get_name(codec)));
  }
  return std::make_unique<LibavPackets>(path, most_bytes, std::move(*input));
}

}  // namespace trammel::machine
