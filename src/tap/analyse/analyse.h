// Interface of the tap analysis: converts one tap to a method's result.
#pragma once

#include <cstddef>
#include <vector>

#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Returns the workspace in bytes for taps of this many samples, with either method.
[[nodiscard]] std::size_t WorkspaceBytes(std::size_t samples);

/// Analyses one tap in memory of the caller. Allocates nothing and never throws; the result is an
/// analysis for any input.
[[nodiscard]] TapAnalysis AnalyseTap(const TapView& tap, const TapOptions& options,
                                     Workspace& workspace);

/// Analyses taps one after the other and reuses its memory: nothing is allocated after the longest
/// of them. One per thread.
class TapAnalyser {
 public:
  explicit TapAnalyser(const TapOptions& options) : options_(options) {}
  [[nodiscard]] TapAnalysis Analyse(const TapView& tap);

 private:
  TapOptions options_;
  std::vector<std::byte> memory_;
};

}  // namespace trammel::tap
