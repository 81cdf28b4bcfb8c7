// A measurement by a board as the adjustment takes it, and what is wrong with its numbers.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/board/board_adjust.h"
#include "part_alignment/board/board_model.h"

namespace trammel::part_alignment {

/// A view as messages name it: its picture, or its number.
[[nodiscard]] std::string NameOf(const BoardMeasurement& measurement, std::size_t view);

/// Numbers and names alone. Errors (kInput) name the view or mark, the value and the bound.
[[nodiscard]] Result<void> Validate(const BoardMeasurement& measurement,
                                    const BoardCalibrateOptions& options);

struct BoardPieces {
  BoardNetwork network;
  std::vector<std::string> ids;  ///< of the marks
  /// The observation of each observation within its view.
  std::vector<std::size_t> index_in_view;
};

/// Every view is a station, every observation a observation. Observations of marks that fewer than
/// three views show, and stations without any, are not used. REQUIRES Validate.
[[nodiscard]] BoardPieces PiecesOf(const BoardMeasurement& measurement);

/// Leaves out marks of fewer than three used observations and stations of fewer than `kLeastMarks`,
/// over and over.
inline constexpr int kLeastMarksInView = 4;
void LeaveOutLonely(BoardNetwork& network);

struct BoardStated {
  std::vector<BoardNetwork::Touch> touches;
  std::optional<CameraPlacePrior> place;
};

/// Takes them out of the network.
[[nodiscard]] BoardStated TakeStated(BoardNetwork& network);
/// Gives them back.
void JoinStated(BoardStated stated, BoardNetwork& network);

/// What tells the camera's place.
struct PlaceTold {
  bool turned = false;  ///< the spindle, between pictures
  bool touched_along = false;
  bool touched_across = false;
  bool prior = false;
  [[nodiscard]] bool along() const { return touched_along || prior; }
  [[nodiscard]] bool across() const { return turned || touched_across || prior; }
};
[[nodiscard]] PlaceTold ToldOf(const BoardNetwork& network);

/// Unknowns that neither pictures nor what joined the network tell.
[[nodiscard]] HeldUnknowns HeldOf(const BoardNetwork& network, const PlaceTold& told);

/// Moves camera and marks together, which no picture notices, to where touches or what is stated of
/// the camera's place put them: the adjustment would take many steps for it.
void PlaceByTold(const BoardNetwork& network, const PlaceTold& told, BoardState& state);

/// Why touches and stated place cannot all be right: each is tested against all else (Baarda), and
/// all of them together. Absent where chance explains it but for `false_alarm`.
[[nodiscard]] std::optional<std::string> StatedContradiction(const BoardPieces& pieces,
                                                             const BoardPrecision& precision,
                                                             double false_alarm);

/// What of the camera's place nothing checks, for the head of the answer; empty: nothing.
[[nodiscard]] std::string UncheckedPlace(const BoardNetwork& network, const PlaceTold& told);

}  // namespace trammel::part_alignment
