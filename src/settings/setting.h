// Entry of a table of settings: its key in trammel.toml, its documentation for users, and its
// range. Checking, reading, documentation and errors all use the tables.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "base/check.h"

namespace trammel::settings {

/// Error in a setting, with its section and key in trammel.toml.
struct SettingProblem {
  std::string section;
  std::string key;
  std::string message;  ///< the value and its bound
};

/// Range of a number, or of each number in a list; nothing else.
struct SettingRange {
  std::string_view unit;  ///< as written by users; empty: none
  double lo = 0;          ///< inclusive
  double hi = 0;          ///< inclusive
};

/// Entry of a table for the settings in `Config`, each of one of `Types`.
template <class Config, class... Types>
struct SettingField {
  std::string_view section;
  std::string_view key;
  std::variant<Types Config::*...> member;
  std::string_view unit;
  double lo = 0;
  double hi = 0;
  std::string_view doc;  ///< one sentence or two

  [[nodiscard]] SettingRange range() const { return {unit, lo, hi}; }
};

/// Returns the range of the field of a key. REQUIRES that there is one.
template <class Field>
[[nodiscard]] SettingRange RangeOf(std::span<const Field> fields, std::string_view key) {
  for (const Field& field : fields) {
    if (field.key == key) return field.range();
  }
  TRAMMEL_CHECK(false, "no setting {}", key);
  return {};
}

/// Returns the error in a value, independent of the other settings: the value and its bound.
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range, double value);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range, int value);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::optional<double>& value);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::vector<double>& values);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::vector<int>& values);
/// Rejects control characters in texts, except line breaks and tabs.
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::string& text);
/// Accepts choices and flags of the right type; segments are checked together.
template <class Other>
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& /*range*/,
                                                          const Other& /*value*/) {
  return std::nullopt;
}

/// Calls FindValueProblem for the field's value in `config`.
template <class Config, class... Types>
[[nodiscard]] std::optional<std::string> FindFieldProblem(
    const std::type_identity_t<Config>& config, const SettingField<Config, Types...>& field) {
  return std::visit([&](auto member) { return FindValueProblem(field.range(), config.*member); },
                    field.member);
}

/// Returns the first field's own problem, if any.
template <class Config, class Fields>
[[nodiscard]] std::optional<SettingProblem> FindFieldProblems(const Config& config,
                                                              const Fields& fields) {
  for (const auto& field : fields) {
    if (auto message = FindFieldProblem(config, field)) {
      return SettingProblem{std::string(field.section), std::string(field.key),
                            std::move(*message)};
    }
  }
  return std::nullopt;
}

}  // namespace trammel::settings
