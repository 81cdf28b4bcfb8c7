// What a search for settings comes to, in a sentence or two.
#pragma once

#include <span>
#include <string>

#include "tap/tuning/tuning.h"
#include "tap/tuning/tuning_search.h"

namespace trammel::tap {

/// Sets the tuning's end, because, trials and tried. The trial is held against the recordings
/// first: where they fail or succeed as its taps do not, nothing can be promised.
void Conclude(const Search& search, std::span<const TuningTap> taps, double wanted_mm,
              Tuning& tuning);

/// What most of the taps lack, and what to do before any advice.
[[nodiscard]] std::string WhyTooFewAreGood(std::span<const TuningTap> taps);

}  // namespace trammel::tap
