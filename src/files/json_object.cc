#include "files/json_object.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/bounded_json.h"
#include "base/utf8.h"
#include "files/whole_file.h"

namespace trammel::files {

using nlohmann::json;

std::string Show(const json& value) {
  constexpr std::size_t kMost = 60;
  const std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() <= kMost) return text;
  return fmt::format("{}...", text.substr(0, kMost - 3));
}

Result<json> ParseJson(std::string_view text, const std::string& file) {
  // JSON would silently keep one of two values with the same key.
  return ParseBoundedJson(text, file, {.most_levels = 16, .unique_keys = true, .zeros = false});
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

}  // namespace trammel::files
