// The readings of a camera's setup as a file, setup.json.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/setup/setup_picture.h"

namespace trammel::files {

/// Every picture, with where the head stood and what was read in it (docs/formats.md).
[[nodiscard]] std::string FormatSetupPictures(
    const std::vector<pressure_advance::SetupPicture>& pictures);

}  // namespace trammel::files
