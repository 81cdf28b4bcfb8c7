// What the module with FFmpeg's libraries does: trammel-video.so.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "machine/video/video_file.h"

namespace trammel::machine {

/// One frame as it is stored.
struct VideoPacket {
  std::vector<std::uint8_t> bytes;
  std::optional<double> time_s;  ///< on the recording's clock
};

/// The packets of an MJPEG video.
class VideoPackets {
 public:
  VideoPackets() = default;
  VideoPackets(const VideoPackets&) = delete;
  VideoPackets& operator=(const VideoPackets&) = delete;
  virtual ~VideoPackets() = default;

  /// Fills in the next one, in memory that is reused; false after the last. Errors (kMeasurement).
  [[nodiscard]] virtual Result<bool> Next(VideoPacket& packet) = 0;
  [[nodiscard]] virtual int width_px() const = 0;   ///< that its head states
  [[nodiscard]] virtual int height_px() const = 0;  ///< that its head states
  [[nodiscard]] virtual std::int64_t file_bytes() const = 0;
};

/// The frames of a video: VideoFile's contract.
class VideoDecoder {
 public:
  VideoDecoder() = default;
  VideoDecoder(const VideoDecoder&) = delete;
  VideoDecoder& operator=(const VideoDecoder&) = delete;
  virtual ~VideoDecoder() = default;

  [[nodiscard]] virtual Result<bool> Advance() = 0;
  [[nodiscard]] virtual int width_px() const = 0;
  [[nodiscard]] virtual int height_px() const = 0;
  [[nodiscard]] virtual PixelRect readable() const { return {0, 0, width_px(), height_px()}; }
  [[nodiscard]] virtual Result<const Frame*> Decode(const PixelRect& part) = 0;
};

/// Messages name the file. Errors are kMeasurement.
struct VideoModule {
  Result<std::unique_ptr<VideoDecoder>> (*open)(const std::filesystem::path& path,
                                                const VideoLimits& limits);
  /// @param most_bytes  of a packet. Errors: also where the codec is another than MJPEG.
  Result<std::unique_ptr<VideoPackets>> (*open_packets)(const std::filesystem::path& path,
                                                        std::size_t most_bytes);
};

}  // namespace trammel::machine
