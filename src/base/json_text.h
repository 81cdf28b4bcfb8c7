// JSON format of every file and every --json output of trammel.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace trammel {

/// Formats with an indent of two spaces and a final newline; bytes that are not UTF-8 (in a hostile
/// file name) become U+FFFD.
[[nodiscard]] inline std::string JsonText(const nlohmann::ordered_json& json) {
  constexpr int kIndent = 2;
  return json.dump(kIndent, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace trammel
