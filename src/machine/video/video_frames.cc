#include <fmt/format.h>

#include <string>
#include <utility>

#include "machine/camera/frame_check.h"
#include "machine/camera/frame_files.h"
#include "machine/module/module.h"
#include "machine/net/host_clock.h"
#include "machine/video/avi_packets.h"
#include "machine/video/video_module.h"

namespace trammel::machine {
namespace {

class VideoFrames final : public FrameSource {
 public:
  VideoFrames(std::filesystem::path path, std::unique_ptr<VideoPackets> packets)
      : path_(std::move(path)), packets_(std::move(packets)) {}

  Result<std::optional<CapturedFrame>> Next(double time_limit_s, std::stop_token stop) override;
  [[nodiscard]] std::string Describe() const override {
    return fmt::format("video {}, {}x{} px", path_.string(), packets_->width_px(),
                       packets_->height_px());
  }
  [[nodiscard]] bool live() const override { return false; }

 private:
  std::filesystem::path path_;
  std::unique_ptr<VideoPackets> packets_;
  std::uint64_t frames_ = 0;
  FrameChecker checker_;
};

Result<std::optional<CapturedFrame>> VideoFrames::Next(double, std::stop_token stop) {
  if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
  VideoPacket packet;
  const auto more = packets_->Next(packet);
  if (!more) return tl::unexpected(more.error());
  if (!*more) return std::nullopt;
  CapturedFrame frame;
  frame.arrival_s = HostNow();
  frame.image = std::move(packet.bytes);
  if (const auto time_s = packet.time_s) {
    frame.captured = CameraTime{*time_s, CameraClock::kRecording};
  }
  frame.sequence = frames_++;
  checker_.Check(frame);
  return frame;
}

}  // namespace

Result<std::unique_ptr<FrameSource>> OpenVideoFrames(const std::filesystem::path& path,
                                                     const CameraOptions& options) {
  auto packets = OpenAviPackets(path, options.max_frame_bytes);
  if (packets && *packets == nullptr) {
    const auto module = LoadModule<VideoModule>(kVideoModule);
    if (!module) return tl::unexpected(module.error());
    packets = (*module)->open_packets(path, options.max_frame_bytes);
  }
  if (!packets) return tl::unexpected(packets.error());
  return std::make_unique<VideoFrames>(path, std::move(*packets));
}

}  // namespace trammel::machine
