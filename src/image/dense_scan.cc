#include "image/dense_scan.h"

#include <algorithm>

namespace trammel::image {

DenseScan::DenseScan(const McuBlocks& mcu, const BlockWalker& walker, const EntropyData& data)
    : mcu_(&mcu), walker_(&walker), data_(&data), scan_(mcu, EntropyDataBits(data, 0), 0) {}

void DenseScan::BeginAhead(std::size_t at_bit) {
  constexpr int kMostTries = 64;
  for (int i = 0; i < kMostTries; ++i, ++at_bit) {
    McuScan<EntropyDataBits> scan(*mcu_, EntropyDataBits(*data_, at_bit), 0);
    starts_ = 0;
    do {
      at_bit = scan.bits().at_bit();
      start_bit_[starts_++] = at_bit;
    } while (starts_ < kMostStarts && scan.Pass(1));
    if (starts_ < kMostStarts) continue;
    ahead_ = walker_->Begin(at_bit);
    return;
  }
  starts_ = 0;
}

/// Goes on to the end of a block that is the last of an MCU.
bool DenseScan::FinishMcu(BlockWalk& walk) const {
  while (!walk.between_blocks() || walk.passed() % mcu_->count() != 0) {
    if (!walker_->PassCode(*data_, walk)) return false;
  }
  return true;
}

/// Goes past MCUs until either the scan or the walk ahead is near its end.
/// @param end_bit  or until behind there.
bool DenseScan::PassTogether(int mcus, std::size_t end_bit, int& passed) {
  passed = 0;
  if (starts_ == 0) return true;
  const std::size_t blocks = mcu_->count();
  BlockWalk walk = walker_->Begin(at_bit());
  const BlockWalker::End end{blocks * static_cast<std::size_t>(mcus), end_bit};
  if (!walker_->PassTogether(end, *data_, walk, ahead_) || !FinishMcu(walk)) return false;
  DcLevels dc_past{};
  for (std::size_t i = 0; i < walk.dc.size(); ++i) {
    dc_past[mcu_->block(i % blocks).component] += walk.dc[i];
  }
  scan_.GoOn(EntropyDataBits(*data_, walk.at_bit), dc_past);
  passed = static_cast<int>(walk.passed() / blocks);
  return true;
}

bool DenseScan::Pass(int mcus) {
  int passed = 0;
  return PassTogether(mcus, data_->size_bit(), passed) && scan_.Pass(mcus - passed);
}

/// Goes on, from before the walk ahead, to where it began an MCU, too.
/// @param mcus   that there are, and then those that are left
/// @param start  which of its MCUs; starts_: it began none where this scan does
/// @returns false where there is no code.
bool DenseScan::MeetAhead(int& mcus, std::size_t& start) {
  constexpr int kStride = 4;  // fewer MCUs than there are starts
  while (at_bit() < start_bit_[0] && mcus > 0) {
    const int some = std::min(mcus, kStride);
    if (!scan_.Pass(some)) return false;
    mcus -= some;
  }
  for (start = 0; mcus > 0; --mcus) {
    while (start < starts_ && start_bit_[start] < at_bit()) ++start;
    if (start == starts_ || start_bit_[start] == at_bit()) return true;
    if (!scan_.Pass(1)) return false;
  }
  start = starts_;
  return true;
}

bool DenseScan::PassLast(int mcus) {
  if (starts_ == 0) return scan_.Pass(mcus);
  int passed = 0;
  if (!PassTogether(mcus, start_bit_[0], passed)) return false;
  mcus -= passed;
  std::size_t start = 0;
  if (!MeetAhead(mcus, start)) return false;
  // Where both stand at the begin of an MCU they go the same way from there. What lies behind the
  // last MCU is no data: a walk that went there is not followed.
  if (start < starts_ && FinishMcu(ahead_)) {
    const std::size_t ahead = starts_ - 1 - start + ahead_.passed() / mcu_->count();
    if (ahead <= static_cast<std::size_t>(mcus)) {
      scan_.GoOn(EntropyDataBits(*data_, ahead_.at_bit), {});
      mcus -= static_cast<int>(ahead);
      joined_ = true;
    }
  }
  return scan_.Pass(mcus) && !scan_.bits().RanOut();
}

}  // namespace trammel::image
