// Converts other programs' values to JSON: Python's literals, and YAML and XML of OpenCV.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::files {

/// Parses one value of braces, brackets, parentheses, quoted and bare words, with # comments and
/// trailing commas: Python's literals and YAML's flow style. Numbers become numbers, bare words
/// text. Errors (kInput) name `file` and the line.
[[nodiscard]] Result<nlohmann::json> ParseLiteral(std::string_view text, const std::string& file);

/// Parses indented `key: value` lines with values in flow style or as lists of "- " lines, as
/// written by OpenCV and ROS. Skips tags (!!opencv-matrix). Errors as above.
[[nodiscard]] Result<nlohmann::json> ParsePlainYaml(std::string_view text, const std::string& file);

/// Parses nested elements without mixed content. Skips attributes; innermost texts remain texts; of
/// elements of one name the first counts. Errors as above.
[[nodiscard]] Result<nlohmann::json> ParsePlainXml(std::string_view text, const std::string& file);

}  // namespace trammel::files
