// The words that ring-coded targets carry.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/result.h"

namespace trammel::part_alignment {

/// Words of 12, 14 or 20 bits, each written as the segments of a ring, bit 0 first, clockwise as
/// one looks at the target. A ring has no beginning: a word stands for all its rotations and is
/// named by the smallest of them.
///
/// What holds for any two members, in every rotation (code_book_test proves it exhaustively):
/// - they differ in at least 3 bits, so that one wrong bit is no member, nor are two;
/// - filling up to HiddenBits() neighbouring bits of one with equal values does not give the other:
///   a ring of which a quarter is hidden, black or white, is never another target;
/// - neither is the other, nor itself, in a mirror: a picture that was mirrored is no other target;
/// and for each member: its own rotations differ in at least 4 bits (where the ring starts is
/// certain), it has at least 3 bits of either value, and at least 4 changes of value around.
struct CodeBook {
  int bits = 0;
  std::vector<std::uint32_t> words;  ///< ascending; words[i] is the word of target number i + 1
};

/// 16 members of 12 bits, 44 of 14, 1022 of 20: always the same ones. 20 bits cost some 30 ms.
/// Error: any other number of bits.
[[nodiscard]] Result<CodeBook> MakeCodeBook(int bits);

/// Neighbouring bits that may be filled with one value: a quarter of the ring and one more, as a
/// hidden quarter need not begin with a segment.
[[nodiscard]] constexpr int HiddenBits(int bits) { return (bits + 3) / 4 + 1; }

/// The smallest rotation. REQUIRES 1 <= bits <= 31 and word < 2^bits.
[[nodiscard]] std::uint32_t CanonicalWord(int bits, std::uint32_t word);

/// The word as its ring runs in a mirror. REQUIRES as of CanonicalWord.
[[nodiscard]] std::uint32_t ReversedWord(int bits, std::uint32_t word);

/// The number (from 1) of the target that carries the word in any rotation; absent where none does.
[[nodiscard]] std::optional<int> TargetNumber(const CodeBook& book, std::uint32_t word);

}  // namespace trammel::part_alignment
