// The frame of an exchange file of ISO 10303-21, before a reader of STEP is trusted with it.
#pragma once

#include <string_view>

#include "base/result.h"

namespace trammel::machine {

/// Whether the bytes begin as such a file does, behind blanks and comments.
[[nodiscard]] bool LooksLikePart21(std::string_view bytes);

/// Passes a file that is whole: its sections and its end are there, strings and parentheses are
/// closed, each entity has a number of its own, and those that are referred to exist. What the
/// entities mean is not looked at.
/// Errors (kInput) name the line or the entity, and the remedy, without the file.
/// Cost: linear but for the sorting of the numbers; up to 4 bytes of memory a byte.
[[nodiscard]] Result<void> CheckPart21(std::string_view text);

}  // namespace trammel::machine
