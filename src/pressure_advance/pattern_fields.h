// The one table of the pattern's settings: what trammel.toml calls each of them, what it means to a
// user, and what it may be. Checking, reading, documenting and complaining all go by it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "pressure_advance/pattern_config.h"

namespace trammel::pressure_advance {

/// Where a setting lives; its type is the setting's type.
using PatternMember =
    std::variant<double PatternConfig::*, std::optional<double> PatternConfig::*,
                 int PatternConfig::*, bool PatternConfig::*, std::string PatternConfig::*,
                 std::vector<double> PatternConfig::*, std::vector<Segment> PatternConfig::*,
                 gcode::Dialect PatternConfig::*, BedShape PatternConfig::*,
                 Finish PatternConfig::*>;

struct PatternField {
  std::string_view section;
  std::string_view key;
  PatternMember member;
  std::string_view unit;  ///< of a number, as a user writes it; empty: none
  double lo = 0;          ///< of a number or of each number in a list, inclusive
  double hi = 0;
  std::string_view doc;  ///< one sentence or two
};

/// All settings, in the order in which `trammel config keys` shows them; sections are contiguous.
[[nodiscard]] std::span<const PatternField> PatternFields();

/// What is wrong with this one setting, whatever the others are: the value and its bound.
[[nodiscard]] std::optional<std::string> FindFieldProblem(const PatternConfig& config,
                                                          const PatternField& field);

/// A choice as trammel.toml spells it.
[[nodiscard]] std::string_view ToString(BedShape shape);
[[nodiscard]] std::string_view ToString(Finish finish);
[[nodiscard]] std::optional<BedShape> ParseBedShape(std::string_view name);
[[nodiscard]] std::optional<Finish> ParseFinish(std::string_view name);

}  // namespace trammel::pressure_advance
