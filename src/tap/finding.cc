#include "tap/finding.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace trammel::tap {
namespace {

/// In the sentence {0} is the figure, {1} the limit.
struct Entry {
  FindingCode code;
  std::string_view name;
  std::string_view sentence;
};

using enum FindingCode;

constexpr Entry kEntries[] = {
    {kNone, "none", "Nothing was found."},
    {kNoSamples, "no_samples",
     "There are {0:.0f} samples with a time and a force; a tap needs at least {1:.0f}. Record the "
     "whole tap, from before the collision to after the pull-back."},
    {kTooManySamples, "too_many_samples",
     "There are {0:.0f} samples; more than {1:.0f} are no tap. Give the samples of one tap."},
    {kUnsortedTimes, "unsorted_times",
     "{0:.0f} samples are earlier than the one before them. Look how the recording was put "
     "together; its packets are out of order."},
    {kNotFinite, "not_finite",
     "{0:.0f} samples hold a time or a force that is no number or absurdly large. Look at the "
     "wiring of the load cell and at the program that recorded it."},
    {kMissingMoves, "missing_moves",
     "None of the {0:.0f} moves goes upward; the pull-back is needed to know the height. Record "
     "the moves of the whole tap."},
    {kAbsurdMoves, "absurd_moves",
     "Move {0:.0f} is no movement of a printer (a number that is not finite or far too large, a "
     "negative duration, or a start before that of the move in front of it)."},
    {kNoCruise, "no_cruise",
     "The pull-back has no stretch at constant speed, and samples taken while it accelerates are "
     "not reliable. Pull back farther or more slowly."},
    {kMovesOutside, "moves_outside_samples",
     "{0:.3f} s of the pull-back's cruise have no samples; at most {1:.3f} s may be missing. "
     "Record until the pull-back has ended, with times on the clock of the moves."},
    {kSmallWorkspace, "small_workspace",
     "The workspace has {0:.0f} bytes; this tap needs {1:.0f}."},
    {kFewSamplesInCruise, "few_samples_in_cruise",
     "Only {0:.0f} samples fall into the pull-back's cruise; at least {1:.0f} are needed. Pull "
     "back more slowly or farther, or use a faster converter."},
    {kNoBreak, "no_break",
     "The press stands out by {0:.1f} gf when the pull-back has reached its speed; at least "
     "{1:.1f} gf are needed beside this noise. Raise the trigger force, or quieten the load "
     "cell."},
    {kBreakAtEdge, "break_at_edge",
     "Only {0:.0f} samples lie between the break and the end of what was fitted; at least {1:.0f} "
     "are needed. Pull back farther, or press harder."},
    {kVagueBreak, "vague_break",
     "The break is known only to {0:.4f} mm to either side; more than {1:.4f} mm are of no use. "
     "Use a quieter load cell, a slower pull-back or a higher trigger force."},
};

const Entry& Find(FindingCode code) {
  const auto* found = std::find_if(std::begin(kEntries), std::end(kEntries),
                                   [code](const Entry& entry) { return entry.code == code; });
  return found == std::end(kEntries) ? kEntries[0] : *found;
}

}  // namespace

std::string_view Name(FindingCode code) { return Find(code).name; }

std::string Explain(const Finding& finding) {
  return fmt::format(fmt::runtime(Find(finding.code).sentence), finding.figure, finding.limit);
}

std::size_t ExplainTo(std::span<char> text, const Finding& finding) {
  const std::size_t room = text.empty() ? 0 : text.size() - 1;
  const auto end = fmt::format_to_n(text.data(), room, fmt::runtime(Find(finding.code).sentence),
                                    finding.figure, finding.limit);
  if (!text.empty()) {
    text[std::min(room, end.size)] = '\0';
  }
  return end.size;
}

}  // namespace trammel::tap
