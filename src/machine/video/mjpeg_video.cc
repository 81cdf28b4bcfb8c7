#include "machine/video/mjpeg_video.h"

#include <fmt/format.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "base/pixel_rects.h"
#include "image/jpeg_reader.h"
#include "machine/video/video_budget.h"

namespace trammel::machine {
namespace {

using Clock = std::chrono::steady_clock;

class MjpegVideo final : public VideoDecoder {
 public:
  MjpegVideo(std::filesystem::path path, std::unique_ptr<VideoPackets> packets,
             const VideoLimits& limits)
      : path_(std::move(path)),
        packets_(std::move(packets)),
        budget_(limits, packets_->file_bytes()) {}

  Result<bool> Advance() override;
  [[nodiscard]] int width_px() const override { return place_.whole_width; }
  [[nodiscard]] int height_px() const override { return place_.whole_height; }
  [[nodiscard]] PixelRect readable() const override {
    return image::ExactPart(place_, reader_->header().grid());
  }
  Result<const Frame*> Decode(const PixelRect& part) override;

 private:
  [[nodiscard]] tl::unexpected<Error> Broken(const std::string& what) const {
    return Fail(fmt::format("video '{}': {}", path_.string(), what), ErrorKind::kMeasurement);
  }
  [[nodiscard]] static tl::unexpected<Error> Damaged(std::size_t number, const Error& error) {
    return Fail(fmt::format("frame {} is damaged or cut off ({}); record the line again", number,
                            error.message));
  }
  Result<void> OpenFrame();
  Result<void> DecodeFrame(const PixelRect& part);

  std::filesystem::path path_;
  std::unique_ptr<VideoPackets> packets_;
  VideoBudget budget_;
  VideoPacket packet_;
  std::optional<image::JpegReader> reader_;  // of packet_
  image::JpegPlace place_;                   // of what is stored in the frame
  Frame frame_;
};

/// Opens `packet_`. Messages of this and the next do not name the file.
Result<void> MjpegVideo::OpenFrame() {
  const std::size_t number = budget_.frames() + 1;
  if (auto cost =
          CheckMjpegFrame(packet_.bytes, budget_.limits().max_pixels, image::JpegScans::kRead);
      !cost) {
    return Fail(fmt::format("frame {}: {}", number, cost.error().message));
  }
  auto reader = image::JpegReader::Open(packet_.bytes, image::JpegDamage::kRefuse);
  if (!reader) return Damaged(number, reader.error());
  reader_ = std::move(*reader);
  const image::JpegHeader& header = reader_->header();
  place_ = header.place.value_or(image::JpegPlace{0, 0, header.width_px, header.height_px});
  return budget_.AddFrame(place_.whole_width, place_.whole_height,
                          static_cast<double>(header.width_px) * header.height_px);
}

/// Fills `frame_`.
Result<void> MjpegVideo::DecodeFrame(const PixelRect& part) {
  const std::size_t number = budget_.frames();
  const PixelRect held = readable();
  if (!Contains(held, part)) {
    return Fail(fmt::format(
        "frame {} was cut: {}x{} px at ({}, {}) of it can be read, not {}x{} "
        "at ({}, {})",
        number, held.width, held.height, held.x, held.y, part.width, part.height, part.x, part.y));
  }
  const PixelRect stored{part.x - place_.x, part.y - place_.y, part.width, part.height};
  if (frame_.width != part.width || frame_.height != part.height) {
    frame_ = Frame(part.width, part.height);
  }
  frame_.time_s = packet_.time_s;
  auto read = reader_->StartPart(image::JpegPixels::kBgr, stored);
  for (int y = 0; read && y < stored.height; ++y) read = reader_->ReadRow(frame_.row(y));
  if (read) read = reader_->ReadRest();
  return read ? read : Damaged(number, read.error());
}

Result<bool> MjpegVideo::Advance() {
  const auto more = packets_->Next(packet_);
  if (!more || !*more) return more;
  const Clock::time_point begin = Clock::now();
  if (auto opened = OpenFrame(); !opened) return Broken(opened.error().message);
  if (auto in_time = budget_.AddTime(Clock::now() - begin); !in_time) {
    return Broken(in_time.error().message);
  }
  return true;
}

Result<const Frame*> MjpegVideo::Decode(const PixelRect& part) {
  const Clock::time_point begin = Clock::now();
  if (auto decoded = DecodeFrame(part); !decoded) return Broken(decoded.error().message);
  if (auto in_time = budget_.AddTime(Clock::now() - begin); !in_time) {
    return Broken(in_time.error().message);
  }
  return &frame_;
}

}  // namespace

std::unique_ptr<VideoDecoder> DecodeMjpeg(const std::filesystem::path& path,
                                          std::unique_ptr<VideoPackets> packets,
                                          const VideoLimits& limits) {
  return std::make_unique<MjpegVideo>(path, std::move(packets), limits);
}

}  // namespace trammel::machine
