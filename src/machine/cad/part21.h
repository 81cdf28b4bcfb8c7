// The frame of an exchange file of ISO 10303-21, before a reader of STEP is trusted with it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::machine {

/// Whether the bytes begin as such a file does, behind blanks and comments.
[[nodiscard]] bool LooksLikePart21(std::string_view bytes);

/// Entries of one list. Open CASCADE takes the square of them: 200,000 take a minute, 20,000 less
/// than a second. A part's shell lists its faces.
inline constexpr std::size_t kMostPart21Entries = 20'000;

/// Passes a file that is whole: its sections and its end are there, strings and parentheses are
/// closed, lists are no longer than kMostPart21Entries, each entity has a number of its own, and
/// those that are referred to exist. What the entities mean is not looked at.
/// @returns the file as edition 1 has it, which is all that Open CASCADE reads: one section DATA
/// without a name and no section ANCHOR; places and lines stay.
/// Errors (kInput) name the line or the entity, and the remedy, without the file; what refers to
/// other files (edition 3's REFERENCE) is among them.
/// Cost: linear but for the sorting of the numbers; up to 5 bytes of memory a byte.
[[nodiscard]] Result<std::string> CheckPart21(std::string_view text);

}  // namespace trammel::machine
