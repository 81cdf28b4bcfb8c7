// One entry of the tables of settings (pattern_fields.h, scan_fields.h): what trammel.toml calls
// it, what it means to a user, and what it may be. Checking, reading, documenting and complaining
// all go by the tables.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "gcode/dialect.h"
#include "pressure_advance/line_motion.h"
#include "pressure_advance/pattern_config.h"
#include "pressure_advance/scan.h"

namespace trammel::pressure_advance {

/// A pointer, of whichever kind, to a setting of each type that there is.
template <template <class> class Pointer>
using SettingPointer =
    std::variant<Pointer<double>, Pointer<std::optional<double>>, Pointer<int>, Pointer<bool>,
                 Pointer<std::string>, Pointer<std::vector<double>>, Pointer<std::vector<Segment>>,
                 Pointer<gcode::Dialect>, Pointer<BedShape>, Pointer<Finish>,
                 Pointer<AxisDirection>>;

template <class Config>
struct SettingIn {
  template <class T>
  using Member = T Config::*;
};

template <class T>
using SettingAddress = T*;

/// Of a number, or of each number in a list. Nothing else is bounded by it.
struct SettingRange {
  std::string_view unit;  ///< as a user writes it; empty: none
  double lo = 0;          ///< inclusive
  double hi = 0;          ///< inclusive
};

/// One entry of a table for the settings that live in `Config`.
template <class Config>
struct SettingField {
  std::string_view section;
  std::string_view key;
  SettingPointer<SettingIn<Config>::template Member> member;
  std::string_view unit;
  double lo = 0;
  double hi = 0;
  std::string_view doc;  ///< one sentence or two

  [[nodiscard]] SettingRange range() const { return {unit, lo, hi}; }
};

/// What is wrong with a value, whatever the other settings are: the value and its bound.
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range, double value);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range, int value);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::optional<double>& value);
[[nodiscard]] std::optional<std::string> FindValueProblem(const SettingRange& range,
                                                          const std::vector<double>& values);
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
template <class Config>
[[nodiscard]] std::optional<std::string> FindFieldProblem(const Config& config,
                                                          const SettingField<Config>& field) {
  return std::visit([&](auto member) { return FindValueProblem(field.range(), config.*member); },
                    field.member);
}

/// The first of the fields with a problem of its own.
template <class Config, class Fields>
[[nodiscard]] std::optional<SettingProblem> FindFieldProblems(const Config& config,
                                                              const Fields& fields) {
  for (const SettingField<Config>& field : fields) {
    if (auto message = FindFieldProblem(config, field)) {
      return SettingProblem{std::string(field.section), std::string(field.key),
                            std::move(*message)};
    }
  }
  return std::nullopt;
}

}  // namespace trammel::pressure_advance
