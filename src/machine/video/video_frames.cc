#include <fmt/format.h>

#include <string>
#include <utility>

#include "machine/camera/frame_check.h"
#include "machine/camera/frame_files.h"
#include "machine/net/host_clock.h"
#include "machine/video/avi_reader.h"

namespace trammel::machine {
namespace {

class VideoFrames final : public FrameSource {
 public:
  VideoFrames(std::filesystem::path path, AviReader avi)
      : path_(std::move(path)), avi_(std::move(avi)) {}

  Result<std::optional<CapturedFrame>> Next(double time_limit_s, std::stop_token stop) override;
  [[nodiscard]] std::string Describe() const override {
    return fmt::format("video {}, {}x{} px", path_.string(), avi_.width_px(), avi_.height_px());
  }
  [[nodiscard]] bool live() const override { return false; }

 private:
  std::filesystem::path path_;
  AviReader avi_;
  std::uint64_t frames_ = 0;
  FrameChecker checker_;
};

Result<std::optional<CapturedFrame>> VideoFrames::Next(double, std::stop_token stop) {
  if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
  AviFrame stored;
  const auto more = TRY(avi_.Next(stored));
  if (!more) return std::nullopt;
  CapturedFrame frame;
  frame.arrival_s = HostNow();
  frame.image = std::move(stored.bytes);
  if (const auto time_s = stored.time_s) {
    frame.captured = CameraTime{*time_s, CameraClock::kRecording};
  }
  frame.sequence = frames_++;
  checker_.Check(frame);
  return frame;
}

}  // namespace

Result<std::unique_ptr<FrameSource>> OpenVideoFrames(const std::filesystem::path& path,
                                                     const CameraOptions& options) {
  auto avi = TRY(AviReader::Open(path, options.max_frame_bytes));
  return std::make_unique<VideoFrames>(path, std::move(avi));
}

}  // namespace trammel::machine
