// A part's targets from pictures by a camera in hand: photogrammetry with coded targets and scale
// bars.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/rejection.h"
#include "base/result.h"
#include "part_alignment/part_fit/scale_bars.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/survey/network.h"
#include "part_alignment/targets/image_ellipse.h"

namespace trammel::part_alignment {

/// The centre of something round and bright in a picture, with no code: of a plain target, a screw,
/// a reflection.
struct PlainPoint {
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;  ///< per axis, k = 1
  /// Its outline, where the point is the centre of an ellipse: perspective is then taken out.
  std::optional<ImageEllipse> disc = std::nullopt;
};

/// What one picture shows of coded targets, and of plain ones.
struct SurveyPicture {
  std::string name;
  int width_px = 0;
  int height_px = 0;
  std::vector<Observation> observations;  ///< each target once
  /// Images of the discs whose centres the observations are, one for each: perspective is then
  /// taken out. None: the observations are taken for the images of the centres themselves.
  std::vector<ImageEllipse> discs = {};
  /// In any order; one and the same has no name to be known by in another picture.
  std::vector<PlainPoint> plain = {};
};

struct SurveyInput {
  std::vector<SurveyPicture> pictures;  ///< in the order in which they were taken
  std::vector<ScaleBar> bars;
  /// Roughly, from EXIF or the lens: px. Absent: it is searched for from half the picture's longer
  /// side to three times that.
  std::optional<double> focal_length_px;
};

struct SurveyOptions {
  /// A target needs so many observations to be given, 3 or more: with two an error of one goes
  /// unnoticed.
  int least_observations = 3;
  /// And two lines of sight so far apart.
  double least_angle_rad = 0.26;  // 15 degrees
  /// Probability that data snooping leaves out anything of sound data.
  double false_alarm = 0.05;
  /// Observations that scatter by so many of their stated sigmas refuse the survey.
  double most_variance_root = 5;
  /// Of the random draws with which starting values are found.
  std::uint64_t seed = 1;
};

struct SurveyedTarget {
  std::string id;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();  ///< k = 1: the covariance's diagonal
  int observations = 0;
  double widest_angle_rad = 0;  ///< between two of its lines of sight, up to 90 degrees
  /// Unit vector towards the stations that see it, in the mean.
  Eigen::Vector3d seen_from = Eigen::Vector3d::UnitZ();
  double rms_px = 0;  ///< per axis
  /// The least share of an error that a residual of it would show, 0 … 1.
  double least_redundancy = 0;
  bool plain = false;  ///< found by its places in the pictures, not read
};

struct SurveyStation {
  std::string picture;
  bool used = false;
  std::string reason;        ///< why not
  bool contradicts = false;  ///< for that, not for want of targets
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d camera_from_survey = Eigen::Matrix3d::Identity();
  int observations = 0;
  double rms_px = 0;  ///< per axis
};

/// An observation that contradicts the others and was left out.
struct SurveyOutlier {
  std::string picture;
  std::string target;
  double error_px = 0;     ///< from where the others put it
  std::string seen_there;  ///< the target that the others put at its place; mostly none
};

struct SurveyedBar {
  ScaleBar bar;
  BarTest test;
};

/// What became of the plain points in the pictures that are used.
struct PlainSummary {
  bool refused = false;  ///< no plain target is given; the coded ones are
  std::string reason;    ///< why
  int points = 0;
  int used = 0;  ///< of targets that are given
  int targets = 0;
  double variance_root = 0;  ///< what they scatter by, in their stated sigmas; 0 without targets
  struct LeftOver {
    std::string reason;  ///< after "points that …"
    int points = 0;
    int pictures = 0;  ///< that show any of them
  };
  std::vector<LeftOver> left_over;  ///< most first
};

/// Targets, covariance, lens are meant only with verdict good.
struct Survey {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  std::vector<std::string> unchecked;  ///< that the answer rests on, whatever the verdict
  AdjustmentCheck check;
  /// By id: numbers ascending, then texts; then the plain ones, P1, P2, …, by x.
  std::vector<SurveyedTarget> targets;
  /// (3 · targets)², mm², k = 1: x, y, z of each target in turn; singular by six. Datum: free
  /// network, inner constraints over all targets; origin in their centroid, x along their largest
  /// extent, z along the least one and to the cameras' side. Scale: the bars, as observations.
  Eigen::MatrixXd covariance;
  std::vector<SurveyStation> stations;  ///< one for each picture
  std::vector<SurveyOutlier> outliers;
  std::vector<SurveyedBar> bars;
  Lens lens = Lens::Zero();
  Lens lens_sigma = Lens::Zero();  ///< k = 1
  /// What the observations scatter by, in their stated sigmas. The covariance has it in.
  double variance_root = 0;
  PlainSummary plain;
  std::vector<std::string> notices;
};

/// Starting values from codes alone; then a bundle adjustment of stations, targets and lens, free
/// of scale: outliers are found by data snooping (Baarda), one at a time in each picture and
/// target, so that no bar makes an observation wrong. The bars are tested against that shape
/// (scale_bars.h) and then join. A moved target, exchanged codes, a picture of something else, a
/// change of focal length and a bar that contradicts the others are told apart and named. Plain
/// targets are matched between the stations that the coded ones give (plain_matching.h), and all
/// are adjusted together. Verdicts other than good: pictures of different sizes, a focal length
/// that changed, bars that contradict one another, residuals beyond reason (refused); pictures that
/// do not hang together, more observations rejected than outliers can be (rejection.h), no bar
/// (cannot_tell). Errors (kInput): numbers that cannot be, a target twice in a picture, a bar
/// between a target and itself. Accuracy and cost: part_alignment_study.
[[nodiscard]] Result<Survey> SolveSurvey(const SurveyInput& input, const SurveyOptions& options);

}  // namespace trammel::part_alignment
