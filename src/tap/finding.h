// Every reason for which a tap is refused, and every notice, by name.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "tap/tap.h"

namespace trammel::tap {

/// The unit of figure and limit stands behind each.
enum class FindingCode : std::uint8_t {
  kNone,
  // The recording.
  kNoSamples,       ///< Samples there are; the least that are needed.
  kTooManySamples,  ///< Samples there are; the most that are looked at.
  kUnsortedTimes,   ///< Samples that are earlier than the one before them; 0.
  kNotFinite,       ///< Samples whose time or force is no number, or absurdly large; 0.
  kMissingMoves,    ///< Moves there are; the least upward ones that are needed.
  kAbsurdMoves,     ///< The first move (from 1) that is no movement of a printer, or comes before
                    ///< the one in front of it; 0.
  kNoCruise,        ///< Upward moves at constant speed; the least that are needed.
  kMovesOutside,    ///< s of the pull-back's cruise without samples; the most allowed.
  kSmallWorkspace,  ///< Bytes given; bytes needed.
  // The break, as the method sees it.
  kFewSamplesInCruise,  ///< Samples during the pull-back's cruise; the least that are needed.
  kNoBreak,             ///< gf by which the press stands out at the pull-back's cruise; least.
  kBreakAtEdge,         ///< Samples between the break and the nearer end of the cruise; least.
  kVagueBreak,          ///< mm that the 95 % interval would be wide, to either side; the most.
};

/// Its name in JSON, as "no_samples".
[[nodiscard]] std::string_view Name(FindingCode code);

/// A sentence with the figure, its limit and what to do.
[[nodiscard]] std::string Explain(const Finding& finding);

/// The same into memory of the caller, cut to its size and ended by a zero; allocates nothing.
/// @returns the length of the whole sentence, without the zero.
std::size_t ExplainTo(std::span<char> text, const Finding& finding);

}  // namespace trammel::tap
