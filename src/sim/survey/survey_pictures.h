// Observations in pictures of a part with targets: centres of discs, and false ones.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/survey/survey_part.h"

namespace trammel::sim {

/// Mark that is displaced from one picture on.
struct MarkMove {
  std::size_t mark = 0;
  std::size_t from_picture = 0;
  Eigen::Vector3d by_mm = Eigen::Vector3d::Zero();
};

struct SurveyPictureTraits {
  double sigma_px = 0.03;       ///< per axis of a centre, and per semi-axis of an ellipse, 1 sigma
  double missed = 0.1;          ///< share of the discs that are not found
  double code_unread = 0.05;    ///< of coded targets found: read as plain discs
  double steepest_rad = 1.134;  ///< incidence: 65 degrees
  double steepest_code_rad = 1.047;  ///< beyond it no code is read
  double margin_px = 25;             ///< from the picture's edge
  double spurious = 20;              ///< a picture in the mean, glints and screws among them
  double glint_px = 0.3;             ///< centre of a glint or screw per axis, 1 sigma
  double screw_seen = 0.5;           ///< share of the pictures that face it
  /// Distance of outlines below which discs are seen as one, in the middle.
  double merged_px = 1.5;
  std::optional<MarkMove> move;
};

enum class SpotKind { kMark, kMerged, kGlint, kScrew, kSpeck };

struct SurveySpot {
  DiscImage seen;  ///< including its noise
  int code = 0;    ///< as read; 0: none
  SpotKind kind = SpotKind::kMark;
  std::size_t mark = 0;  ///< index into the part's marks, with kMark; else 0
};

/// Spots of a picture, in arbitrary order.
struct SurveyShow {
  std::vector<SurveySpot> spots;
};

[[nodiscard]] std::vector<SurveyShow> TakeSurveyPictures(const SurveyPart& part,
                                                         const HandLens& lens,
                                                         const std::vector<HandShot>& shots,
                                                         const SurveyPictureTraits& traits,
                                                         std::uint64_t seed);

/// Support of each mark: the number of pictures that show it alone, and the widest angle between
/// two of their lines of sight. Every method requires this.
struct MarkSupport {
  int pictures = 0;
  double widest_rad = 0;
};
[[nodiscard]] std::vector<MarkSupport> SupportOf(const SurveyPart& part,
                                                 const std::vector<HandShot>& shots,
                                                 const std::vector<SurveyShow>& shows);

}  // namespace trammel::sim
