// MCUs of a JPEG's entropy-coded data gone past at two places at a time.
#pragma once

#include <array>
#include <cstddef>

#include "image/block_walk.h"
#include "image/entropy_data.h"
#include "image/entropy_writer.h"
#include "image/mcu_scan.h"

namespace trammel::image {

/// As McuScan, of data without restart markers, with a walk ahead: it begins somewhere in the data,
/// at what need not be a block's begin. Within a few blocks it mostly meets one, and goes the way
/// of a scan that comes from the front, which takes its place over.
class DenseScan {
 public:
  /// REQUIRES that all outlive it. The walker goes past the same blocks.
  DenseScan(const McuBlocks& mcu, const BlockWalker& walker, const EntropyData& data);

  /// Begins the walk ahead, there or soon behind.
  void BeginAhead(std::size_t at_bit);

  /// Goes past so many MCUs; false where there are not so many.
  [[nodiscard]] bool Pass(int mcus);

  /// As Pass(), of the last MCUs: those of the walk ahead are passed already.
  [[nodiscard]] bool PassLast(int mcus);

  [[nodiscard]] bool Copy(int mcus, EntropyWriter& writer) { return scan_.Copy(mcus, writer); }

  [[nodiscard]] bool joined() const { return joined_; }  ///< with the walk ahead

 private:
  static constexpr std::size_t kMostStarts = 16;

  [[nodiscard]] bool PassTogether(int mcus, std::size_t end_bit, int& passed);
  [[nodiscard]] bool MeetAhead(int& mcus, std::size_t& start);
  [[nodiscard]] bool FinishMcu(BlockWalk& walk) const;
  [[nodiscard]] std::size_t at_bit() const { return scan_.bits().at_bit(); }

  const McuBlocks* mcu_;
  const BlockWalker* walker_;
  const EntropyData* data_;
  McuScan<EntropyDataBits> scan_;
  BlockWalk ahead_;                                   // from the last of its starts on
  std::array<std::size_t, kMostStarts> start_bit_{};  // of the first MCUs of the walk ahead
  std::size_t starts_ = 0;                            // 0: there is no such walk
  bool joined_ = false;
};

}  // namespace trammel::image
