// Fields of structs by name: options NAME=NUMBER that set them, within bounds.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::sim {

template <class Target>
struct NamedNumber {
  const char* name;
  void (*set)(double value, Target& target);
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
};

/// Returns the table's names, separated by commas.
template <class Target, std::size_t count>
[[nodiscard]] std::string NamesOf(const NamedNumber<Target> (&table)[count]) {
  std::string names;
  for (const auto& entry : table) names += (names.empty() ? "" : ", ") + std::string(entry.name);
  return names;
}

struct NamedValue {
  std::string_view name;
  double value = 0;
};

/// Parses NAME=NUMBER. Error (kInput), which begins with the option: another form, or not finite.
[[nodiscard]] inline Result<NamedValue> ParseNamedValue(std::string_view option,
                                                        std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string_view digits = equals == std::string_view::npos ? "" : text.substr(equals + 1);
  NamedValue named{text.substr(0, equals)};
  const char* const last = digits.data() + digits.size();
  const auto [end, fault] = std::from_chars(digits.data(), last, named.value);
  if (fault != std::errc() || end != last || !std::isfinite(named.value)) {
    return Fail(fmt::format("{} {}: must be NAME=NUMBER", option, text.substr(0, 60)));
  }
  return named;
}

/// Sets the named field. @returns false if the table lacks the name.
/// Error (kInput): a value outside the field's bounds.
template <class Target, std::size_t count>
[[nodiscard]] Result<bool> SetNamed(const NamedNumber<Target> (&table)[count],
                                    const NamedValue& named, Target& target) {
  for (const auto& entry : table) {
    if (named.name != entry.name) continue;
    if (!(named.value >= entry.least && named.value <= entry.most)) {
      return Fail(fmt::format("{} = {}: must be {} ... {}", named.name, named.value, entry.least,
                              entry.most));
    }
    entry.set(named.value, target);
    return true;
  }
  return false;
}

template <class Value>
struct NamedChoice {
  std::string_view name;
  Value value;
};

/// The value that a name stands for. Error (kInput): another name; the message lists what exists.
template <class Value, std::size_t count>
[[nodiscard]] Result<Value> ChoiceOf(const NamedChoice<Value> (&table)[count],
                                     std::string_view what, std::string_view name) {
  std::string known;
  for (const auto& entry : table) {
    if (entry.name == name) return entry.value;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  return Fail(
      fmt::format("there is no {} \"{}\"; choose one of {}", what, name.substr(0, 60), known));
}

/// Converts an option's number to a count; -1 if it is negative, at most a million.
[[nodiscard]] inline int WholeOf(double value) {
  return static_cast<int>(std::clamp(value, -1.0, 1e6));
}

/// Returns the error of an option whose name is in no table.
[[nodiscard]] inline tl::unexpected<Error> NoSuchName(std::string_view option,
                                                      std::string_view text,
                                                      const std::string& names) {
  return Fail(fmt::format("{} {}: there is no such name; choose one of {}", option,
                          text.substr(0, 60), names));
}

}  // namespace trammel::sim
