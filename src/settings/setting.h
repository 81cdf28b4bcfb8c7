// One entry of a table of settings: what trammel.toml calls it, what it means to a user, and what
// it may be. Checking, reading, documenting and complaining all go by the tables.
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

/// What is wrong with a setting, told by its section and key in trammel.toml.
struct SettingProblem {
  std::string section;
  std::string key;
  std::string message;  ///< the value and its bound
};

/// Of a number, or of each number in a list. Nothing else is bounded by it.
struct SettingRange {
  std::string_view unit;  ///< as a user writes it; empty: none
  double lo = 0;          ///< inclusive
  double hi = 0;          ///< inclusive
};

/// One entry of a table for the settings that live in `Config`, each of one of `Types`.
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

/// The range of the field of a key. REQUIRES that there is one.
template <class Field>
[[nodiscard]] SettingRange RangeOf(std::span<const Field> fields, std::string_view key) {
  for (const Field& field : fields) {
    if (field.key == key) return field.range();
  }
  TRAMMEL_CHECK(false, "no setting {}", key);
  return {};
}

/// What is wrong with a value, whatever the other settings are: the value and its bound.
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range, double value);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range, int value);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::optional<double>& value);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::vector<double>& values);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::vector<int>& values);
/// Texts hold no control characters but line breaks and tabs.
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::string& text);
/// Choices and flags are right whenever they have their type; segments are judged together.
template <class Other>
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& /*range*/,
                                                          const Other& /*value*/) {
  return std::nullopt;
}

/// FindValueProblem for the field's value in `config`.
template <class Config, class... Types>
[[nodiscard]] std::optional<std::string> FindFieldProblem(
    const std::type_identity_t<Config>& config, const SettingField<Config, Types...>& field) {
  return std::visit([&](auto member) { return FindValueProblem(field.range(), config.*member); },
                    field.member);
}

/// The first of the fields with a problem of its own.
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
