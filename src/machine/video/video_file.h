// A recorded video, frame by frame.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>

#include "base/frame.h"
#include "base/result.h"

namespace trammel::machine {

struct VideoLimits {
  int max_width_px = 16384;             ///< of one frame, >= 1
  int max_height_px = 16384;            ///< of one frame, >= 1
  std::size_t max_pixels = 50'000'000;  ///< of one frame; a decoded frame takes 3 bytes a pixel
  std::size_t max_frames = 100'000;     ///< in the file
  double max_pixels_in_all = 20e9;      ///< of all frames: 80 s of 4K with 30 frames/s
  double max_pixels_per_byte = 2000;    ///< of the file, beyond the first pixels_for_nothing
  double pixels_for_nothing = 1e9;
  double max_decoding_s = 600;  ///< of all frames, on this computer
};

class VideoDecoder;

/// Decodes the first video stream of a file (see video_input.h; MJPEG in AVI is what cameras on
/// printers write). The file is not believed: a frame count in its header is never used, no other
/// file is opened for it, and a damaged frame is an error rather than a picture.
///
/// A frame costs what is asked of it: Advance() alone leaves a frame of MJPEG undecoded, Decode()
/// of a part leaves out transform and colours of the rest.
///
/// MJPEG in AVI, as trammel records it, is decoded by libjpeg; any other video by the module with
/// FFmpeg's libraries (video_module.h), which is loaded when the first of them is opened. kInput
/// where it is not there.
class VideoFile {
 public:
  /// Fails with kMeasurement where the file is missing, empty, cut off, no video, or too large.
  [[nodiscard]] static Result<VideoFile> Open(const std::filesystem::path& path,
                                              const VideoLimits& limits = {});

  VideoFile(VideoFile&&) noexcept;
  VideoFile& operator=(VideoFile&&) noexcept;
  ~VideoFile();

  /// Goes on to the next frame; false after the last. Fails with kMeasurement on a frame of another
  /// size than the first, where there are more than limits.max_frames, and at the end where there
  /// was no frame at all.
  [[nodiscard]] Result<bool> Advance();

  /// Of the frames. REQUIRES that Advance() said true.
  [[nodiscard]] int width_px() const;
  [[nodiscard]] int height_px() const;

  /// The part of the frame that the file still has: all of it, unless the frame was cut to a part
  /// of itself (video_cutter.h); it may be empty. REQUIRES that Advance() said true.
  [[nodiscard]] PixelRect readable() const;

  /// Decodes a part of the frame that Advance() went to, to the same bits as in the whole frame;
  /// its memory is reused by the next call. Frame::time_s is the container's presentation time,
  /// absent where it has none. REQUIRES that Advance() said true, no call for this frame before,
  /// and that `part` lies within the frame. Fails with kMeasurement where `part` reaches out of
  /// readable(), and on a damaged frame, wherever its damage lies.
  [[nodiscard]] Result<const Frame*> Decode(const PixelRect& part);

  /// Both for the whole of the next frame: nullptr after the last.
  [[nodiscard]] Result<const Frame*> Next();

 private:
  explicit VideoFile(std::unique_ptr<VideoDecoder> decoder);
  std::unique_ptr<VideoDecoder> decoder_;
};

}  // namespace trammel::machine
