#include "image/mcu_scan.h"

#include <limits>
#include <utility>

namespace trammel::image {

void McuBlocks::Clear() {
  count_ = 0;
  flat_ = {};
}

bool McuBlocks::Add(const Block& block) {
  if (count_ == blocks_.size()) return false;
  blocks_[count_++] = block;
  return true;
}

void McuBlocks::MakeFlat() {
  flat_ = {};
  BitString joined;
  for (std::size_t b = 0; b < count_; ++b) {
    const BitString one = blocks_[b].codes->Flat();
    joined.count += one.count;
    if (one.count == 0 || joined.count > EntropyBits::kReady_bit) return;
    joined.bits = joined.bits << one.count | one.bits;
  }
  const int unused = 64 - joined.count;
  flat_ = {joined.bits << unused, ~std::uint64_t{0} << unused, joined.count};
}

template <class Bits>
McuScan<Bits>::McuScan(const McuBlocks& mcu, const Bits& bits, int restart_mcus)
    : mcu_(&mcu),
      bits_(bits),
      restart_mcus_(restart_mcus),
      until_restart_(restart_mcus > 0 ? restart_mcus : std::numeric_limits<int>::max()) {}

template <class Bits>
bool McuScan<Bits>::PassRestartWhereDue() {
  if (until_restart_-- > 0) return true;
  if (!bits_.PassRestart(restarts_)) return false;
  restarts_ = (restarts_ + 1) % 8;
  until_restart_ = restart_mcus_ - 1;
  dc_ = {};
  return true;
}

template <class Bits>
void McuScan<Bits>::GoOn(const Bits& bits, const DcLevels& dc_past) {
  bits_ = bits;
  for (std::size_t c = 0; c < dc_.size(); ++c) dc_[c] += dc_past[c];
}

namespace {

/// Goes past so many AC coefficients of a block.
template <class Bits>
[[gnu::always_inline]] inline bool PassCoefficients(const BlockCodes& codes, int left, Bits& bits) {
  while (left > 0) {
    bits.Fill();
    for (int i = 0; i < Bits::kReady_bit / BlockCodes::kLookedUp_bit; ++i) {
      AcStep step = codes.Several(bits.Look());
      if (left > step.weight()) [[likely]] {
        bits.Skip(step.bits());
        left -= step.weight();
        continue;
      }
      if (!step.found() || step.count() > left) {
        bits.Fill();
        step = codes.Ac(bits.Look());
        if (!step.found() || step.count() > left) return false;
      }
      bits.Skip(step.bits());
      left = step.ends() ? 0 : left - step.count();
      break;
    }
  }
  return true;
}

/// Copies the AC coefficients of a block.
template <class Bits>
bool CopyCoefficients(const BlockCodes& codes, Bits& bits, EntropyWriter& writer) {
  for (int left = kCoefficients - 1; left > 0;) {
    bits.Fill();
    AcStep step = codes.Several(bits.Look());
    if (left <= step.weight()) {  // the block's end lies between them, or there is none
      step = codes.Ac(bits.Look());
      if (!step.found() || step.count() > left) return false;
    }
    writer.Put(bits.Look() >> (64 - step.bits()), step.bits());
    bits.Skip(step.bits());
    left = step.ends() ? 0 : left - step.count();
  }
  return true;
}

}  // namespace

template <class Bits>
bool McuScan<Bits>::Pass(int mcus) {
  const McuBlocks& mcu = *mcu_;
  const McuBlocks::Flat& flat = mcu.flat();
  Bits bits = bits_;
  for (; mcus > 0; --mcus) {
    if (until_restart_ == 0) {
      bits_ = bits;
      if (!PassRestartWhereDue()) return false;
      bits = bits_;
    } else {
      --until_restart_;
    }
    bits.Fill();
    if (flat.IsNext(bits.Look())) {
      bits.Skip(flat.count);
      if (bits.RanOut()) return false;
      continue;
    }
    // Filled no oftener than is needed: what a look-up waits for is the fill before it.
    int ready = Bits::kReady_bit;  // at least
    for (std::size_t b = 0; b < mcu.count(); ++b) {
      const BlockCodes& codes = *mcu.block(b).codes;
      if (ready < BlockCodes::kLookedUp_bit) {
        bits.Fill();
        ready = Bits::kReady_bit;
      }
      FirstStep step = codes.First(bits.Look());
      ready -= BlockCodes::kLookedUp_bit;
      if (step.bits == 0) [[unlikely]] {
        bits.Fill();
        step = codes.Dc(bits.Look());
        if (step.bits == 0) return false;
        ready = 0;
      }
      bits.Skip(step.bits);
      dc_[mcu.block(b).component] += static_cast<std::uint32_t>(step.difference);
      if (step.left > 0) {
        if (!PassCoefficients(codes, step.left, bits)) return false;
        ready = 0;
      }
    }
    if (bits.RanOut()) return false;
  }
  bits_ = bits;
  return true;
}

template <class Bits>
bool McuScan<Bits>::Copy(int mcus, EntropyWriter& writer) {
  for (; mcus > 0; --mcus) {
    if (!PassRestartWhereDue()) return false;
    for (std::size_t b = 0; b < mcu_->count(); ++b) {
      const McuBlocks::Block& block = mcu_->block(b);
      bits_.Fill();
      const FirstStep dc = block.codes->Dc(bits_.Look());
      if (dc.bits == 0) return false;
      bits_.Skip(dc.bits);
      std::uint32_t& now = dc_[block.component];
      now += static_cast<std::uint32_t>(dc.difference);
      const std::uint32_t before = std::exchange(written_dc_[block.component], now);
      if (!writer.PutDc(static_cast<int>(now - before))) return false;
      if (!CopyCoefficients(*block.codes, bits_, writer)) return false;
    }
  }
  return !bits_.RanOut();
}

template class McuScan<EntropyBits>;
template class McuScan<EntropyDataBits>;

}  // namespace trammel::image
