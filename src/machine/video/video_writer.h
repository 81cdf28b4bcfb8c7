// Records a camera's frames as they arrive, so that the recording survives any failure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"

namespace trammel::machine {

/// Writes JPEG pictures unchanged into a video file, and their times into a text file beside it.
/// Each frame is passed to the system before Add() returns: after a SIGKILL at any moment
/// machine/video_file reads every frame that was added.
///
/// The times: `<video>.times` (docs/reference/formats.md, frame times), one line per frame.
class VideoWriter {
 public:
  /// Creates both files; an existing file or a missing folder is an error (kInput). The first frame
  /// sets the size.
  /// @param nominal_frames_per_s  > 0; for players, which do not read the times.
  [[nodiscard]] static Result<VideoWriter> Create(const std::filesystem::path& path,
                                                  double nominal_frames_per_s = 30);

  VideoWriter(VideoWriter&&) noexcept;
  VideoWriter& operator=(VideoWriter&&) noexcept;
  ~VideoWriter();  ///< without Finish() the files stay readable as they are

  /// Appends a JPEG frame. A frame with a fault other than a jumped time only gets its line among
  /// the times, so that the recording documents incomplete frames.
  /// A PNG or a frame of another size than the first is an error (kMeasurement) and does not change
  /// the files. A full or failing disk is an error (kInput) with the number of frames written; the
  /// files retain those, and further calls fail likewise.
  [[nodiscard]] Result<void> Add(const CapturedFrame& frame);

  /// Completes the header and closes. The file is readable without it.
  [[nodiscard]] Result<void> Finish();

  [[nodiscard]] std::size_t frames() const;  ///< written so far

 private:
  struct State;
  explicit VideoWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// `<video>.times`.
[[nodiscard]] std::filesystem::path FrameTimesPath(const std::filesystem::path& video);

}  // namespace trammel::machine
