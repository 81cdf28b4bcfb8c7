// What a calibration by a board says in the end: units checked, null directions named.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "part_alignment/board/board_adjust.h"
#include "part_alignment/board/board_input.h"

namespace trammel::part_alignment {

/// An adjustment with what it works on.
struct BoardWork {
  const BoardMeasurement* measurement = nullptr;
  BoardPieces pieces = {};
  PlaceTold told = {};
  HeldUnknowns held = {};
  BoardState state = {};
  DescentEnd fit = {};
  BoardPrecision precision = {};
  double pixel_factor = 1;          ///< sigmas of the observations over those stated
  std::vector<bool> rejected = {};  ///< observations that contradict the others
  double depth_mm = 0;              ///< of the spindle's heights
  bool shallow = false;             ///< these are nearly alike
  double disc_radius_mm = 0;        ///< as the pictures show it; 0: no disc is known
};

/// The sheet against its layout: two scales of an affine map; absent where no layout is known.
[[nodiscard]] std::optional<PrintResult> PrintOf(const BoardWork& work);

/// True where the sheet or the lens says that a unit is wrong: then the result says so. Needs the
/// result's `print`.
[[nodiscard]] bool RefuseUnits(const BoardWork& work, BoardCalibration& result);

/// Verdict and everything of the result but views' reasons, the sheet and the covariance, which it
/// has.
void AnswerOf(const BoardWork& work, const BoardCalibrateOptions& options,
              BoardCalibration& result);

/// The pixel of each observation: the image of its disc's centre, by camera, paper and place as
/// they are. Observations without a disc keep theirs.
[[nodiscard]] std::vector<Eigen::Vector2d> CorrectedCentres(const BoardWork& work);

/// The discs' radius by their images, the median; 0 where there is none.
[[nodiscard]] double DiscRadius(const BoardWork& work);

}  // namespace trammel::part_alignment
