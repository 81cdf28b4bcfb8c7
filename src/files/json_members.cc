#include "files/json_members.h"

#include <cstddef>

namespace trammel::files {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kSpaces = " \t\r\n";

std::string Dumped(const Json& value, int indent) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

void JsonMembers::Set(const std::string& key, const Json& value) {
  const std::string begin = style_.indent < 0 ? "" : "\n" + std::string(style_.indent, ' ');
  std::string written;
  for (const char c : Dumped(value, style_.indent)) {
    if (c == '\n') {
      written += begin;
    } else {
      written += c;
    }
  }
  std::size_t at = text_.find('{') + 1;
  std::size_t last = at;  // behind the last value
  bool any = false;
  for (;; any = true) {
    at = text_.find_first_not_of(" \t\r\n,", at);
    if (at == std::string::npos || text_[at] == '}') break;
    const std::size_t name_end = EndOfValue(at);
    const Json name = Json::parse(text_.substr(at, name_end - at), nullptr, false);
    at = text_.find_first_not_of(" \t\r\n:", name_end);
    last = EndOfValue(at);
    if (name == key) {
      text_.replace(at, last - at, written);
      return;
    }
    at = last;
  }
  text_.insert(last, (any ? "," : "") + begin + Dumped(key, -1) + ":" + (begin.empty() ? "" : " ") +
                         written);
}

std::size_t JsonMembers::EndOfValue(std::size_t at) const {
  int depth = 0;
  bool quoted = false;
  for (; at < text_.size(); ++at) {
    const char c = text_[at];
    if (quoted) {
      if (c == '\\') ++at;
      quoted = c != '"';
    } else if (c == '"') {
      quoted = true;
    } else if (c == '{' || c == '[') {
      ++depth;
    } else if (depth > 0) {
      if (c == '}' || c == ']') --depth;
    } else if (c == ',' || c == ':' || c == '}' || c == ']' ||
               kSpaces.find(c) != std::string_view::npos) {
      break;
    }
  }
  return at;
}

}  // namespace trammel::files
