// Strict reading of one JSON object: every key named, typed and bounded; the first fault kept.
#pragma once

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::store {

struct NumberRange {
  double lo = 0;  ///< inclusive
  double hi = 0;  ///< inclusive
};

/// Parses text of at most a few megabytes. Errors name `file`, the line and what is wrong.
[[nodiscard]] Result<nlohmann::json> ParseJson(std::string_view text, const std::string& file);

/// Reads the keys of one object. After the first fault everything reads as absent or 0; ask
/// Finish() before use. The JSON must outlive the reader.
class JsonObject {
 public:
  /// `where` begins every message: the file and the path within it.
  JsonObject(const nlohmann::json& json, std::string where);

  /// A required number, or `fallback` where one is given and the key is absent.
  double Number(const char* key, NumberRange range, std::optional<double> fallback = {});
  std::optional<double> OptionalNumber(const char* key, NumberRange range);
  /// A required whole number.
  int Integer(const char* key, NumberRange range);
  /// A required text.
  std::string Text(const char* key);
  /// A required text that must be one of `choices`.
  std::string Choice(const char* key, std::initializer_list<std::string_view> choices);
  /// A required list of `least` to `most` entries; empty after a fault.
  const nlohmann::json& List(const char* key, std::size_t least, std::size_t most);
  /// A required list of numbers.
  std::vector<double> Numbers(const char* key, std::size_t least, std::size_t most,
                              NumberRange range);
  /// The value as it is, or nullptr; for keys with a shape of their own.
  const nlohmann::json* Find(const char* key);

  [[nodiscard]] bool has(const char* key) const;
  /// Notes a fault unless there is one already.
  void Fault(const std::string& key, const std::string& message);
  [[nodiscard]] bool failed() const { return error_.has_value(); }
  /// The first fault; else an error for any key that was not asked for (x_… is ignored).
  [[nodiscard]] Result<void> Finish() const;

 private:
  const nlohmann::json* Required(const char* key);

  const nlohmann::json& json_;
  std::string where_;
  std::set<std::string, std::less<>> asked_;
  std::optional<Error> error_;
};

/// What a JSON value is, for messages: `a text`, `null`, the number itself.
[[nodiscard]] std::string Describe(const nlohmann::json& value);

}  // namespace trammel::store
