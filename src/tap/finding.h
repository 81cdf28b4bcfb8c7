// Every reason for which a tap is refused, and every notice, by name.
#pragma once

#include <string>
#include <string_view>

#include "tap/tap.h"

namespace trammel::tap {

/// The unit of figure and limit stands behind each.
enum class FindingCode : std::uint8_t {
  kNone,
  // The recording.
  kNoSamples,      ///< Samples there are; the least that are needed.
  kUnsortedTimes,  ///< Samples that are earlier than the one before them; 0.
  kNotFinite,      ///< Samples whose time or force is no number; 0.
  kMissingMoves,   ///< Moves there are; the least that are needed.
  kMovesOutside,   ///< s of the pull-back without samples; the most allowed.
};

/// Its name in JSON, as "no_samples".
[[nodiscard]] std::string_view Name(FindingCode code);

/// A sentence with the figure, its limit and what to do.
[[nodiscard]] std::string Explain(const Finding& finding);

}  // namespace trammel::tap
