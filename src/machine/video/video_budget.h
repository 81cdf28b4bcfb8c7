// Limits what the frames of one video may cost.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/result.h"
#include "machine/video/video_file.h"

namespace trammel::machine {

/// Counts frames, pixels and time. Messages do not name the file.
class VideoBudget {
 public:
  explicit VideoBudget(const VideoLimits& limits) : limits_(limits) {}

  /// Accepts the next frame's size, or says what is wrong: too many frames, too large a one, one of
  /// another size than the first, too many pixels in all.
  /// @param stored_pixels  that the file has of the frame: all of them, but of a cut one.
  [[nodiscard]] Result<void> AddFrame(int width_px, int height_px, double stored_pixels);

  /// Adds to the time that decoding took.
  [[nodiscard]] Result<void> AddTime(std::chrono::steady_clock::duration time);

  [[nodiscard]] std::size_t frames() const { return frames_; }  ///< accepted so far
  [[nodiscard]] const VideoLimits& limits() const { return limits_; }

 private:
  VideoLimits limits_;
  std::size_t frames_ = 0;
  int width_px_ = 0;
  int height_px_ = 0;
  double pixels_ = 0;
  std::chrono::steady_clock::duration decoding_{};
};

/// Whether a frame of an MJPEG video may be decoded: its size, and the work that it asks for.
[[nodiscard]] Result<void> CheckMjpegFrame(std::span<const std::uint8_t> jpeg,
                                           std::size_t most_pixels);

}  // namespace trammel::machine
