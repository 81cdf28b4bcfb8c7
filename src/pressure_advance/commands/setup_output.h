// What a finished set-up of the camera says on the terminal and leaves on disk.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "pressure_advance/procedure/setup.h"

namespace trammel::app {

/// A trammel.toml as it was before the machine was asked anything.
struct CameraTarget {
  std::filesystem::path path;
  std::optional<std::string> text;  ///< absent: there is no such file yet
};

/// Reads the file that is to receive [camera]. Errors: as files::ReadWholeFile; what is there is no
/// trammel.toml; a folder, link or device.
[[nodiscard]] Result<CameraTarget> ReadCameraTarget(const std::filesystem::path& path);

/// Puts the values of a good verdict into the target's [camera]: what stood there becomes comments,
/// all else stays. The old file is kept beside it first.
/// @returns the backup's name; empty where there was no file.
/// Errors: the file changed meanwhile, or spells its section in a way that is not understood; what
/// the system says. Then it is as it was.
[[nodiscard]] Result<std::string> WriteCameraTarget(const CameraTarget& target,
                                                    const pressure_advance::SetupResult& result,
                                                    double focus_height_mm);

struct SetupOutput {
  std::filesystem::path folder;
  std::string printer;                 ///< its address, without secrets
  std::optional<CameraTarget> target;  ///< absent: nothing is changed
  bool json = false;
};

/// Prints the answer on standard output, and how it differs from the earlier ones of this printer;
/// writes result.json and a line of the history, setup.json and camera.toml into the folder, and
/// changes the target where the verdict is good.
/// @returns the exit code: that of the verdict, or of a file that could not be written.
int PrintSetup(const procedure::SetupRecord& record, const SetupOutput& output);

}  // namespace trammel::app
