// Measures a part's targets from pictures by a hand-held camera: photogrammetry with coded targets
// and scale bars.
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

/// Centre of a round bright spot without a code: a plain target, a screw, a reflection.
struct PlainPoint {
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;  ///< per axis, k = 1
  /// Outline, if the point is the centre of an ellipse: enables the correction for perspective.
  std::optional<ImageEllipse> disc = std::nullopt;
};

/// Coded and plain targets in one picture.
struct SurveyPicture {
  std::string name;
  int width_px = 0;
  int height_px = 0;
  std::vector<Observation> observations;  ///< each target once
  /// Images of the discs whose centres the observations are, one for each: perspective is then
  /// corrected. None: the observations are the images of the centres themselves.
  std::vector<ImageEllipse> discs = {};
  /// Plain points in any order; no name identifies one in another picture.
  std::vector<PlainPoint> plain = {};
};

struct SurveyInput {
  std::vector<SurveyPicture> pictures;  ///< in the order taken
  std::vector<ScaleBar> bars;
  /// Approximate focal length, from EXIF or the lens: px. Absent: searched for from half the
  /// picture's longer side to three times that.
  std::optional<double> focal_length_px;
};

struct SurveyOptions {
  /// Minimum number of observations of a reported target, 3 or more: with two, an error of one is
  /// not detected.
  int min_observations = 3;
  /// Minimum angle between two of its lines of sight.
  double min_angle_rad = 0.26;  // 15 degrees
  /// Probability that data snooping rejects an observation of sound data.
  double false_alarm = 0.05;
  /// Upper limit of the observations' scatter, in stated sigmas; beyond it the survey is refused.
  double max_variance_root = 5;
  /// Seed of the random draws for starting values.
  std::uint64_t seed = 1;
};

struct SurveyedTarget {
  std::string id;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();  ///< k = 1: the covariance's diagonal
  int observations = 0;
  double widest_angle_rad = 0;  ///< between two of its lines of sight, up to 90 degrees
  /// Mean unit vector towards the stations that see it.
  Eigen::Vector3d seen_from = Eigen::Vector3d::UnitZ();
  double rms_px = 0;  ///< per axis
  /// Minimum share of an error that its residual would show, 0 … 1.
  double min_redundancy = 0;
  bool plain = false;  ///< found by its places in the pictures, not read
};

struct SurveyStation {
  std::string picture;
  bool used = false;
  std::string reason;        ///< why not used
  bool contradicts = false;  ///< true if contradictory, not short of targets
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d camera_from_survey = Eigen::Matrix3d::Identity();
  int observations = 0;
  double rms_px = 0;  ///< per axis
};

/// Observation that was rejected because it contradicts the others.
struct SurveyOutlier {
  std::string picture;
  std::string target;
  double error_px = 0;     ///< from the place by the others
  std::string seen_there;  ///< the target that the others put at its place; mostly none
};

struct SurveyedBar {
  ScaleBar bar;
  BarTest test;
};

/// Results for the plain points in the pictures that are used.
struct PlainSummary {
  bool refused = false;  ///< no plain target is given; the coded ones are
  std::string reason;    ///< reason
  int points = 0;
  int used = 0;  ///< in given targets
  int targets = 0;
  double variance_root = 0;  ///< scatter in stated sigmas; 0 without targets
  struct LeftOver {
    std::string reason;  ///< after "points that …"
    int points = 0;
    int pictures = 0;  ///< showing any of them
  };
  std::vector<LeftOver> left_over;  ///< most first
};

/// Targets, covariance and lens are valid only with verdict good.
struct Survey {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  std::vector<std::string> unchecked;  ///< assumptions of the answer, whatever the verdict
  AdjustmentCheck check;
  /// Sorted by id: numbers ascending, then texts; then the plain ones, P1, P2, …, by x.
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
  /// Scatter of the observations, in their stated sigmas. The covariance includes it.
  double variance_root = 0;
  PlainSummary plain;
  std::vector<std::string> notices;
};

/// Solves a survey. Starting values follow from codes alone; then a bundle adjustment of stations,
/// targets and lens, free of scale. Outliers are found by data snooping (Baarda), one at a time in
/// each picture and target, so that no bar makes an observation wrong. The bars are tested against
/// that shape (scale_bars.h) and then join. A moved target, exchanged codes, a picture of something
/// else, a change of focal length and a bar that contradicts the others are distinguished and
/// named. Plain targets are matched between the stations of the coded ones (plain_matching.h), and
/// all are adjusted together.
/// Verdicts other than good: pictures of different sizes, a focal length that changed, bars that
/// contradict one another, residuals beyond reason (refused); pictures that are not connected, more
/// observations rejected than outliers can be (rejection.h), no bar (cannot_tell). Errors (kInput):
/// invalid numbers, a target twice in a picture, a bar between a target and itself. Accuracy and
/// cost: part_alignment_study.
[[nodiscard]] Result<Survey> SolveSurvey(const SurveyInput& input, const SurveyOptions& options);

}  // namespace trammel::part_alignment
