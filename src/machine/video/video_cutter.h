// Cuts a recorded video's frames losslessly to the part that is read.
#pragma once

#include <cstddef>
#include <filesystem>
#include <stop_token>

#include "base/frame.h"
#include "base/result.h"
#include "files/new_file.h"

namespace trammel::machine {

struct VideoCut {
  PixelRect part;                ///< region of every frame; pixels unchanged
  std::size_t whole_every = 60;  ///< >= 1; of so many frames the first stays whole
  double frames_per_s = 30;      ///< > 0; for players
};

/// Cut video beside the one that it will replace, which is unchanged after a crash at any moment,
/// on a full disk, or if the cut is dropped.
class CutVideo {
 public:
  /// Writes the cut video. A frame that cannot be cut is copied whole. VideoFile reads both alike,
  /// except the removed parts.
  /// Errors: not MJPEG in AVI, a damaged file or frame (kMeasurement), the disk's, kInterrupted.
  /// Memory: one frame, and 2 bytes a sample of it.
  [[nodiscard]] static Result<CutVideo> Write(const std::filesystem::path& video,
                                              const VideoCut& cut, const std::stop_token& stop);

  [[nodiscard]] std::filesystem::path path() const { return file_.temporary_path(); }

  /// Replaces the video and adopts its modification time, since the content is not new. Called
  /// once, at the end. Errors: the disk's.
  [[nodiscard]] Result<void> TakePlace();

 private:
  CutVideo(std::filesystem::path video, files::NewFile file)
      : video_(std::move(video)), file_(std::move(file)) {}

  std::filesystem::path video_;
  files::NewFile file_;
};

}  // namespace trammel::machine
