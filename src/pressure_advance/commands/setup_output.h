// Output of a finished camera setup on the terminal and on disk.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "pressure_advance/procedure/setup.h"

namespace trammel::app {

/// Content of a trammel.toml before the procedure began.
struct CameraTarget {
  std::filesystem::path path;
  std::optional<std::string> text;  ///< absent: there is no such file yet
};

/// Reads the file that will receive [camera]. Errors: as files::ReadWholeFile; the content is no
/// trammel.toml; a folder, link or device.
[[nodiscard]] Result<CameraTarget> ReadCameraTarget(const std::filesystem::path& path);

/// Writes the values of a good verdict into the target's [camera]: old values become comments, all
/// else is unchanged. First makes a backup beside it.
/// @returns the backup's name; empty if there was no file.
/// Errors, after which the file is unchanged: the file changed meanwhile, or spells its section in
/// an unsupported way; any system error.
[[nodiscard]] Result<std::string> WriteCameraTarget(const CameraTarget& target,
                                                    const pressure_advance::SetupResult& result,
                                                    double focus_height_mm);

struct SetupOutput {
  std::filesystem::path folder;
  std::string printer;                 ///< address without secrets
  std::optional<CameraTarget> target;  ///< absent: nothing is changed
  bool json = false;
};

/// Prints the answer on standard output, and its difference from this printer's earlier ones.
/// Writes result.json and a line of the history, setup.json and camera.toml into the folder, and
/// changes the target if the verdict is good.
/// @returns the exit code: that of the verdict, or of a file that could not be written.
int PrintSetup(const procedure::SetupRecord& record, const SetupOutput& output);

}  // namespace trammel::app
