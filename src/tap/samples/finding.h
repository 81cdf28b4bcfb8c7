// Names of all reasons for which a tap is refused, and of all notices.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "tap/samples/tap.h"

namespace trammel::tap {

/// Code of a finding; its comment contains the units of figure and limit.
enum class FindingCode : std::uint8_t {
  kNone,
  // Recording.
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
  // Samples: notices, and refusals where they affect the pull-back.
  kDuplicateTimes,    ///< Samples that repeat a time; the most that are borne.
  kClockStep,         ///< ms by which the samples' clock stepped; the most that is borne.
  kDroppedSamples,    ///< Samples missing; the most in a row that are borne.
  kHeldValues,        ///< Values that repeat the one before, left out; the most without a word.
  kSpikes,            ///< Samples alone far off, left out; the most that are borne.
  kErrorFrames,       ///< The same, all of one value.
  kStuckSamples,      ///< Samples in a row of one value; the most in the pull-back that are borne.
  kSaturatedSamples,  ///< Samples at the end of the range; the most in the pull-back.
  kHum50Hz,           ///< gf of amplitude; Hz at which it appears.
  kHum60Hz,           ///< as above
  kHum100Hz,          ///< as above
  kHum120Hz,          ///< as above
  kDrift,             ///< gf/s; the most without a word.
  kHotNozzle,         ///< degC; the most at which no filament oozes.
  // Findings about the surface pressed on.
  kNoContact,       ///< gf by which the force at rest stands out; least.
  kMidAirImpulse,   ///< gf that were reached on the way down and gone before the pull-back; most.
  kStillInContact,  ///< gf/s at the pull-back's end; the most that is flat.
  kFouledNozzle,    ///< % of the force lost at rest; most.
  kSlowCollision,   ///< mm from the first touch to the halt; most.
  kBaselineForceInconsistent,  ///< gf between before and after that drift does not explain; most.
  kAdhesion,                   ///< gf by which the bed pulls on the nozzle after the break; most.
  kLowCompressionForce,        ///< gf; the trigger force.
  kLowDecompressionForce,      ///< % of the compression force; least.
  kLowTapQuality,              ///< Score; least.
  kShortPress,                 ///< mm; least without a word.
  // Published method only.
  kTooFewProbingMoves,        ///< Moves; 5.
  kTooManyProbingMoves,       ///< Moves; 6.
  kCoastingMoveAcceleration,  ///< mm/s^2 of the approach's cruise; 0.
  kApproachUnknown,           ///< Samples before the halt; the least that are needed.
  kFewDecompressionSamples,   ///< Samples between the pull-back's cruise and the break; least.
  kTapChronology,             ///< Point (from 1) that is not later than the one before; 0.
  kTapShapeInvalid,           ///< Point (from 1) at which the curve turns the wrong way; 0.
  kTapBreakContactTooEarly,   ///< s from the pull-back's start to the break; least.
  kTapBreakContactTooLate,    ///< s from the pull-back's start to the break; most.
  kTapPullbackTooShort,       ///< % of the pull-back that is over at the break; most.
  kDecompressionNotSplit,     ///< Deviations of noise from its ends to its middle; least.
  // Break, by the contact method.
  kFewSamplesInCruise,  ///< Samples during the pull-back's cruise; the least that are needed.
  kNoBreak,             ///< gf by which the press stands out at the pull-back's cruise; least.
  kBreakAtEdge,         ///< Samples between the break and the nearer end of the cruise; least.
  kVagueBreak,          ///< mm that the 95 % interval would be wide, to either side; the most.
  kLooseSheet,          ///< % of the slope deeper down with which the press starts; least.
  // Notices of the fit.
  kOutliersForgotten,  ///< Samples of the pull-back that were given little weight; 0.
  kHumRemoved,         ///< gf of amplitude of the mains line that was fitted; 0.
  kPressTrimmed,       ///< Share of the press, from its deepest end, that was left out; 0.
  kCorrelatedNoise,    ///< factor by which correlation widens the interval; 1
  kFormLeftOpen,       ///< mm between the answers of the forms of press in question; mm of the
                       ///< interval to either side.
  kApproachDiffers,    ///< mm from the break up to where the approach met the bed; the most.
};

/// Returns the code's name in JSON, as "no_samples".
[[nodiscard]] std::string_view Name(FindingCode code);

/// Returns a sentence with the figure, its limit and the remedy.
[[nodiscard]] std::string Explain(const Finding& finding);

/// Writes the sentence into memory of the caller, cut to its size and zero-terminated; allocates
/// nothing.
/// @returns the length of the whole sentence, without the zero.
std::size_t ExplainTo(std::span<char> text, const Finding& finding);

/// Returns the contact as a quantity, or the verdict with the reason in a sentence.
[[nodiscard]] Measured ContactOf(const TapAnalysis& analysis);

}  // namespace trammel::tap
