// What a calibration by a board says in the end: units checked, null directions named.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "part_alignment/board/board_adjust.h"
#include "part_alignment/board/board_input.h"

namespace trammel::part_alignment {

struct BoardAnswerInput {
  const BoardMeasurement& measurement;
  const BoardPieces& pieces;
  const BoardState& state;
  const BoardPrecision& precision;
  double pixel_factor = 1;          ///< sigmas of the sights over those stated
  std::vector<bool> rejected = {};  ///< sights that contradict the others
  bool turned = false;              ///< the spindle, between pictures
  bool touched_along = false;
  bool touched_across = false;
  double depth_mm = 0;        ///< of the spindle's heights
  double disc_radius_mm = 0;  ///< as the pictures show it; 0: no disc is known
};

/// The sheet against its layout: two scales of an affine map; absent where no layout is known.
[[nodiscard]] std::optional<PrintResult> PrintOf(const BoardAnswerInput& input);

/// True where the sheet or the lens says that a unit is wrong: then the result says so. Needs the
/// result's `print`.
[[nodiscard]] bool RefuseUnits(const BoardAnswerInput& input, BoardCalibration& result);

/// Verdict and everything of the result but views' reasons, the sheet and the covariance, which it
/// has.
void AnswerOf(const BoardAnswerInput& input, const BoardCalibrateOptions& options,
              BoardCalibration& result);

/// The pixel of each sight: the image of its disc's centre, by camera, paper and place as they are.
/// Sights without a disc keep theirs.
[[nodiscard]] std::vector<Eigen::Vector2d> CorrectedCentres(const BoardMeasurement& measurement,
                                                            const BoardPieces& pieces,
                                                            const BoardState& state,
                                                            double radius_mm);

/// The discs' radius by their images, the median; 0 where there is none.
[[nodiscard]] double DiscRadius(const BoardMeasurement& measurement, const BoardPieces& pieces,
                                const BoardState& state);

}  // namespace trammel::part_alignment
