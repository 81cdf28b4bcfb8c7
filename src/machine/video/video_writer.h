// Records the frames of a camera as they come, so that whatever happens the recording so far
// remains.
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

/// Writes JPEG pictures into a video file without touching them, and their times into a text file
/// beside it. Each frame is handed to the system before Add() returns: after a SIGKILL at any
/// moment machine/video_file reads every frame that was added.
///
/// The times: `<video>.times` (docs/reference/formats.md, frame times), one line per frame.
class VideoWriter {
 public:
  /// Creates both files; an existing one is an error (kInput), as is a folder that is not there.
  /// The frames' size is the first frame's.
  /// @param nominal_frames_per_s  > 0; for players, which know nothing of the times beside it.
  [[nodiscard]] static Result<VideoWriter> Create(const std::filesystem::path& path,
                                                  double nominal_frames_per_s = 30);

  VideoWriter(VideoWriter&&) noexcept;
  VideoWriter& operator=(VideoWriter&&) noexcept;
  ~VideoWriter();  ///< Without Finish() the files stay as they are, readable.

  /// Appends a JPEG frame. One with a fault other than a jumped time gets only its line among the
  /// times, so that a recording says what did not come whole.
  /// A PNG or a frame of another size than the first is an error (kMeasurement) and leaves the
  /// files as they were. A full or failing disk is an error (kInput) that says how many frames
  /// are safe; the files keep those, and further calls fail likewise.
  [[nodiscard]] Result<void> Add(const CapturedFrame& frame);

  /// Completes the header and closes. Not needed for the file to be readable.
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
