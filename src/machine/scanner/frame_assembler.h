// The passes of a scanner's carriage become a page.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/page.h"
#include "base/result.h"
#include "machine/page/page_decoders.h"
#include "machine/scanner/sane_scan.h"

namespace trammel::machine {

/// Takes samples as they come, in pieces of any size. Grey and colour come as one frame; old
/// scanners send three, one of each colour. Trusts nothing that it is told.
class FrameAssembler {
 public:
  explicit FrameAssembler(const PageReadOptions& limits) : limits_(limits) {}

  /// Errors: sizes that contradict each other, or are beyond the limits.
  [[nodiscard]] Result<void> Begin(const FrameHead& head);
  [[nodiscard]] Result<void> Add(std::span<const std::uint8_t> samples);
  /// Errors: lines are missing.
  [[nodiscard]] Result<void> End();
  /// Tells the share of the frame that is there, where its length is known.
  void Tell(const std::function<void(double)>& progress) const;
  /// Errors: not a whole page.
  [[nodiscard]] Result<Page> Finish();

 private:
  [[nodiscard]] Result<void> AddLine(std::span<const std::uint8_t> line);
  [[nodiscard]] Result<void> MergeColor();

  PageReadOptions limits_;
  FrameHead head_;
  PageLayout layout_;
  bool open_ = false;
  bool expects_more_ = true;
  std::vector<std::uint8_t> begun_line_;
  Page frame_;
  Page page_;
};

}  // namespace trammel::machine
