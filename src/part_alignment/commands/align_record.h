// The dated folder of a measurement, in which everything is kept as it comes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "part_alignment/files/alignment_file.h"

namespace trammel::app {

/// Writes a picture as it came: view-01.png (or .jpg) for view 0. @returns its name.
/// Errors name the file.
[[nodiscard]] Result<std::string> WritePicture(const std::filesystem::path& folder,
                                               std::size_t view,
                                               const machine::CapturedFrame& picture);

/// Made with the first picture: DIR/part_alignment-20261122T030405Z, with a -2 behind it where
/// there is one already. Holds view-01.png (or .jpg) … and observations.json, both readable at any
/// moment.
class AlignmentRecord {
 public:
  /// @param plan  its camera, targets and unknowns are written with the observations
  AlignmentRecord(std::filesystem::path parent, files::AlignmentInput plan);

  /// Whether the folder can be made where it is to stand, before anything moves for it.
  [[nodiscard]] Result<void> CheckPlace() const;
  /// The picture as it came. Errors name the file.
  [[nodiscard]] Result<void> KeepPicture(std::size_t view, const machine::CapturedFrame& picture);
  [[nodiscard]] Result<void> KeepObservations(const part_alignment::Measurement& so_far);
  /// The error, with where to find what was kept, after stopped.txt has been written beside it.
  [[nodiscard]] Error Stopped(const Error& error, const std::vector<std::string>& notices) const;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::vector<std::filesystem::path> pictures() const;

 private:
  [[nodiscard]] Result<void> MakeFolder();

  std::filesystem::path parent_;
  std::filesystem::path folder_;  ///< empty until it is made
  files::AlignmentInput input_;
};

}  // namespace trammel::app
