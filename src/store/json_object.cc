#include "store/json_object.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace trammel::store {

using nlohmann::json;

std::string Describe(const json& value) {
  switch (value.type()) {
    case json::value_t::null:
      return "null";
    case json::value_t::boolean:
      return value.get<bool>() ? "true" : "false";
    case json::value_t::string:
      return "a text";
    case json::value_t::array:
      return fmt::format("a list of {}", value.size());
    case json::value_t::object:
      return "an object";
    default:
      return value.is_number() ? fmt::format("{}", value.get<double>()) : "something unreadable";
  }
}

Result<json> ParseJson(std::string_view text, const std::string& file) {
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    const std::size_t end = std::min(text.size(), error.byte);
    const auto line = 1 + std::count(text.begin(), text.begin() + end, '\n');
    return Fail(fmt::format("{}:{}: is not JSON: {}", file, line, error.what()));
  } catch (const json::exception& error) {  // a number too large for a double
    return Fail(fmt::format("{}: is not JSON that can be used: {}", file, error.what()));
  }
}

JsonObject::JsonObject(const json& object, std::string where)
    : json_(object), where_(std::move(where)) {
  if (!json_.is_object()) {
    error_ = Error{ErrorKind::kInput,
                   fmt::format("{}: must be an object, is {}", where_, Describe(json_))};
  }
}

void JsonObject::Fault(const std::string& key, const std::string& message) {
  if (!error_) {
    error_ = Error{ErrorKind::kInput, fmt::format("{}: \"{}\": {}", where_, key, message)};
  }
}

bool JsonObject::has(const char* key) const { return json_.is_object() && json_.contains(key); }

const json* JsonObject::Find(const char* key) {
  asked_.insert(key);
  if (failed() || !has(key)) return nullptr;
  return &json_.at(key);
}

const json* JsonObject::Required(const char* key) {
  const json* value = Find(key);
  if (value == nullptr) Fault(key, "is missing");
  return value;
}

std::optional<double> JsonObject::OptionalNumber(const char* key, NumberRange range) {
  const json* value = Find(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_number()) {
    Fault(key, fmt::format("must be a number, is {}", Describe(*value)));
    return std::nullopt;
  }
  const double number = value->get<double>();
  if (!(number >= range.lo && number <= range.hi)) {
    Fault(key, fmt::format("{} is outside {} ... {}", number, range.lo, range.hi));
    return std::nullopt;
  }
  return number;
}

double JsonObject::Number(const char* key, NumberRange range, std::optional<double> fallback) {
  if (fallback && !has(key)) {
    asked_.insert(key);
    return *fallback;
  }
  return Required(key) != nullptr ? OptionalNumber(key, range).value_or(0) : 0;
}

int JsonObject::Integer(const char* key, NumberRange range) {
  const double number = Number(key, range);
  if (number != std::floor(number)) Fault(key, fmt::format("{} is not a whole number", number));
  return failed() ? 0 : static_cast<int>(number);
}

std::string JsonObject::Text(const char* key) {
  const json* value = Required(key);
  if (value == nullptr) return {};
  if (!value->is_string()) {
    Fault(key, fmt::format("must be a text, is {}", Describe(*value)));
    return {};
  }
  return value->get<std::string>();
}

std::string JsonObject::Choice(const char* key, std::initializer_list<std::string_view> choices) {
  const std::string text = Text(key);
  if (failed() || std::find(choices.begin(), choices.end(), text) != choices.end()) return text;
  std::string known;
  for (std::string_view choice : choices) known += fmt::format(" \"{}\"", choice);
  Fault(key, fmt::format("\"{}\" is none of{}", text, known));
  return {};
}

const json& JsonObject::List(const char* key, std::size_t least, std::size_t most) {
  static const json kEmpty = json::array();
  const json* value = Required(key);
  if (value == nullptr) return kEmpty;
  if (!value->is_array()) {
    Fault(key, fmt::format("must be a list, is {}", Describe(*value)));
    return kEmpty;
  }
  if (value->size() < least || value->size() > most) {
    Fault(key, fmt::format("has {} entries, must have {} ... {}", value->size(), least, most));
    return kEmpty;
  }
  return *value;
}

std::vector<double> JsonObject::Numbers(const char* key, std::size_t least, std::size_t most,
                                        NumberRange range) {
  std::vector<double> numbers;
  for (const json& entry : List(key, least, most)) {
    if (!entry.is_number()) {
      Fault(key, fmt::format("must hold numbers, holds {}", Describe(entry)));
      return {};
    }
    numbers.push_back(entry.get<double>());
    if (!(numbers.back() >= range.lo && numbers.back() <= range.hi)) {
      Fault(key, fmt::format("{} is outside {} ... {}", numbers.back(), range.lo, range.hi));
      return {};
    }
  }
  return numbers;
}

Result<void> JsonObject::Finish() const {
  if (error_) return tl::unexpected(*error_);
  for (const auto& [key, value] : json_.items()) {
    if (asked_.contains(key) || key.starts_with("x_")) continue;
    return Fail(
        fmt::format("{}: \"{}\": is not a key of this format; remove it, or let it begin "
                    "with x_",
                    where_, key));
  }
  return {};
}

}  // namespace trammel::store
