// The words that square markers carry: the original ArUco dictionary.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/result.h"

namespace trammel::part_alignment {

/// A marker is a black square of 7 x 7 modules on white. Its outer modules are black; each row of
/// the 5 x 5 within is one of four words of 5 bits, which carry two bits of the id, the upper row
/// the highest (the dictionary of the ArUco library's first edition, OpenCV's DICT_ARUCO_ORIGINAL;
/// Garrido-Jurado et al., Pattern Recognition 47 (2014) 2280, compare their own dictionaries
/// with it). A word here has 25 bits, bit 5 · row + column, row 0 on top, 1 where it is white.
inline constexpr int kSquareCells = 5;
inline constexpr int kSquareModules = 7;
inline constexpr int kSquareIds = 1024;

/// REQUIRES 0 <= id < kSquareIds.
[[nodiscard]] std::uint32_t SquareWord(int id);

/// The word of the marker turned by 90 degrees clockwise.
[[nodiscard]] std::uint32_t QuarterTurned(std::uint32_t word);

/// The word of the marker's mirror image, left and right exchanged.
[[nodiscard]] std::uint32_t MirrorImage(std::uint32_t word);

/// Least number of bits in which two words differ, over the four rotations of one of them.
[[nodiscard]] int SquareDistance(std::uint32_t a, std::uint32_t b);

/// The markers of a job. Upright, any two of the dictionary differ in 3 bits or more; turned, 78
/// pairs differ in 1 or 2, and 1023 is its own half turn. So not every list of ids will do.
struct SquareBook {
  std::vector<int> ids;  ///< as stated
  std::vector<std::uint32_t> words;
};

/// Bits in which any two markers of a book differ, whatever their rotations: neither one wrong bit
/// nor two make another marker.
inline constexpr int kSquareLeastDistance = 3;

/// Errors (kInput), each with what to leave out: no ids, an id beyond 0 … 1023 or given twice, one
/// that looks the same after a turn, two that differ in fewer than kSquareLeastDistance bits.
[[nodiscard]] Result<SquareBook> MakeSquareBook(const std::vector<int>& ids);

/// Ids that go together, ascending and always the same: any two differ by kSquareLeastDistance bits
/// in every rotation and as mirror images, and so do a member and what it is when turned or
/// mirrored; none has fewer than 9 white or 9 black modules within.
/// Error: n outside 1 … the number there is, which the message names.
[[nodiscard]] Result<std::vector<int>> DefaultSquareIds(int n);

struct SquareReading {
  int id = 0;
  int quarter_turns = 0;  ///< clockwise, from upright to as it was read
};

/// The marker of the book that has exactly this word in a rotation; absent where none does.
[[nodiscard]] std::optional<SquareReading> ReadSquareWord(const SquareBook& book,
                                                          std::uint32_t word);

/// The id of the whole dictionary that has this word upright or turned; the smallest, where several
/// do.
[[nodiscard]] std::optional<int> AnySquareId(std::uint32_t word);

}  // namespace trammel::part_alignment
