// Finding a user's trammel.toml.
#pragma once

#include <string>

#include "base/result.h"

namespace trammel::app {

struct ConfigText {
  std::string text;
  std::string file;  ///< its name, for messages
};

/// The file that was asked for, else trammel.toml of the current folder, else no settings at all
/// (an empty text, which leaves every default). Errors: as files::ReadWholeFile.
[[nodiscard]] Result<ConfigText> FindConfig(const std::string& asked_for);

}  // namespace trammel::app
