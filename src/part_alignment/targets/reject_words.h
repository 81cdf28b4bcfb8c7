// Why what looks like a target was not read, in words.
#pragma once

#include <string>

#include "part_alignment/targets/reject_reason.h"

namespace trammel::part_alignment {

/// "its ring is read well, but its code is none of this book's: another --bits, or no target".
[[nodiscard]] std::string WordsFor(RejectReason reason);

}  // namespace trammel::part_alignment
