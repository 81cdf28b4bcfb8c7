// Strict reading of one JSON object: every key named, typed and bounded; the first fault kept.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::files {

struct NumberRange {
  double lo = std::numeric_limits<double>::lowest();  ///< inclusive
  double hi = std::numeric_limits<double>::max();     ///< inclusive
};

/// Parses strictly: no key twice in one object, no U+0000 in a text, at most 16 levels, no number
/// too large for a double. Errors name `file` and what is wrong, with the line where the text is
/// not JSON.
[[nodiscard]] Result<nlohmann::json> ParseJson(std::string_view text, const std::string& file);

/// The same of a whole file. Errors: those of ReadWholeFile, too.
[[nodiscard]] Result<nlohmann::json> ReadJsonFile(const std::filesystem::path& path,
                                                  std::size_t max_bytes);

/// Reads the keys of one object. After the first fault everything reads as absent or 0; ask
/// Finish() before use. The JSON must outlive the reader.
class JsonObject {
 public:
  /// Every message begins with `file` and `path`, the way to this object within the file
  /// (`lines[3]`; empty for the file's content).
  JsonObject(const nlohmann::json& json, std::string file, std::string path = {});

  /// A required number, or `fallback` where one is given and the key is absent.
  double Number(const char* key, NumberRange range = {}, std::optional<double> fallback = {});
  std::optional<double> OptionalNumber(const char* key, NumberRange range = {});
  /// A required whole number. REQUIRES a range within that of int.
  int Integer(const char* key, NumberRange range);
  /// A required text.
  std::string Text(const char* key);
  /// A required text that must be one of `choices`; empty after a fault.
  std::string Choice(const char* key, std::span<const std::string_view> choices);
  std::string Choice(const char* key, std::initializer_list<std::string_view> choices);
  std::optional<std::string> OptionalChoice(const char* key,
                                            std::initializer_list<std::string_view> choices);
  /// A required list of `least` to `most` entries; empty after a fault.
  const nlohmann::json& List(const char* key, std::size_t least, std::size_t most);
  /// The same where the key is there, else nullptr.
  const nlohmann::json* OptionalList(const char* key, std::size_t least, std::size_t most);
  /// A required list of numbers.
  std::vector<double> Numbers(const char* key, std::size_t least, std::size_t most,
                              NumberRange range = {});
  /// A list of numbers, in which null stands for one that is not there; empty where the key is
  /// absent.
  std::vector<std::optional<double>> OptionalNumbers(const char* key, std::size_t least,
                                                     std::size_t most);
  /// The value as it is, or nullptr; for keys with a shape of their own.
  const nlohmann::json* Find(const char* key);
  /// A reader of an entry of this object: `key` in messages, as in lines[3].
  [[nodiscard]] JsonObject Inner(const nlohmann::json& json, const std::string& key) const;

  [[nodiscard]] bool has(const char* key);
  /// Notes a fault unless there is one already: "FILE: PATH.KEY MESSAGE".
  void Fault(const std::string& key, const std::string& message);
  /// Keeps the fault of an inner object, whose message names its place already.
  void Adopt(const Error& error);
  [[nodiscard]] bool failed() const { return error_.has_value(); }
  /// The first fault; else an error for any key that was not asked for (x_… is ignored).
  [[nodiscard]] Result<void> Finish() const;
  /// The first fault alone: for what other programs write, whose other keys are their own affair.
  [[nodiscard]] Result<void> Faults() const;

 private:
  [[nodiscard]] std::string At(const std::string& key) const;
  const nlohmann::json* Required(const char* key);
  bool Within(const std::string& key, double number, NumberRange range);

  const nlohmann::json& json_;
  std::string file_;
  std::string path_;
  std::set<std::string, std::less<>> asked_;
  std::optional<Error> error_;
};

/// A value as it stands in the file, cut to a length that fits into a message.
[[nodiscard]] std::string Show(const nlohmann::json& value);

// Changes members of a JSON object in its own text.

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

// "Did you mean …?"

/// The known word that takes the fewest single-letter edits, if it is near enough to be meant:
/// at most one edit per three letters.
[[nodiscard]] std::optional<std::string_view> Nearest(std::string_view word,
                                                      std::span<const std::string_view> known);

}  // namespace trammel::files
