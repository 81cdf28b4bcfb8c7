// Code words of ring-coded targets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/result.h"

namespace trammel::part_alignment {

/// Words of 12, 14 or 20 bits, each written as the segments of a ring, bit 0 first, clockwise as
/// seen in front of the target. A ring has no start: a word represents all its rotations and is
/// named by the smallest of them.
///
/// Any two members, in every rotation (code_book_test proves it exhaustively):
/// - differ in at least 3 bits, so that neither one nor two wrong bits yield a member;
/// - remain distinct if up to HiddenBits() neighbouring bits of one are filled with equal values: a
/// ring of which a quarter is hidden, black or white, is never another target;
/// - are not mirror images of each other or of themselves: a mirrored picture shows no other
/// target;
/// and for each member: its own rotations differ in at least 4 bits (the ring's start is certain),
/// it has at least 3 bits of either value, and at least 4 changes of value around.
struct CodeBook {
  int bits = 0;
  std::vector<std::uint32_t> words;  ///< ascending; words[i] is the word of target number i + 1
};

/// Makes the code book: 16 members of 12 bits, 44 of 14, 1022 of 20, always the same. 20 bits cost
/// some 30 ms. Error: any other number of bits.
[[nodiscard]] Result<CodeBook> MakeCodeBook(int bits);

/// Returns the number of neighbouring bits that may be filled with one value: a quarter of the ring
/// and one more, as a hidden quarter need not start at a segment.
[[nodiscard]] constexpr int HiddenBits(int bits) { return (bits + 3) / 4 + 1; }

/// Returns the smallest rotation. REQUIRES 1 <= bits <= 31 and word < 2^bits.
[[nodiscard]] std::uint32_t CanonicalWord(int bits, std::uint32_t word);

/// Returns the word of the mirrored ring. REQUIRES as of CanonicalWord.
[[nodiscard]] std::uint32_t ReversedWord(int bits, std::uint32_t word);

/// Returns the number (from 1) of the target with this word in any rotation; absent if there is
/// none.
[[nodiscard]] std::optional<int> TargetNumber(const CodeBook& book, std::uint32_t word);

}  // namespace trammel::part_alignment
