// A way past the blocks of a JPEG's entropy-coded data: lengths are read, coefficients are not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "image/entropy_data.h"
#include "image/huffman_codes.h"

namespace trammel::image {

/// A place in entropy-coded data, and how many blocks were passed on the way there.
struct BlockPlace {
  std::size_t at_bit = 0;
  std::size_t blocks = 0;          ///< passed, without those of the present round
  std::uint32_t block = 0;         ///< of the present round: BlockWalker's list, over and over
  std::uint32_t coefficients = 0;  ///< of this block, passed
  std::uint32_t table = 0;         ///< BlockWalker's, by which it goes on

  [[nodiscard]] std::size_t passed() const { return blocks + block; }
  [[nodiscard]] bool between_blocks() const { return coefficients == 0; }
};

struct BlockWalk : BlockPlace {
  /// Sums of the DC coefficients' differences, by `block`. Those of a next round stand behind.
  std::array<std::uint32_t, 2 * kMostMcuBlocks> dc{};

  [[nodiscard]] const BlockPlace& place() const { return *this; }
  void SetPlace(const BlockPlace& place) { static_cast<BlockPlace&>(*this) = place; }
};

/// Passes over blocks at two places, several codes at a look-up and without a branch for what they
/// are. Each look-up waits for the one before it; the other walk fills the wait.
class BlockWalker {
 public:
  static constexpr std::size_t kCodes = 4;  // each pair of a DC and an AC table

  /// Makes the tables of codes. REQUIRES that the codes stay while walks go past them.
  void SetCodes(std::size_t number, const BlockCodes& codes);

  /// Sets the blocks of an MCU by the numbers of their codes. REQUIRES 1 … kMostMcuBlocks.
  void SetMcu(std::span<const std::size_t> codes);

  [[nodiscard]] BlockWalk Begin(std::size_t at_bit) const;

  /// How far a walk goes: to no more than so many blocks passed(), and no look-ups from a place on.
  struct End {
    std::size_t blocks = std::numeric_limits<std::size_t>::max();
    std::size_t at_bit = std::numeric_limits<std::size_t>::max();
  };

  /// Goes on with both until one of them is near its end: `walk` that given, or either that of the
  /// data. @returns false where `walk` meets no code.
  [[nodiscard]] bool PassTogether(const End& end, const EntropyData& data, BlockWalk& walk,
                                  BlockWalk& beside) const;

  /// Passes one code. False where there is none, or where the block has fewer coefficients.
  [[nodiscard]] bool PassCode(const EntropyData& data, BlockWalk& walk) const;

 private:
  void EndBlock(BlockWalk& walk) const;
  [[nodiscard]] bool PassSlowly(std::size_t blocks, const EntropyData& data, BlockWalk& walk) const;

  std::array<const BlockCodes*, kCodes> codes_{};
  std::vector<std::uint32_t> steps_;                        // three tables for each of the codes
  std::uint32_t round_ = 0;                                 // blocks of the list that is gone round
  std::array<std::uint32_t, 2 * kMostMcuBlocks> tables_{};  // of its blocks, and of the next ones
};

}  // namespace trammel::image
