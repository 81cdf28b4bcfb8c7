// One setting to and from TOML, by its entry in the table of settings.
#pragma once

#include <toml++/toml.h>

#include <optional>
#include <string>

#include "pressure_advance/pattern_fields.h"

namespace trammel::store {

/// Sets the field from a TOML value.
/// @returns What is wrong with the value (its type, its range), or nothing.
[[nodiscard]] std::optional<std::string> SetField(const pressure_advance::PatternField& field,
                                                  const toml::node& value,
                                                  pressure_advance::PatternConfig& config);

/// The field's value as TOML; absent where an optional setting has none.
[[nodiscard]] std::optional<std::string> FormatField(const pressure_advance::PatternField& field,
                                                     const pressure_advance::PatternConfig& config);

/// Whether the field is written between quotes.
[[nodiscard]] bool IsText(const pressure_advance::PatternField& field);

}  // namespace trammel::store
