// Method contact: one continuous model of force against z around the break.
#pragma once

#include <cstddef>

#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Returns the maximum workspace of AnalyseContact, bytes.
[[nodiscard]] std::size_t ContactWorkspaceBytes(std::size_t samples);

/// Model, in the height z that the moves say for the time at which a force acted (its sample's time
/// less the latency): a baseline that may slope with z (a drift in time, on a cruise), and below
/// the break a press that starts from zero and may stiffen or soften. Only the pull-back's cruise
/// is used; samples of its acceleration are not reliable (the write-up). break_estimate.h has the
/// fit and its interval; docs/howto/tap.md the derivation.
///
/// What the samples may do and what is done about it: lone wild samples are forgotten; mains hum is
/// fitted along; a press whose start (backlash, creep) follows no smooth curve is cut from its
/// deepest end; where the residuals still show more than noise, the misfit in the press takes the
/// noise's place as the interval's scale. Each leaves a notice. Parts of the stretch that disagree
/// with the whole, and a free force that differs before and after, widen the interval. A latency
/// that is not stated comes from the approach (latency.h).
///
/// @param clean, motion  Of one tap.
/// @param result         Verdict, reason, contact, uncertainty, noise, points, fit, notices are
/// set. Accuracy: contact_test has the figures. Cost: about 0.1 ms of processor time for
/// 400 samples, 0.2 ms with hum (bench/tap_bench.cc), up to ten times as much if a quiet
/// cell leaves averaging in question; no allocation.
void AnalyseContact(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                    Workspace& workspace, TapAnalysis& result);

}  // namespace trammel::tap
