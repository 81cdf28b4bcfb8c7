// A measurement by a board as the adjustment takes it, and what is wrong with its numbers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/board/board_model.h"

namespace trammel::part_alignment {

/// Numbers and names alone. Errors (kInput) name the view or mark, the value and the bound.
[[nodiscard]] Result<void> Validate(const BoardMeasurement& measurement,
                                    const BoardCalibrateOptions& options);

struct BoardPieces {
  BoardNetwork network;
  std::vector<std::string> ids;  ///< of the marks
  /// The observation of each sight within its view.
  std::vector<std::size_t> observation_of_sight;
};

/// Every view is a stop, every observation a sight. Sights of marks that fewer than three views
/// show, and stops without any, are not used. REQUIRES Validate.
[[nodiscard]] BoardPieces PiecesOf(const BoardMeasurement& measurement);

/// Leaves out marks of fewer than three used sights and stops of fewer than `kLeastMarks`, over and
/// over.
inline constexpr int kLeastMarksInView = 4;
void LeaveOutLonely(BoardNetwork& network);

}  // namespace trammel::part_alignment
