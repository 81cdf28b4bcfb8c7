// Advice on crop, threshold and exposure, from how the stripe looks at the focus.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pressure_advance/setup/solve_setup.h"

namespace trammel::pressure_advance {

struct SetupAdvice {
  /// Level of red, 0 … 255, above which a pixel is the stripe's: half of its height over the plate,
  /// for programs that want one; the laser eye of trammel learns its own. Absent without a stripe.
  std::optional<int> threshold;
  std::vector<std::string> lines;  ///< what to do, or what is as it should be
};

/// Of a result whatever its verdict: what it lacks is not spoken of.
[[nodiscard]] SetupAdvice AdviseSetup(const SetupResult& result, const PictureSize& picture);

}  // namespace trammel::pressure_advance
