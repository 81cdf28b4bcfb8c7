// What can be wrong with a setting of trammel.toml.
#pragma once

#include <string>

namespace trammel::settings {

/// What is wrong with a setting, told by its section and key in trammel.toml.
struct SettingProblem {
  std::string section;
  std::string key;
  std::string message;  ///< the value and its bound
};

}  // namespace trammel::settings
