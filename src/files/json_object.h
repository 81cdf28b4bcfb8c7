// Reads one JSON object strictly: checks every key's name, type and bounds, and records the first
// fault.
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

/// Parses strictly: no duplicate key in an object, no U+0000 in a text, at most 16 levels, no
/// number too large for a double. Errors name `file` and the fault, with the line if the text is
/// not JSON.
[[nodiscard]] Result<nlohmann::json> ParseJson(std::string_view text, const std::string& file);

/// Does the same for a whole file. Errors: those of ReadWholeFile, too.
[[nodiscard]] Result<nlohmann::json> ReadJsonFile(const std::filesystem::path& path,
                                                  std::size_t max_bytes);

/// Reads the keys of one object. After the first fault every value reads as absent or 0; check
/// Finish() before use. The JSON must outlive the reader.
class JsonObject {
 public:
  /// Every message begins with `file` and `path`, the path of this object within the file
  /// (`lines[3]`; empty for the file's content).
  JsonObject(const nlohmann::json& json, std::string file, std::string path = {});

  /// Reads a required number; `fallback`, if given, if the key is absent.
  double Number(const char* key, NumberRange range = {}, std::optional<double> fallback = {});
  std::optional<double> OptionalNumber(const char* key, NumberRange range = {});
  /// Reads a required whole number. REQUIRES a range within that of int.
  int Integer(const char* key, NumberRange range);
  /// Reads a required text.
  std::string Text(const char* key);
  /// Reads a required text that must be one of `choices`; empty after a fault.
  std::string Choice(const char* key, std::span<const std::string_view> choices);
  std::string Choice(const char* key, std::initializer_list<std::string_view> choices);
  std::optional<std::string> OptionalChoice(const char* key,
                                            std::initializer_list<std::string_view> choices);
  /// Reads a required list of `least` to `most` entries; empty after a fault.
  const nlohmann::json& List(const char* key, std::size_t least, std::size_t most);
  /// Reads the same list if the key exists, else nullptr.
  const nlohmann::json* OptionalList(const char* key, std::size_t least, std::size_t most);
  /// Reads a required list of numbers.
  std::vector<double> Numbers(const char* key, std::size_t least, std::size_t most,
                              NumberRange range = {});
  /// Reads a list of numbers in which null marks a missing one; empty if the key is absent.
  std::vector<std::optional<double>> OptionalNumbers(const char* key, std::size_t least,
                                                     std::size_t most);
  /// Returns the raw value, or nullptr; for keys with their own structure.
  const nlohmann::json* Find(const char* key);
  /// Returns a reader of an entry of this object: `key` in messages, as in lines[3].
  [[nodiscard]] JsonObject Inner(const nlohmann::json& json, const std::string& key) const;

  [[nodiscard]] bool has(const char* key);
  /// Records a fault unless one is recorded already: "FILE: PATH.KEY MESSAGE".
  void Fault(const std::string& key, const std::string& message);
  /// Adopts the fault of an inner object, whose message already names its place.
  void Adopt(const Error& error);
  [[nodiscard]] bool failed() const { return error_.has_value(); }
  /// Returns the first fault; else an error for any key that was not read (x_… is ignored).
  [[nodiscard]] Result<void> Finish() const;
  /// Returns only the first fault: for other programs' files, whose further keys are allowed.
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

/// Returns a value as in the file, cut to fit into a message.
[[nodiscard]] std::string Show(const nlohmann::json& value);

// Changes members of a JSON object in its own text.

struct JsonStyle {
  int indent = -1;  ///< spaces before a new member; -1: all on one line
};

/// Sets members of the outermost object in its text. All other bytes are unchanged, including
/// digits that a double cannot represent.
class JsonMembers {
 public:
  /// REQUIRES the text of one object that ParseJson reads.
  JsonMembers(std::string_view text, JsonStyle style) : text_(text), style_(style) {}

  /// Replaces the value of a member, or appends a new one.
  void Set(const std::string& key, const nlohmann::ordered_json& value);

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  [[nodiscard]] std::size_t EndOfValue(std::size_t at) const;

  std::string text_;
  JsonStyle style_;
};

// "Did you mean …?"

/// Returns the known word with the fewest single-letter edits, if it is close enough: at most one
/// edit per three letters.
[[nodiscard]] std::optional<std::string_view> Nearest(std::string_view word,
                                                      std::span<const std::string_view> known);

}  // namespace trammel::files
