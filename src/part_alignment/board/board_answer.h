// Final checks and answer of a board calibration: checks units, names null directions.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "part_alignment/board/board_adjust.h"
#include "part_alignment/board/board_input.h"

namespace trammel::part_alignment {

/// Adjustment with its inputs.
struct BoardWork {
  const BoardMeasurement* measurement = nullptr;
  BoardPieces pieces = {};
  StatedPlace told = {};
  HeldUnknowns held = {};
  BoardState state = {};
  DescentEnd fit = {};
  BoardPrecision precision = {};
  double pixel_factor = 1;          ///< sigmas of the observations over those stated
  std::vector<bool> rejected = {};  ///< observations that contradict the others
  double depth_mm = 0;              ///< range of spindle heights
  bool shallow = false;             ///< these are nearly alike
  double disc_radius_mm = 0;        ///< as seen in the pictures; 0: unknown
};

/// Compares the sheet to its layout: two scales of an affine map. Absent if no layout is known.
[[nodiscard]] std::optional<PrintResult> PrintOf(const BoardWork& work);

/// True if the sheet or the lens shows that a unit is wrong; the result then reports it. Needs the
/// result's `print`.
[[nodiscard]] bool RefuseUnits(const BoardWork& work, BoardCalibration& result);

/// Fills in the verdict and the rest of the result. REQUIRES that the result has the views'
/// reasons, the sheet and the covariance.
void AnswerOf(const BoardWork& work, const BoardCalibrateOptions& options,
              BoardCalibration& result);

/// Computes the pixel of each observation: the image of its disc's centre, by the current camera,
/// paper and place. Observations without a disc are unchanged.
[[nodiscard]] std::vector<Eigen::Vector2d> CorrectedCentres(const BoardWork& work);

/// Computes the discs' radius from their images, as a median; 0 if there are no discs.
[[nodiscard]] double DiscRadius(const BoardWork& work);

}  // namespace trammel::part_alignment
