// JSON as every file and every --json of trammel has it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace trammel {

/// Indents by two spaces and ends in a newline; bytes that are not UTF-8 (in a hostile file name)
/// become U+FFFD.
[[nodiscard]] inline std::string JsonText(const nlohmann::ordered_json& json) {
  constexpr int kIndent = 2;
  return json.dump(kIndent, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace trammel
