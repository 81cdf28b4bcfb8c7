#include "files/json_object.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "base/bounded_json.h"
#include "base/utf8.h"
#include "files/whole_file.h"

namespace trammel::files {

using nlohmann::json;

std::string Show(const json& value) {
  constexpr std::size_t kMax = 60;
  const std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() <= kMax) return text;
  return fmt::format("{}...", text.substr(0, kMax - 3));
}

Result<json> ParseJson(std::string_view text, const std::string& file) {
  // By default JSON would silently drop one of two values with the same key.
  return ParseBoundedJson(text, file, {.max_levels = 16, .unique_keys = true, .zeros = false});
}

Result<json> ReadJsonFile(const std::filesystem::path& path, std::size_t max_bytes) {
  auto text = TRY(ReadWholeFile(path, max_bytes));
  return ParseJson(Utf8OfFile(std::move(text)), path.string());
}

JsonObject::JsonObject(const json& object, std::string file, std::string path)
    : json_(object), file_(std::move(file)), path_(std::move(path)) {
  if (!json_.is_object()) {
    error_ = Error{ErrorKind::kInput,
                   fmt::format("{}: {} is {}; it must be an object", file_,
                               path_.empty() ? "the file's content" : path_, Show(json_))};
  }
}

JsonObject JsonObject::Inner(const json& object, const std::string& key) const {
  return {object, file_, At(key)};
}

std::string JsonObject::At(const std::string& key) const {
  return path_.empty() ? key : path_ + "." + key;
}

void JsonObject::Fault(const std::string& key, const std::string& message) {
  if (!error_) {
    error_ = Error{ErrorKind::kInput, fmt::format("{}: {} {}", file_, At(key), message)};
  }
}

void JsonObject::Adopt(const Error& error) {
  if (!error_) error_ = error;
}

bool JsonObject::has(const char* key) {
  asked_.insert(key);
  return json_.is_object() && json_.contains(key);
}

const json* JsonObject::Find(const char* key) {
  if (!has(key) || failed()) return nullptr;
  return &json_.at(key);
}

const json* JsonObject::Required(const char* key) {
  const json* value = Find(key);
  if (value == nullptr) Fault(key, "is missing");
  return value;
}

bool JsonObject::Within(const std::string& key, double number, NumberRange range) {
  const bool within = number >= range.lo && number <= range.hi;
  if (!within) Fault(key, fmt::format("is {}; it must be {} … {}", number, range.lo, range.hi));
  return within;
}

std::optional<double> JsonObject::OptionalNumber(const char* key, NumberRange range) {
  const json* value = Find(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_number()) {
    Fault(key, fmt::format("is {}; it must be a number", Show(*value)));
    return std::nullopt;
  }
  const double number = value->get<double>();
  if (!Within(key, number, range)) return std::nullopt;
  return number;
}

double JsonObject::Number(const char* key, NumberRange range, std::optional<double> fallback) {
  if (fallback && !has(key)) return *fallback;
  return Required(key) != nullptr ? OptionalNumber(key, range).value_or(0) : 0;
}

int JsonObject::Integer(const char* key, NumberRange range) {
  const double number = Number(key);
  if (failed()) return 0;
  if (number != std::floor(number) || number < range.lo || number > range.hi) {
    Fault(key,
          fmt::format("is {}; it must be a whole number, {} … {}", number, range.lo, range.hi));
    return 0;
  }
  return static_cast<int>(number);
}

std::string JsonObject::Text(const char* key) {
  const json* value = Required(key);
  if (value == nullptr) return {};
  if (!value->is_string()) {
    Fault(key, fmt::format("is {}; it must be text", Show(*value)));
    return {};
  }
  return value->get<std::string>();
}

std::string JsonObject::Choice(const char* key, std::initializer_list<std::string_view> choices) {
  return Choice(key, std::span<const std::string_view>{choices.begin(), choices.size()});
}

std::string JsonObject::Choice(const char* key, std::span<const std::string_view> choices) {
  const std::string text = Text(key);
  if (failed()) return {};
  if (std::find(choices.begin(), choices.end(), text) != choices.end()) return text;
  std::string known;
  for (std::string_view choice : choices) {
    known += fmt::format("{}\"{}\"", known.empty() ? "" : " or ", choice);
  }
  Fault(key, fmt::format("is {}; it must be {}", Show(json(text)), known));
  return {};
}

std::optional<std::string> JsonObject::OptionalChoice(
    const char* key, std::initializer_list<std::string_view> choices) {
  if (Find(key) == nullptr) return std::nullopt;
  std::string text = Choice(key, choices);
  if (failed()) return std::nullopt;
  return text;
}

const json& JsonObject::List(const char* key, std::size_t least, std::size_t most) {
  static const json kEmpty = json::array();
  if (Required(key) == nullptr) return kEmpty;
  const json* list = OptionalList(key, least, most);
  return list != nullptr ? *list : kEmpty;
}

const json* JsonObject::OptionalList(const char* key, std::size_t least, std::size_t most) {
  const json* value = Find(key);
  if (value == nullptr) return nullptr;
  if (!value->is_array()) {
    Fault(key, fmt::format("is {}; it must be a list", Show(*value)));
    return nullptr;
  }
  if (value->size() < least || value->size() > most) {
    Fault(key, fmt::format("has {} entries; it must have {} … {}", value->size(), least, most));
    return nullptr;
  }
  return value;
}

std::vector<double> JsonObject::Numbers(const char* key, std::size_t least, std::size_t most,
                                        NumberRange range) {
  std::vector<double> numbers;
  for (const json& entry : List(key, least, most)) {
    const std::string at = fmt::format("{}[{}]", key, numbers.size());
    if (!entry.is_number()) {
      Fault(at, fmt::format("is {}; it must be a number", Show(entry)));
      return {};
    }
    numbers.push_back(entry.get<double>());
    if (!Within(at, numbers.back(), range)) return {};
  }
  return numbers;
}

std::vector<std::optional<double>> JsonObject::OptionalNumbers(const char* key, std::size_t least,
                                                               std::size_t most) {
  std::vector<std::optional<double>> numbers;
  const json* list = OptionalList(key, least, most);
  if (list == nullptr) return numbers;
  for (const json& entry : *list) {
    if (!entry.is_number() && !entry.is_null()) {
      Fault(fmt::format("{}[{}]", key, numbers.size()),
            fmt::format("is {}; it must be a number or null", Show(entry)));
      return {};
    }
    numbers.push_back(entry.is_null() ? std::nullopt : std::optional(entry.get<double>()));
  }
  return numbers;
}

Result<void> JsonObject::Faults() const {
  if (error_) return tl::unexpected(*error_);
  return {};
}

Result<void> JsonObject::Finish() const {
  if (error_) return tl::unexpected(*error_);
  for (const auto& [key, value] : json_.items()) {
    if (asked_.contains(key) || key.starts_with("x_")) continue;
    return Fail(fmt::format("{}: {} is not a known key (known: {}; keys of your own begin with x_)",
                            file_, At(Show(json(key))), fmt::join(asked_, ", ")));
  }
  return {};
}

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

namespace {

constexpr std::size_t kLongestWord = 100;  // longer ones are no misspelling, and cost n * m

/// Computes Levenshtein's distance, one row at a time.
std::size_t Edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::optional<std::string_view> Nearest(std::string_view word,
                                        std::span<const std::string_view> known) {
  if (word.size() > kLongestWord) return std::nullopt;
  std::optional<std::string_view> nearest;
  std::size_t fewest = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (std::string_view candidate : known) {
    const std::size_t edits = Edits(word, candidate);
    if (edits < fewest) {
      fewest = edits;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace trammel::files
