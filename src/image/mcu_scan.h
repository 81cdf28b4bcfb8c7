// MCUs of a JPEG's entropy-coded data, gone past or copied one after the other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "image/entropy_bits.h"
#include "image/entropy_data.h"
#include "image/entropy_writer.h"
#include "image/huffman_codes.h"
#include "image/jpeg_head.h"

namespace trammel::image {

/// The blocks of an MCU.
class McuBlocks {
 public:
  struct Block {
    const BlockCodes* codes = nullptr;
    std::size_t component = 0;
  };
  /// An MCU of flat blocks (BlockCodes::Flat()), as it stands in the bits that are ready.
  struct Flat {
    std::uint64_t code = 1;  ///< none of whose bits the mask has: there is no such MCU
    std::uint64_t mask = 0;
    int count = 0;

    [[nodiscard]] bool IsNext(std::uint64_t bits) const { return (bits & mask) == code; }
  };

  void Clear();
  /// Adds one; false where an MCU has no more.
  [[nodiscard]] bool Add(const Block& block);

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const Block& block(std::size_t i) const { return blocks_[i]; }
  [[nodiscard]] const Flat& flat() const { return flat_; }
  /// Joins the blocks' flat codes, unless they are more than is ready at a time.
  void MakeFlat();

 private:
  std::array<Block, kMostMcuBlocks> blocks_;
  std::size_t count_ = 0;
  Flat flat_;
};

/// The DC coefficients of the blocks before, per component. Sums of hostile data go round.
using DcLevels = std::array<std::uint32_t, kMostColours>;

/// Goes from MCU to MCU. Bits: EntropyBits, of a file, or EntropyDataBits.
template <class Bits>
class McuScan {
 public:
  /// REQUIRES that the blocks outlive it. @param restart_mcus  between two markers; 0: there is
  /// none.
  McuScan(const McuBlocks& mcu, const Bits& bits, int restart_mcus);

  /// Goes past so many MCUs; false where there are not so many.
  [[nodiscard]] bool Pass(int mcus);

  /// As Pass(), of the last MCUs.
  [[nodiscard]] bool PassLast(int mcus) { return Pass(mcus); }

  /// Copies so many MCUs, whose DC coefficients follow what was written before; false likewise.
  [[nodiscard]] bool Copy(int mcus, EntropyWriter& writer);

  [[nodiscard]] const Bits& bits() const { return bits_; }

  /// Goes on elsewhere, where another has passed these sums of DC differences.
  void GoOn(const Bits& bits, const DcLevels& dc_past);

 private:
  [[nodiscard]] bool PassRestartWhereDue();

  const McuBlocks* mcu_;
  Bits bits_;
  int restart_mcus_;
  int until_restart_;
  int restarts_ = 0;
  DcLevels dc_{};
  DcLevels written_dc_{};
};

extern template class McuScan<EntropyBits>;
extern template class McuScan<EntropyDataBits>;

}  // namespace trammel::image
