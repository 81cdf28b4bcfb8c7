// Changes members of a JSON object in its own text.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace trammel::files {

struct JsonStyle {
  int indent = -1;  ///< spaces before a new member; -1: all on one line
};

/// Sets members of the outermost object in its text: all else keeps its bytes, digits of numbers
/// that a double does not hold among them.
class JsonMembers {
 public:
  /// REQUIRES the text of one object that ParseJson reads.
  JsonMembers(std::string_view text, JsonStyle style) : text_(text), style_(style) {}

  /// Replaces the value of a member, or adds one behind the others.
  void Set(const std::string& key, const nlohmann::ordered_json& value);

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  [[nodiscard]] std::size_t EndOfValue(std::size_t at) const;

  std::string text_;
  JsonStyle style_;
};

}  // namespace trammel::files
