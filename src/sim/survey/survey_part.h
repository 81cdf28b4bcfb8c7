// Block with plane sides and a freeform top, known exactly.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace trammel::sim {

/// Gaussian hill of the top.
struct BlockHill {
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();
  double height_mm = 0;
  double width_mm = 100;  ///< 1 sigma
};

/// Origin in the centre of the top's plane, from which the hills rise; sides at +-half, down to
/// -depth.
struct FreeformBlock {
  double half_length_mm = 1000;
  double half_width_mm = 600;
  double depth_mm = 400;
  std::vector<BlockHill> hills;
};

/// Draws a block with seven hills, broad and steep ones, up to 120 mm high.
[[nodiscard]] FreeformBlock DrawBlock(std::uint64_t seed);

[[nodiscard]] double TopAt(const FreeformBlock& block, double x_mm, double y_mm);
[[nodiscard]] Eigen::Vector3d TopPoint(const FreeformBlock& block, double x_mm, double y_mm);
/// Returns the outward unit normal, from the exact derivatives.
[[nodiscard]] Eigen::Vector3d TopNormal(const FreeformBlock& block, double x_mm, double y_mm);

/// True if the straight line from a place on the surface to a camera passes outside of the block;
/// sampled every 8 mm. Hills that hide less than that are ignored.
[[nodiscard]] bool IsOpenTo(const FreeformBlock& block, const Eigen::Vector3d& at_mm,
                            const Eigen::Vector3d& eye_mm);

/// The defaults are a 24 mm lens on 36 mm of sensor. Its distortion maps pin-hole points to the
/// lens's points; r in units of the focal length.
struct HandLens {
  int width_px = 4000;
  int height_px = 3000;
  double focal_px = 2773;
  double column_off_px = 14.2;  ///< principal point from the picture's middle
  double row_off_px = -9.7;
  double k1 = -0.09;
  double k2 = 0.03;
  double p1 = 3e-4;
  double p2 = -2e-4;
};

/// Axes of length 1, right-handed.
struct HandShot {
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d down = Eigen::Vector3d::UnitY();
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
};

struct HandWalk {
  int pictures = 100;
  double distance_mm = 2500;  ///< +-10 %
  double lowest_rad = 0.087;  ///< elevation: 5 degrees
  double highest_rad = 1.222;
  bool rolled = true;  ///< a quarter turn in every other picture
};

/// Returns views around the origin, by the golden angle, each aimed at a position of the part.
[[nodiscard]] std::vector<HandShot> WalkAround(const HandWalk& walk, std::uint64_t seed);

/// Returns column and row, (0, 0) the centre of the first pixel. Absent behind the camera, more
/// than 50 degrees off its axis, and within `margin_px` of the picture's edge or outside of it.
[[nodiscard]] std::optional<Eigen::Vector2d> SeenAt(const HandLens& lens, const HandShot& shot,
                                                    const Eigen::Vector3d& at_mm, double margin_px);

/// Image of a round disc: centroid of its area, and the ellipse of its second moments.
struct DiscImage {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double major_px = 0;  ///< semi-axes
  double minor_px = 0;
  double angle_rad = 0;  ///< columns to major axis, towards the rows
};
/// Projects its outline point by point. Absent if some of it is hidden.
[[nodiscard]] std::optional<DiscImage> DiscSeenAt(const HandLens& lens, const HandShot& shot,
                                                  const Eigen::Vector3d& at_mm,
                                                  const Eigen::Vector3d& normal, double radius_mm,
                                                  double margin_px);

/// Round disc on the surface.
struct SurveyMark {
  int code = 0;  ///< 0: a plain one
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double radius_mm = 1.5;
};

/// Polished dome that reflects the lamps.
struct SurveyScrew {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< sphere centre
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

/// Scale bar, calibrated between two coded marks.
struct SurveyBar {
  int from = 0;
  int to = 0;
  double length_mm = 0;
  double sigma_mm = 0.01;  ///< error of `length_mm`, 1 sigma
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

/// Finds the top's reflections of a lamp towards a camera, each once: from a net of starts, so that
/// one amid small hills may be missing.
[[nodiscard]] std::vector<Eigen::Vector3d> GlintsOf(const FreeformBlock& block,
                                                    const Eigen::Vector3d& lamp_mm,
                                                    const Eigen::Vector3d& eye_mm);

/// Returns the reflection point on a screw's sphere.
[[nodiscard]] Eigen::Vector3d GlintOf(const SurveyScrew& screw, const Eigen::Vector3d& lamp_mm,
                                      const Eigen::Vector3d& eye_mm);

}  // namespace trammel::sim
