#include "tap/analyse/analyse.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tap/contact/contact.h"
#include "tap/judge/quality_checks.h"
#include "tap/samples/corruption.h"
#include "tap/samples/finding.h"
#include "tap/samples/motion.h"
#include "tap/two_line/two_line.h"

namespace trammel::tap {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

TapAnalysis Refused(Method method, const Finding& reason) {
  TapAnalysis result;
  result.method = method;
  result.verdict = Verdict::kRefused;
  result.reason = reason;
  result.quality = result.noise_g = kNone;
  return result;
}

/// Runs the checks that both methods share first; neither method may analyse a tap that they
/// refuse.
void Judge(const TapView& tap, const TapMotion& motion, const TapOptions& options,
           Workspace& workspace, TapAnalysis& result) {
  const CleanTap clean = CleanSamples(tap, motion, workspace);
  if (!clean.memory_suffices) {
    result.reason = {FindingCode::kSmallWorkspace, static_cast<double>(workspace.Left()),
                     static_cast<double>(WorkspaceBytes(tap.time_s.size()))};
    return;
  }
  const TapLines lines = FindTapLines(clean, motion);
  const CheckOptions checks = {options.nozzle_temperature_c, options.trigger_force_g,
                               options.decompression_angle_rad};
  const Finding refusal = CheckTap(clean, motion, lines, checks, result);
  if (options.method == Method::kTwoLine) {
    JudgeTwoLine(tap.moves, clean, motion, lines, options, result);
  } else {
    AnalyseContact(clean, motion, options, workspace, result);
  }
  if (refusal.code != FindingCode::kNone) {
    result.verdict = Verdict::kRefused;
    result.reason = refusal;
  }
}

/// Clears value and uncertainty unless the verdict is good.
void HideUnlessGood(TapAnalysis& result) {
  if (result.verdict != Verdict::kGood) {
    result.contact_mm = {kNone, kNone, {kNone, kNone}};
    result.contact_time_s = kNone;
  }
}

}  // namespace

std::size_t WorkspaceBytes(std::size_t samples) {
  return CleanWorkspaceBytes(samples) + ContactWorkspaceBytes(samples);
}

TapAnalysis AnalyseTap(const TapView& tap, const TapOptions& options, Workspace& workspace) {
  TapMotion motion;
  TapAnalysis result = Refused(options.method, CheckInput(tap, motion));
  if (result.reason.code == FindingCode::kNone) {
    Judge(tap, motion, options, workspace, result);
  }
  HideUnlessGood(result);
  return result;
}

TapAnalysis TapAnalyser::Analyse(const TapView& tap) {
  // Refusing more samples than CheckInput admits needs no memory.
  const std::size_t samples = std::min(tap.time_s.size(), kMaxSamples);
  if (const std::size_t bytes = WorkspaceBytes(samples); memory_.size() < bytes) {
    memory_.resize(bytes);
  }
  Workspace workspace(memory_);
  return AnalyseTap(tap, options_, workspace);
}

}  // namespace trammel::tap
