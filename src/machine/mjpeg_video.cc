#include "machine/mjpeg_video.h"

#include <fmt/format.h>

#include <chrono>
#include <string>
#include <utility>

#include "image/jpeg_reader.h"
#include "machine/video_budget.h"

namespace trammel::machine {
namespace {

class MjpegVideo final : public VideoDecoder {
 public:
  MjpegVideo(std::filesystem::path path, std::unique_ptr<VideoPackets> packets,
             const VideoLimits& limits)
      : path_(std::move(path)),
        packets_(std::move(packets)),
        budget_(limits, packets_->file_bytes()) {}

  Result<const Frame*> Next() override;

 private:
  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("video '{}': {}", path_.string(), what), ErrorKind::kMeasurement);
  }
  Result<void> Decode(std::span<const std::uint8_t> jpeg);

  std::filesystem::path path_;
  std::unique_ptr<VideoPackets> packets_;
  VideoBudget budget_;
  Frame frame_;
};

/// Fills `frame_`. Messages do not name the file.
Result<void> MjpegVideo::Decode(std::span<const std::uint8_t> jpeg) {
  const std::size_t number = budget_.frames() + 1;
  if (auto cost = CheckMjpegFrame(jpeg, budget_.limits().max_pixels); !cost) {
    return Fail(fmt::format("frame {}: {}", number, cost.error().message));
  }
  const auto damaged = [&](const Error& error) {
    return Fail(fmt::format("frame {} is damaged or cut off ({}); record the line again", number,
                            error.message));
  };
  auto reader = image::JpegReader::Open(jpeg, image::JpegDamage::kRefuse);
  if (!reader) return damaged(reader.error());
  const image::JpegHeader& header = reader->header();
  if (auto added = budget_.AddFrame(header.width_px, header.height_px); !added) return added;
  if (auto started = reader->Start(image::JpegPixels::kBgr); !started) {
    return damaged(started.error());
  }
  if (frame_.width == 0) frame_ = Frame(header.width_px, header.height_px);
  for (int y = 0; y < frame_.height; ++y) {
    if (auto read = reader->ReadRow(frame_.row(y)); !read) return damaged(read.error());
  }
  return {};
}

Result<const Frame*> MjpegVideo::Next() {
  using Clock = std::chrono::steady_clock;
  const auto packet = packets_->Next();
  if (!packet) return tl::unexpected(packet.error());
  if (!*packet) return nullptr;
  const Clock::time_point begin = Clock::now();
  if (auto decoded = Decode((*packet)->bytes); !decoded) return Broken(decoded.error().message);
  if (auto in_time = budget_.AddTime(Clock::now() - begin); !in_time) {
    return Broken(in_time.error().message);
  }
  frame_.time_s = (*packet)->time_s;
  return &frame_;
}

}  // namespace

std::unique_ptr<VideoDecoder> DecodeMjpeg(const std::filesystem::path& path,
                                          std::unique_ptr<VideoPackets> packets,
                                          const VideoLimits& limits) {
  return std::make_unique<MjpegVideo>(path, std::move(packets), limits);
}

}  // namespace trammel::machine
