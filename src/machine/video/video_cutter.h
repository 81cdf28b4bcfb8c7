// Cuts the frames of a recorded video to the part that is read of them, without loss.
#pragma once

#include <cstddef>
#include <filesystem>
#include <stop_token>

#include "base/frame.h"
#include "base/result.h"
#include "files/new_file.h"

namespace trammel::machine {

struct VideoCut {
  PixelRect part;                ///< of every frame; keeps its pixels to the bit
  std::size_t whole_every = 60;  ///< >= 1; of so many frames the first stays whole
  double frames_per_s = 30;      ///< > 0; for players
};

/// A cut video, still beside the one that it is to replace: after a crash at any moment, on a full
/// disk, or if it is dropped, that one is as it was.
class CutVideo {
 public:
  /// Writes it. A frame that cannot be cut stays whole. VideoFile reads it as it reads the video,
  /// but for what the cut frames no longer hold.
  /// Errors: not MJPEG in AVI, a damaged file or frame (kMeasurement), the disk's, kInterrupted.
  /// Memory: one frame, and 2 bytes a sample of it.
  [[nodiscard]] static Result<CutVideo> Write(const std::filesystem::path& video,
                                              const VideoCut& cut, const std::stop_token& stop);

  [[nodiscard]] std::filesystem::path path() const { return file_.temporary_path(); }

  /// Puts it in the video's place, from which it takes over the time of its last change: it shows
  /// nothing new. Once, at the end. Errors: the disk's.
  [[nodiscard]] Result<void> TakePlace();

 private:
  CutVideo(std::filesystem::path video, files::NewFile file)
      : video_(std::move(video)), file_(std::move(file)) {}

  std::filesystem::path video_;
  files::NewFile file_;
};

}  // namespace trammel::machine
