// A recorded video, frame by frame.
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
  int max_width_px = 16384;             ///< of one frame, >= 1
  int max_height_px = 16384;            ///< of one frame, >= 1
  std::size_t max_pixels = 50'000'000;  ///< of one frame; a decoded frame takes 3 bytes a pixel
  std::size_t max_frames = 100'000;     ///< in the file
  double max_pixels_in_all = 20e9;      ///< of all frames: 80 s of 4K with 30 frames/s
  double max_decoding_s = 600;          ///< of all frames, on this computer
};

/// Decodes the frames of an MJPEG in AVI, as cameras on printers and trammel write it. The file is
/// not believed: a frame count in its header is never used, and a damaged frame is an error rather
/// than a picture.
///
/// A frame costs what is asked of it: Advance() alone leaves a frame undecoded, Decode() of a part
/// leaves out transform and colours of the rest.
class VideoFile {
 public:
  /// Fails with kMeasurement where the file is missing, empty, without frames, cut off, or another
  /// video, whose message has the command that converts it.
  [[nodiscard]] static Result<VideoFile> Open(const std::filesystem::path& path,
                                              const VideoLimits& limits = {});

  VideoFile(VideoFile&&) noexcept;
  VideoFile& operator=(VideoFile&&) noexcept;
  ~VideoFile();

  /// Goes on to the next frame; false after the last. Fails with kMeasurement on a frame of another
  /// size than the first, and where there are more than limits.max_frames.
  [[nodiscard]] Result<bool> Advance();

  /// Of the frames. REQUIRES that Advance() said true.
  [[nodiscard]] int width_px() const;
  [[nodiscard]] int height_px() const;

  /// The part of the frame that the file still has: all of it, unless the frame was cut to a part
  /// of itself (video_cutter.h); it may be empty. REQUIRES that Advance() said true.
  [[nodiscard]] PixelRect readable() const;

  /// Decodes a part of the frame that Advance() went to, to the same bits as in the whole frame;
  /// its memory is reused by the next call. Frame::time_s is that of the AVI, absent where it
  /// states none. REQUIRES that Advance() said true, no call for this frame before,
  /// and that `part` lies within the frame. Fails with kMeasurement where `part` reaches out of
  /// readable(), and on a damaged frame, wherever its damage lies.
  [[nodiscard]] Result<const Frame*> Decode(const PixelRect& part);

  /// Both for the whole of the next frame: nullptr after the last.
  [[nodiscard]] Result<const Frame*> Next();

 private:
  struct State;
  explicit VideoFile(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Whether a frame of an MJPEG video may be decoded: its size, and the work that it asks for.
[[nodiscard]] Result<void> CheckMjpegFrame(std::span<const std::uint8_t> jpeg,
                                           std::size_t most_pixels);

}  // namespace trammel::machine
