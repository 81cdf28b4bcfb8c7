// Answers of a survey about its network: supports, outliers, stations, targets.
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

/// Used observations of a point, and the widest angle between two of their lines.
struct PointSupport {
  int observations = 0;
  double widest_angle_rad = 0;  ///< up to 90 degrees
  Eigen::Vector3d seen_from = Eigen::Vector3d::UnitZ();
};
[[nodiscard]] std::vector<PointSupport> SupportOf(const Network& network);

/// Returns the approximate factor that scales the network to its bars (the median: bars are not
/// tested yet); absent without bars.
[[nodiscard]] std::optional<double> ScaleOf(const Network& network);

/// Sets the datum: origin in the points' centroid, x along their largest extent (towards the first
/// point), z along the smallest one, to the stations' side.
void LayDatum(Network& network);

/// Notes pictures without targets and bars without ends, by name.
void NoteInput(const SurveyInput& input, const IndexedSurvey& indexed, Survey& survey);

/// Notes for each picture that is not placed the reason. @returns the reason to refuse if several
/// of them fit with another focal length.
[[nodiscard]] std::optional<std::string> NoteUnplaced(const SurveyInput& input,
                                                      const Network& network, int longer_side_px,
                                                      Random& random, Survey& survey);

/// Names the targets that could not be intersected.
void NoteUnplacedTargets(const IndexedSurvey& indexed, Survey& survey);

/// Drops notices of targets that are reported after all, and duplicates.
void DropNoticesOfGiven(const IndexedSurvey& indexed, Survey& survey);

/// Explains the failure if too many pictures are not placed.
[[nodiscard]] std::optional<std::string> FallsApart(const SurveyInput& input, const Survey& survey,
                                                    const Network& network);

/// Notes observations of coded targets that the network rejected, and the target at their place
/// instead.
void NoteOutliers(const SurveyInput& input, const IndexedSurvey& indexed, const Network& network,
                  Survey& survey);

/// Computes the redundancy, and the observations that contradict the others: those rejected one by
/// one, those of targets that moved or of which no three agree, those of pictures that contradict.
/// @param moved  points.
[[nodiscard]] AdjustmentCheck CheckOf(const IndexedSurvey& indexed, const SurveyOptions& options,
                                      const std::set<std::size_t>& moved,
                                      const NetworkPrecision& precision, const Survey& survey);

/// Fills in targets, stations, lens and covariance of the adjusted network.
void FillAnswer(const SurveyInput& input, const IndexedSurvey& indexed,
                const NetworkPrecision& precision, Survey& survey);

/// Reports a focal length that the pictures do not determine.
[[nodiscard]] std::optional<std::string> WeakLens(const Survey& survey);

/// Lists targets that are much less certain than the others, or seen too seldom for a good check,
/// by the side for more pictures. Empty if all are alike. REQUIRES verdict good.
[[nodiscard]] std::vector<std::string> AdvisePictures(const Survey& survey);

}  // namespace trammel::part_alignment
