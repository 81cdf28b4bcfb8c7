// Values as other programs write them: Python's literals, YAML and XML of OpenCV, as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::files {

/// One value of braces, brackets, parentheses, quoted and bare words, with # comments and commas
/// behind the last entry: Python's literals and YAML's flow style. Numbers become numbers, bare
/// words text. Errors (kInput) name `file` and the line.
[[nodiscard]] Result<nlohmann::json> ParseLiteral(std::string_view text, const std::string& file);

/// Indented `key: value` with values in flow style or as lists of lines that begin with "- ": what
/// OpenCV and ROS write. Tags (!!opencv-matrix) are skipped. Errors as above.
[[nodiscard]] Result<nlohmann::json> ParsePlainYaml(std::string_view text, const std::string& file);

/// Nested elements without mixed content; attributes are skipped, the innermost texts stay texts,
/// of elements of one name the first counts. Errors as above.
[[nodiscard]] Result<nlohmann::json> ParsePlainXml(std::string_view text, const std::string& file);

}  // namespace trammel::files
