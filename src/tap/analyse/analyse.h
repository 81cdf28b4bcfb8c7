// The door of the room: one tap in, what a method says of it out.
#pragma once

#include <cstddef>
#include <vector>

#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Bytes of workspace that suffice for taps of so many samples, with either method.
[[nodiscard]] std::size_t WorkspaceBytes(std::size_t samples);

/// Analyses one tap in memory of the caller. Allocates nothing and throws nothing; whatever the tap
/// holds, the answer is an analysis.
[[nodiscard]] TapAnalysis AnalyseTap(const TapView& tap, const TapOptions& options,
                                     Workspace& workspace);

/// Analyses taps one after the other with memory that it keeps: nothing is allocated once it has
/// seen the longest of them. One per thread.
class TapAnalyser {
 public:
  explicit TapAnalyser(const TapOptions& options) : options_(options) {}
  [[nodiscard]] TapAnalysis Analyse(const TapView& tap);

 private:
  TapOptions options_;
  std::vector<std::byte> memory_;
};

}  // namespace trammel::tap
