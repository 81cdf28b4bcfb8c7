// Recorded video, read frame by frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "base/frame.h"
#include "base/result.h"

namespace trammel::machine {

struct VideoLimits {
  int max_width_px = 16384;             ///< per frame, >= 1
  int max_height_px = 16384;            ///< per frame, >= 1
  std::size_t max_pixels = 50'000'000;  ///< per frame; a decoded frame takes 3 bytes a pixel
  std::size_t max_frames = 100'000;     ///< per file
  double max_pixels_in_all = 20e9;      ///< total of all frames: 80 s of 4K at 30 frames/s
  double max_decoding_s = 600;          ///< total of all frames, on this computer
};

/// Decodes the frames of an MJPEG in AVI, as written by printers' cameras and trammel. The file is
/// untrusted: the header's frame count is never used, and a damaged frame is an error, not a
/// picture.
///
/// Work is done on demand: Advance() alone does not decode, Decode() of a part skips the transform
/// and colours of the rest.
class VideoFile {
 public:
  /// Fails with kMeasurement if the file is missing, empty, without frames, truncated, or another
  /// video, with the command that converts it.
  [[nodiscard]] static Result<VideoFile> Open(const std::filesystem::path& path,
                                              const VideoLimits& limits = {});

  VideoFile(VideoFile&&) noexcept;
  VideoFile& operator=(VideoFile&&) noexcept;
  ~VideoFile();

  /// Advances to the next frame; false after the last. Fails with kMeasurement on a frame of
  /// another size than the first, and for more than limits.max_frames.
  [[nodiscard]] Result<bool> Advance();

  /// Size of the frames. REQUIRES that Advance() returned true.
  [[nodiscard]] int width_px() const;
  [[nodiscard]] int height_px() const;

  /// Returns the part of the frame in the file: the whole, unless the frame was cut
  /// (video_cutter.h); it may be empty. REQUIRES that Advance() returned true.
  [[nodiscard]] PixelRect readable() const;

  /// Decodes a part of the current frame, bit-identical to the whole frame's; the next call reuses
  /// its memory. Frame::time_s is the AVI's, absent if it states none. REQUIRES that Advance()
  /// returned true, no earlier call for this frame, and `part` within the frame. Fails with
  /// kMeasurement if `part` exceeds readable(), and on a damaged frame, wherever the damage is.
  [[nodiscard]] Result<const Frame*> Decode(const PixelRect& part);

  /// Advances and decodes the whole next frame: nullptr after the last.
  [[nodiscard]] Result<const Frame*> Next();

 private:
  struct State;
  explicit VideoFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Checks the size of an MJPEG frame, and the work of decoding it.
[[nodiscard]] Result<void> CheckMjpegFrame(std::span<const std::uint8_t> jpeg,
                                           std::size_t most_pixels);

}  // namespace trammel::machine
