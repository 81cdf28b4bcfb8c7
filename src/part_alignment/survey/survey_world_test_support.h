// A photographed part for the tests of surveys: no code is shared with what they judge.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "base/page.h"
#include "base/random.h"
#include "part_alignment/survey/survey.h"
#include "part_alignment/targets/code_book.h"

namespace trammel::part_alignment::test {

/// A block of 2 x 1.2 x 0.4 m with codes on top and sides, two bars of 1 m beside it.
struct SurveyScene {
  int codes = 60;
  double apart_mm = 0;  ///< no two codes are nearer than that
  int pictures = 100;
  int width_px = 4000;
  int height_px = 3000;
  double focal_px = 2773;  ///< 24 mm on 36 mm
  /// Distortion of the true lens, r in units of the focal length.
  double k1 = -0.09;
  double k2 = 0.03;
  double k3 = -0.004;
  double p1 = 3e-4;
  double p2 = -2e-4;
  double column_off_px = 14.2;  ///< principal point from the picture's middle
  double row_off_px = -9.7;
  double distance_mm = 2500;
  double sigma_px = 0.03;
  double hidden = 0.1;  ///< share of observations that something covers
  double bar_sigma_mm = 0.01;
  bool rolled = true;                     ///< a quarter turn in every other picture
  bool flat = false;                      ///< all codes on top, no depth at all
  double steepest_incidence_rad = 1.134;  // 65 degrees
  int plain = 0;                          ///< plain targets, scattered over all faces
  int rows = 0;                           ///< rows of plain targets along the top besides
  int row_length = 20;
  double stray = 0;  ///< points a picture that are nothing, in the mean
};

struct WorldTarget {
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

struct WorldShot {
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d down = Eigen::Vector3d::UnitY();
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
  double focal_px = 0;
  std::map<std::string, Eigen::Vector3d> displaced_mm;  ///< targets that stood elsewhere then
};

struct SurveyWorld {
  SurveyScene scene;
  std::map<std::string, WorldTarget> targets;
  std::vector<WorldShot> shots;
  std::vector<ScaleBar> bars;  ///< as calibrated: true length plus an error of bar_sigma_mm
  std::vector<WorldTarget> plain;
  /// Plain targets that stood elsewhere from some shot on: index, shot, by how much.
  struct PlainMotion {
    std::size_t target = 0;
    std::size_t first_after = 0;
    Eigen::Vector3d by_mm = Eigen::Vector3d::Zero();
  };
  std::vector<PlainMotion> moved;
};

[[nodiscard]] SurveyWorld MakeSurveyWorld(const SurveyScene& scene, std::uint64_t seed);

/// Simulates pictures with noise of the scene's sigma, drawn anew for each seed.
[[nodiscard]] SurveyInput Photograph(const SurveyWorld& world, std::uint64_t seed);

/// The plain target of the world nearest to each of the survey's plain ones: index and distance,
/// the datum fitted to the coded ones.
struct PlainNearest {
  std::string id;
  std::size_t target = 0;
  double off_mm = 0;
};
[[nodiscard]] std::vector<PlainNearest> NearestPlain(const SurveyWorld& world,
                                                     const Survey& survey);

/// Errors of a survey's coded targets, the datum fitted (rotation and translation, no scale): mm.
struct SurveyErrors {
  Eigen::VectorXd coordinates;  ///< survey's own axes, like its covariance
  Eigen::MatrixXd true_mm;      ///< 3 × targets, moved into the survey's frame
  /// Squared error normalised by the stated covariance, over the directions that the datum leaves:
  /// chi-square of `freedom` degrees where the covariance tells the truth.
  double nees = 0;
  int freedom = 0;  ///< 3 · targets - 6
};
[[nodiscard]] SurveyErrors ErrorsOf(const SurveyWorld& world, const Survey& survey);

/// The targets that a shot sees, discs of 13 mm, through a lens that bends nothing; noise of one
/// grey level. Numbers must be those of `book`.
[[nodiscard]] Page PictureOf(const SurveyWorld& world, const WorldShot& shot, const CodeBook& book,
                             Random& random);

/// Gives the ends of the bars numbers from `first` on, which the book has.
void NumberBarEnds(SurveyWorld& world, int first);

}  // namespace trammel::part_alignment::test
