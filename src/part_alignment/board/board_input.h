// Converts a measurement by a board to the adjustment's input, and checks its numbers.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/board/board_adjust.h"
#include "part_alignment/board/board_model.h"

namespace trammel::part_alignment {

/// Returns a view's name for messages: its picture, or its number.
[[nodiscard]] std::string NameOf(const BoardMeasurement& measurement, std::size_t view);

/// Checks numbers and names alone. Errors (kInput) name the view or mark, the value and the bound.
[[nodiscard]] Result<void> Validate(const BoardMeasurement& measurement,
                                    const BoardCalibrateOptions& options);

struct BoardPieces {
  BoardNetwork network;
  std::vector<std::string> ids;  ///< of the marks
  /// Index of each observation within its view.
  std::vector<std::size_t> index_in_view;
};

/// Converts each view to a station. Marks in fewer than three views and stations without
/// observations are not used. REQUIRES Validate.
[[nodiscard]] BoardPieces PiecesOf(const BoardMeasurement& measurement);

/// Drops marks of fewer than three used observations and stations of fewer than `kMinMarks`,
/// repeatedly until none is left.
inline constexpr int kMinMarksInView = 4;
void LeaveOutLonely(BoardNetwork& network);

struct BoardStated {
  std::vector<BoardNetwork::Touch> touches;
  std::optional<CameraPlacePrior> place;
};

/// Removes touches and stated place from the network.
[[nodiscard]] BoardStated TakeStated(BoardNetwork& network);
/// Puts touches and stated place back into the network.
void JoinStated(BoardStated stated, BoardNetwork& network);

/// Sources that determine the camera's position.
struct StatedPlace {
  bool turned = false;  ///< the spindle, between pictures
  bool touched_along = false;
  bool touched_across = false;
  bool prior = false;
  [[nodiscard]] bool along() const { return touched_along || prior; }
  [[nodiscard]] bool across() const { return turned || touched_across || prior; }
};
[[nodiscard]] StatedPlace ToldOf(const BoardNetwork& network);

/// Finds the unknowns that neither pictures nor touches nor stated place determine.
[[nodiscard]] HeldUnknowns HeldOf(const BoardNetwork& network, const StatedPlace& told);

/// Moves camera and marks together to fit the touches or the camera's stated place. No picture
/// shows this motion, and the adjustment would take many steps for it.
void PlaceByStated(const BoardNetwork& network, const StatedPlace& told, BoardState& state);

/// Explains why touches and stated position contradict each other: tests each against all else
/// (Baarda), then all together. Absent if chance explains it but for `false_alarm`.
[[nodiscard]] std::optional<std::string> StatedContradiction(const BoardPieces& pieces,
                                                             const BoardPrecision& precision,
                                                             double false_alarm);

/// Names parts of the camera's position that nothing checks, for the answer's head; empty: none.
[[nodiscard]] std::string UncheckedPlace(const BoardNetwork& network, const StatedPlace& told);

}  // namespace trammel::part_alignment
