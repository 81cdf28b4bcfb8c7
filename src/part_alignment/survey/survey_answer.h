// What a survey says of its network: supports, outliers, stations, targets.
#pragma once

#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/rejection.h"
#include "part_alignment/survey/bundle.h"
#include "part_alignment/survey/survey.h"
#include "part_alignment/survey/survey_input.h"

namespace trammel::part_alignment {

[[nodiscard]] constexpr double Degrees(double rad) { return rad * 180 / std::numbers::pi; }

/// Of a point: its observations that take part and the widest angle between two of their lines.
struct PointSupport {
  int observations = 0;
  double widest_angle_rad = 0;  ///< up to 90 degrees
  Eigen::Vector3d seen_from = Eigen::Vector3d::UnitZ();
};
[[nodiscard]] std::vector<PointSupport> SupportOf(const Network& network);

/// Roughly by what the network has to be enlarged for its bars to fit (the median: bars are not
/// tested yet); absent without any.
[[nodiscard]] std::optional<double> ScaleOf(const Network& network);

/// Origin in the points' centroid, x along their largest extent (towards the first point), z along
/// the least one, to the stations' side.
void LayDatum(Network& network);

/// Pictures without targets and bars without ends, by name.
void NoteInput(const SurveyInput& input, const IndexedSurvey& indexed, Survey& survey);

/// Says of each picture that is not placed why. @returns the reason to refuse where several of them
/// fit with another focal length.
[[nodiscard]] std::optional<std::string> NoteUnplaced(const SurveyInput& input,
                                                      const Network& network, int longer_side_px,
                                                      Random& random, Survey& survey);

/// Names the targets that could not be intersected.
void NoteUnplacedTargets(const IndexedSurvey& indexed, Survey& survey);

/// Takes back what was said of targets that are given after all, and what is said twice.
void DropNoticesOfGiven(const IndexedSurvey& indexed, Survey& survey);

/// Where too many pictures stay out.
[[nodiscard]] std::optional<std::string> FallsApart(const SurveyInput& input, const Survey& survey,
                                                    const Network& network);

/// Observations of coded targets left out of the network, with what stands at their place instead.
void NoteOutliers(const SurveyInput& input, const IndexedSurvey& indexed, const Network& network,
                  Survey& survey);

/// Redundancy, and the observations that contradict the others: those left out one by one, those of
/// targets that moved or of which no three agree, those of pictures that contradict.
/// @param moved  points.
[[nodiscard]] AdjustmentCheck CheckOf(const IndexedSurvey& indexed, const SurveyOptions& options,
                                      const std::set<std::size_t>& moved,
                                      const NetworkPrecision& precision, const Survey& survey);

/// Targets, stations, lens and covariance of the adjusted network.
void FillAnswer(const SurveyInput& input, const IndexedSurvey& indexed,
                const NetworkPrecision& precision, Survey& survey);

/// A focal length that the pictures do not determine.
[[nodiscard]] std::optional<std::string> WeakLens(const Survey& survey);

/// Targets that are known much worse than the others, or seen too seldom to be checked well, by the
/// side from which more pictures see them; nothing where all are alike. REQUIRES verdict good.
[[nodiscard]] std::vector<std::string> AdvisePictures(const Survey& survey);

}  // namespace trammel::part_alignment
