// What every finder asks of a picture.
#pragma once

#include <optional>
#include <string>

#include "base/page.h"

namespace trammel::part_alignment {

/// Why no target can be looked for in it: not 8-bit grey, a side below 16 or above 32,767 px;
/// absent where one can.
[[nodiscard]] std::optional<std::string> PictureProblem(const PageView& picture);

}  // namespace trammel::part_alignment
