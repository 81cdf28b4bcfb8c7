#include "tap/samples/finding.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace trammel::tap {
namespace {

/// Text of a finding; in the sentence {0} is the figure, {1} the limit.
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
    {kDuplicateTimes, "duplicate_times",
     "{0:.0f} samples repeat a time and were left out; at most {1:.0f} are borne. Look how the "
     "recording was put together; packets may have been written twice."},
    {kClockStep, "clock_step",
     "The clock of the samples stepped by {0:.2f} ms; {1:.2f} ms are borne, by a wider interval. "
     "Stamp samples with the clock of the moves, and let nothing set it during a tap."},
    {kDroppedSamples, "dropped_samples",
     "{0:.0f} samples are missing; the break is not looked for in a gap of more than {1:.0f}. "
     "Look at the load on the host and at the cable of the load cell."},
    {kHeldValues, "held_values",
     "{0:.0f} samples repeat the value before them: the load cell's converter is slower than it "
     "is read, and they were left out. Read it once per conversion."},
    {kSpikes, "spikes",
     "{0:.0f} samples lie alone far off the curve and were left out; at most {1:.0f} are borne. "
     "Look at the cable of the load cell, its shield and its connectors."},
    {kErrorFrames, "error_frames",
     "{0:.0f} samples are one and the same value far off the curve, as a converter sends in place "
     "of a reading (HX71x: -1), and were left out; at most {1:.0f} are borne. Look at the "
     "converter's wiring and supply."},
    {kStuckSamples, "stuck_samples",
     "{0:.0f} samples in a row have one value, which noise would not let them; in the pull-back "
     "at most {1:.0f} are borne. The converter repeats itself: look at its wiring and its sample "
     "rate."},
    {kSaturatedSamples, "saturated_samples",
     "{0:.0f} samples lie at one end of the range; in the pull-back at most {1:.0f} are borne. "
     "The converter is full: lower its gain, tare it, or lower the trigger force."},
    {kHum50Hz, "hum_50_hz",
     "A hum of {0:.1f} gf is seen at {1:.1f} Hz, where mains of 50 Hz appears at this sampling "
     "rate (docs/howto/tap.md says which other line would). Ground the cell's shield, or filter 50 "
     "Hz."},
    {kHum60Hz, "hum_60_hz",
     "A hum of {0:.1f} gf is seen at {1:.1f} Hz, where mains of 60 Hz appears at this sampling "
     "rate (docs/howto/tap.md says which other line would). Ground the cell's shield, or filter 60 "
     "Hz."},
    {kHum100Hz, "hum_100_hz",
     "A hum of {0:.1f} gf is seen at {1:.1f} Hz, where twice 50 Hz mains appears at this sampling "
     "rate. A rectifier hums so: look at the supply of the load cell's converter."},
    {kHum120Hz, "hum_120_hz",
     "A hum of {0:.1f} gf is seen at {1:.1f} Hz, where twice 60 Hz mains appears at this sampling "
     "rate. A rectifier hums so: look at the supply of the load cell's converter."},
    {kDrift, "drift",
     "The force of the free nozzle drifts by {0:.1f} gf/s; {1:.1f} gf/s would pass without a "
     "word. Look at the pull of filament and cables, and set the drift filter."},
    {kHotNozzle, "hot_nozzle",
     "The nozzle was at {0:.0f} degC; above {1:.0f} degC filament oozes. Probe colder and scrub "
     "the nozzle first."},
    {kNoContact, "no_contact",
     "At rest the force stands out by {0:.1f} gf; a press beside this noise shows {1:.1f} gf or "
     "more. The nozzle did not reach the bed: look at the trigger and where the probing move "
     "ends."},
    {kMidAirImpulse, "mid_air_impulse",
     "{0:.1f} gf were reached on the way down and were gone before the pull-back, where more than "
     "{1:.1f} gf should be left. Something shook the nozzle in mid-air: probe more slowly, raise "
     "the trigger force, or look at cables that snag."},
    {kStillInContact, "still_in_contact",
     "At the pull-back's end the force still changes by {0:.0f} gf/s; a free nozzle shows at most "
     "{1:.0f} gf/s. The nozzle had not let go: pull back farther; with a slow converter probe "
     "more slowly, too, because the head stops late."},
    {kFouledNozzle, "fouled_nozzle",
     "{0:.0f} % of the force were lost while the nozzle stood on the bed; a clean nozzle loses at "
     "most {1:.0f} %. Soft plastic gave way, or the sheet lies loose: scrub the nozzle, clean "
     "under the sheet, probe colder."},
    {kSlowCollision, "slow_collision",
     "The nozzle met something {0:.3f} mm before the halt; the press seen on the pull-back allows "
     "{1:.3f} mm. Plastic on the nozzle touched first: scrub the nozzle and probe again."},
    {kBaselineForceInconsistent, "baseline_force_inconsistent",
     "The free nozzle's force differs by {0:.1f} gf between before and after the press, beyond "
     "what drifts; at most {1:.1f} gf are borne. Plastic, a cable or filament pulled on the "
     "nozzle: scrub it, and look for what moves with the head."},
    {kAdhesion, "adhesion",
     "After the break something pulled on the nozzle with {0:.1f} gf; at most {1:.1f} gf are "
     "borne. Ooze stuck to the bed: probe colder, retract filament, scrub the nozzle."},
    {kLowCompressionForce, "low_compression_force",
     "The press reached {0:.1f} gf and the trigger is set to {1:.1f} gf. The force rose too "
     "slowly: scrub the nozzle, or look whether the bed gives way."},
    {kLowDecompressionForce, "low_decompression_force",
     "Only {0:.0f} % of the force of the press were left when the pull-back began; {1:.0f} % or "
     "more are usual. The sheet may lie loose, or plastic gave way."},
    {kLowTapQuality, "low_tap_quality",
     "The tap scores {0:.0f} of 100; below {1:.0f} a tap is bad. Scrub the nozzle, probe colder, "
     "and probe again."},
    {kShortPress, "short_press",
     "The press is {0:.4f} mm deep; from {1:.4f} mm on the break is well known. Raise the trigger "
     "force, or probe faster."},
    {kTooFewProbingMoves, "too_few_probing_moves",
     "There are {0:.0f} moves; the published method needs {1:.0f}: cruise, halt, and the "
     "pull-back's three. Record the moves of the whole tap."},
    {kTooManyProbingMoves, "too_many_probing_moves",
     "There are {0:.0f} moves; the published method knows {1:.0f}. Give the moves of one tap."},
    {kCoastingMoveAcceleration, "coasting_move_acceleration",
     "The approach's cruise accelerates by {0:.1f} mm/s^2; it must by {1:.0f}. The probing move "
     "ended before the trigger: allow lower heights (a negative position_min)."},
    {kApproachUnknown, "approach_unknown",
     "{0:.0f} samples show the approach before the halt; the published method needs {1:.0f}, and "
     "a downward move that ends there. Record from before the collision on."},
    {kFewDecompressionSamples, "few_decompression_samples",
     "{0:.0f} samples show the decompression; a line needs {1:.0f}. Pull back more slowly, raise "
     "the trigger force, or use a faster converter."},
    {kTapChronology, "tap_chronology",
     "Point {0:.0f} of the force curve is not later than the one before it. The curve is no "
     "tap's: scrub the nozzle and probe again."},
    {kTapShapeInvalid, "tap_shape_invalid",
     "At point {0:.0f} the force curve turns the wrong way. The curve is no tap's: scrub the "
     "nozzle and probe again."},
    {kTapBreakContactTooEarly, "tap_break_contact_too_early",
     "Contact broke {0:.4f} s after the pull-back's start, before its cruise at {1:.4f} s. Press "
     "harder, or pull back more slowly."},
    {kTapBreakContactTooLate, "tap_break_contact_too_late",
     "Contact broke {0:.4f} s after the pull-back's start, which is over after {1:.4f} s. Pull "
     "back farther."},
    {kTapPullbackTooShort, "tap_pullback_too_short",
     "Contact broke when {0:.0f} % of the pull-back were over; at most {1:.0f} % leave enough "
     "behind the break. Pull back farther."},
    {kDecompressionNotSplit, "decompression_not_split",
     "The decompression reaches {0:.1f} deviations of the noise from its middle; {1:.1f} are "
     "needed to tell a curve in it, so it was taken for straight. A quieter or more sensitive "
     "load cell, faster probing or a higher trigger force would help."},
    {kFewSamplesInCruise, "few_samples_in_cruise",
     "Only {0:.0f} samples fall into the pull-back's cruise; at least {1:.0f} are needed. Pull "
     "back more slowly or farther, or use a faster converter."},
    {kNoBreak, "no_break",
     "The press stands out by {0:.1f} gf when the pull-back has reached its speed; at least "
     "{1:.1f} gf are needed beside this noise and this force at rest. Raise the trigger force, "
     "let the pull-back accelerate faster or run more slowly, or quieten the load cell."},
    {kBreakAtEdge, "break_at_edge",
     "Only {0:.0f} samples lie between the break and the end of what was fitted; at least {1:.0f} "
     "are needed. Pull back farther, or press harder."},
    {kVagueBreak, "vague_break",
     "The break is known only to {0:.4f} mm to either side; more than {1:.4f} mm are of no use. "
     "Use a quieter load cell, a slower pull-back or a higher trigger force."},
    {kLooseSheet, "loose_sheet",
     "The press bends at once: it starts with {0:.0f} % of the slope that it has deeper down; "
     "{1:.0f} % or more are a smooth press. Something gives way before the bed does: clean under "
     "the sheet, lay it flat, scrub the nozzle."},
    {kOutliersForgotten, "outliers_forgotten",
     "{0:.0f} samples of the pull-back lie far off the others and were left out of account. Look "
     "at the wiring of the load cell if this happens often."},
    {kHumRemoved, "hum_removed",
     "Mains hum of {0:.1f} gf was found in the force and taken into account. Keep the load cell's "
     "cable away from mains, or choose a sample rate that suppresses 50 or 60 Hz."},
    {kPressTrimmed, "press_trimmed",
     "The deepest {0:.2f} of the press follow no smooth curve and were left out: the drive was "
     "not yet following at the start of the pull-back. Look for backlash, or pull back farther."},
    {kCorrelatedNoise, "correlated_noise",
     "Neighbouring samples err together; the interval was widened by {0:.1f}. A filter in the "
     "converter, a vibration or a press of unusual form does this."},
    {kFormLeftOpen, "form_left_open",
     "Different forms of the press place the break {0:.4f} mm apart, as far as the samples go; "
     "the interval covers them. Less noise or a slower pull-back would tell them apart."},
    {kApproachDiffers, "approach_differs",
     "The approach met the bed {0:+.4f} mm from the break (+: above); up to {1:.4f} mm to either "
     "side is usual. Plastic on the nozzle, a loose bed, backlash or a wrong sensor latency does "
     "this."},
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

Measured ContactOf(const TapAnalysis& analysis) {
  switch (analysis.verdict) {
    case Verdict::kGood:
      return Measured::Good(analysis.contact_mm);
    case Verdict::kCannotTell:
      return Measured::CannotTell(Explain(analysis.reason));
    case Verdict::kRefused:
      break;
  }
  return Measured::Refused(Explain(analysis.reason));
}

}  // namespace trammel::tap
