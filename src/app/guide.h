// What trammel prints where it is called without a command: the way in, by what its user has.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace trammel::app {

/// A screen of text: for each thing to measure with, the commands to begin with.
/// @param has  whether this build has a command of the first level.
[[nodiscard]] std::string Guide(const std::function<bool(std::string_view)>& has);

}  // namespace trammel::app
