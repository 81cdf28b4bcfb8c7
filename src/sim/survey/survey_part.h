// A block with coded and plain targets, screws, and lamps above it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sim/survey/freeform_block.h"
#include "sim/survey/hand_camera.h"

namespace trammel::sim {

/// A round disc on the surface.
struct SurveyMark {
  int code = 0;  ///< 0: a plain one
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double radius_mm = 1.5;
};

/// A polished dome that shows the lamps.
struct SurveyScrew {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< of its sphere
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double radius_mm = 3;
};

struct SurveyPartTraits {
  int coded = 60;   ///< a third of them on top
  int plain = 300;  ///< all of the following among them, the rest anywhere on top and sides
  int grid_columns = 10;
  int grid_rows = 8;
  double grid_pitch_mm = 40;
  int rows = 4;  ///< each where a plane through two cameras meets the top
  int in_row = 12;
  double row_pitch_mm = 45;
  int pairs = 20;
  double nearest_pair_mm = 4;  ///< between the centres of a pair
  double widest_pair_mm = 8;
  double coded_radius_mm = 5;
  double plain_radius_mm = 1.5;
  int screws = 15;
  int lamps = 3;
};

/// Calibrated between two coded marks.
struct SurveyBar {
  int from = 0;
  int to = 0;
  double length_mm = 0;
  double sigma_mm = 0.01;  ///< what `length_mm` is off by, 1 sigma
};

struct SurveyPart {
  FreeformBlock block;
  std::vector<SurveyMark> marks;  ///< coded ones first, with those of the bars: 901 … 904
  std::vector<SurveyScrew> screws;
  std::vector<Eigen::Vector3d> lamps_mm;
  std::vector<SurveyBar> bars;
};

/// @param shots  whose epipolar planes the rows lie in; two or more
/// REQUIRES plain >= grid_columns · grid_rows + rows · in_row + 2 · pairs.
[[nodiscard]] SurveyPart DrawSurveyPart(const SurveyPartTraits& traits,
                                        const std::vector<HandShot>& shots, std::uint64_t seed);

/// Where a lamp is mirrored by the top towards an eye, each place once: found from a net of starts,
/// so that a place amid small hills may be missing.
[[nodiscard]] std::vector<Eigen::Vector3d> GlintsOf(const FreeformBlock& block,
                                                    const Eigen::Vector3d& lamp_mm,
                                                    const Eigen::Vector3d& eye_mm);

/// The same on a screw's sphere.
[[nodiscard]] Eigen::Vector3d GlintOf(const SurveyScrew& screw, const Eigen::Vector3d& lamp_mm,
                                      const Eigen::Vector3d& eye_mm);

}  // namespace trammel::sim
