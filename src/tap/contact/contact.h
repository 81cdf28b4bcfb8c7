// The check from the other side: where the approach met the bed.
#pragma once

#include <cstddef>

#include "tap/contact/break_estimate.h"
#include "tap/contact/press_stretch.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Compares the collision on the approach with the break in `result`, as far as the approach was
/// recorded, and adds a notice where they contradict each other. The approach is several times
/// faster and noisier, so that it can only be a check.
void CheckApproach(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                   Workspace& workspace, TapAnalysis& result);

struct ContactInterval {
  double below_mm = 0;                 ///< from the contact down to the lower end, >= 0; 95 %
  double above_mm = 0;                 ///< from the contact up to the upper end, >= 0; 95 %
  double standard_uncertainty_mm = 0;  ///< k = 1
};

/// Adds to the interval of the break `e`, found in `stretch`, what its fit cannot see: the
/// uncertainty of options.latency_s (known, s), times that scatter, held values, steps of the clock
/// and of the converter.
[[nodiscard]] ContactInterval IntervalOf(const CleanTap& clean, const PressStretch& stretch,
                                         const BreakEstimate& e, const TapMotion& motion,
                                         const TapOptions& options);

/// Bytes that AnalyseContact takes from its workspace at most.
[[nodiscard]] std::size_t ContactWorkspaceBytes(std::size_t samples);

/// Model, in the height z that the moves say for the time at which a force acted (its sample's time
/// less the latency): a baseline that may slope with z (a drift in time, on a cruise), and below
/// the break a press that starts from zero and may stiffen or soften. Only the pull-back's cruise
/// is used; samples of its acceleration are not reliable (the write-up). break_estimate.h has the
/// fit and its interval; docs/tap.md the derivation.
///
/// What the samples may do and what is done about it: lone wild samples are forgotten; mains hum is
/// fitted along; where the residuals still show more than noise, the misfit in the press takes the
/// noise's place as the interval's scale. Each leaves a notice. A free force that differs before
/// and after widens the interval. A latency that is not stated comes from the approach (latency.h).
///
/// @param clean, motion  Of one tap.
/// @param result         Verdict, reason, contact, uncertainty, noise, points, fit, notices are
/// set. Accuracy: contact_test has the figures. Cost: about 28 us of processor time for
/// 400 samples, 52 with hum (bench/tap_bench.cc), up to ten times as much where a
/// quiet cell leaves averaging in question; no allocation.
void AnalyseContact(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                    Workspace& workspace, TapAnalysis& result);

}  // namespace trammel::tap
