// Huffman tables of a baseline JPEG, made ready for going past what they code.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace trammel::image {

/// Of a block, in the order in which they are coded; the first is DC, the others are AC.
inline constexpr int kCoefficients = 64;

/// Blocks of an MCU, at most, as the format has it.
inline constexpr std::size_t kMostMcuBlocks = 10;

/// A table as it stands in the file.
struct HuffmanTable {
  std::array<std::uint8_t, 16> counts{};  ///< of codes of 1 … 16 bits
  std::array<std::uint8_t, 256> symbols{};

  friend bool operator==(const HuffmanTable&, const HuffmanTable&) = default;
};

/// Bits that follow each other, right-aligned.
struct BitString {
  std::uint64_t bits = 0;
  int count = 0;
};

/// Finds symbols by their codes.
class HuffmanTree {
 public:
  struct Symbol {
    int value = 0;
    int bits = 0;  ///< of its code; 0: there is none
  };
  /// False where the counts are of no table, or a symbol is larger than it may be.
  [[nodiscard]] bool Make(const HuffmanTable& table, int most_symbol);
  /// The symbol that bits begin with, the first of them highest.
  [[nodiscard]] Symbol Find(std::uint64_t bits) const;
  /// The code of a symbol; of no bits where it has none.
  [[nodiscard]] BitString CodeOf(int symbol) const;

 private:
  std::array<std::uint8_t, 256> symbols_{};
  std::array<std::uint32_t, 16> end_{};       // one past the last code of each length
  std::array<std::int32_t, 16> to_symbol_{};  // from a code of each length to its symbol's place
};

/// Bits to go past, and the AC coefficients that they code. Packed, so that a table of them stays
/// in the nearest cache.
class AcStep {
 public:
  AcStep() = default;  ///< none
  AcStep(int bits, int count, bool ends)
      : packed_(static_cast<std::uint16_t>(bits | (ends ? count | kEnds : count) << kWeight_bit)) {}

  [[nodiscard]] bool found() const { return weight() != kNone; }
  [[nodiscard]] int bits() const { return packed_ & 63; }  // as shifts take it
  /// Coefficients, the end of the block counting as one.
  [[nodiscard]] int count() const { return weight() & (kEnds - 1); }
  [[nodiscard]] bool ends() const { return weight() >= kEnds; }  ///< the block
  /// As count(); more than a block has where the block ends, or where there is none.
  [[nodiscard]] int weight() const { return packed_ >> kWeight_bit; }

 private:
  static constexpr int kWeight_bit = 6;
  static constexpr int kNone = 127;
  static constexpr int kEnds = 128;
  std::uint16_t packed_ = kNone << kWeight_bit;
};

/// The first bits of a block: its DC coefficient, and what follows it in the same look-up.
struct FirstStep {
  std::uint8_t bits = 0;        ///< to go past; 0: there is none
  std::uint8_t left = 0;        ///< AC coefficients still to come
  std::int16_t difference = 0;  ///< of the DC coefficient from that of the block before
};

/// The codes of a block's coefficients. Whatever baseline JPEGs of 8 bits do not have is no code.
class BlockCodes {
 public:
  static constexpr int kLookedUp_bit = 13;  ///< at a time

  /// False where one of them is no table.
  [[nodiscard]] bool Make(const HuffmanTable& dc, const HuffmanTable& ac);

  /// The DC coefficient alone, of 27 bits at most.
  [[nodiscard]] FirstStep Dc(std::uint64_t bits) const;

  /// The DC coefficient and as many AC coefficients as the looked-up bits hold whole, or none.
  [[nodiscard]] FirstStep First(std::uint64_t bits) const { return first_[Index(bits)]; }

  /// One code for AC coefficients, of 31 bits at most.
  [[nodiscard]] AcStep Ac(std::uint64_t bits) const {
    const AcStep step = one_[Index(bits)];
    return step.found() ? step : SearchAc(bits);
  }

  /// Bits of the code itself, which say how many Ac() is of; 0: there is none.
  [[nodiscard]] int AcCodeBits(std::uint64_t bits) const { return ac_.Find(bits).bits; }

  /// As many codes as the looked-up bits hold whole, or none. Where they are of more coefficients
  /// than a block has left, its end lies between them.
  [[nodiscard]] AcStep Several(std::uint64_t bits) const { return several_[Index(bits)]; }

  /// A block as bright as the one before it and without any AC coefficient: what most of a dark
  /// picture is made of. Of no bits where the tables cannot say so.
  [[nodiscard]] BitString Flat() const;

 private:
  static constexpr std::size_t kSize = std::size_t{1} << kLookedUp_bit;
  [[nodiscard]] static std::size_t Index(std::uint64_t bits) {
    return static_cast<std::size_t>(bits >> (64 - kLookedUp_bit));
  }
  [[nodiscard]] AcStep SearchAc(std::uint64_t bits) const;
  [[nodiscard]] AcStep MakeSeveral(std::uint64_t bits) const;
  [[nodiscard]] FirstStep MakeFirst(std::uint64_t bits) const;

  HuffmanTree dc_;
  HuffmanTree ac_;
  std::array<FirstStep, kSize> first_{};
  std::array<AcStep, kSize> several_{};
  std::array<AcStep, kSize> one_{};
};

}  // namespace trammel::image
