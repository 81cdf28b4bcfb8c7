// Analyses a photo of a printed pattern of lines or corners.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "gcode/dialect.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/photo/chevron_reader.h"
#include "pressure_advance/photo/photo_reader.h"
#include "pressure_advance/photo/photo_search.h"
#include "pressure_advance/photo/photo_segments.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/corner_response.h"

namespace trammel::app {

using pressure_advance::PatternForm;

/// Facts that a photo does not show.
struct PhotoPlan {
  std::optional<PatternForm> form;                   ///< absent: found
  std::vector<double> pressure_advance_s;            ///< per line, from the first line's side;
                                                     ///< empty: by the printed numbers
  std::optional<pressure_advance::PhotoSide> from;   ///< absent: found
  std::optional<pressure_advance::PhotoSide> start;  ///< printed start; absent: detected
  bool corner_mark = false;                          ///< PhotoOptions::corner_mark
  bool framed = true;                                ///< PhotoOptions::framed
  bool to_and_fro = false;                           ///< lines in both directions: refused
  std::optional<double> length_pitches = {};         ///< PhotoOptions::length_pitches
  std::optional<double> length_mm = {};              ///< of a line; absent: not known
  std::optional<double> acceleration_mm_s2 = {};     ///< on lines; absent: not known
  std::optional<gcode::PrintedBy> printed_by = {};   ///< absent: not known
  std::vector<pressure_advance::Segment> segments =
      pressure_advance::PhotoSegments();       ///< of lines
  pressure_advance::CornerMotion motion = {};  ///< of corners
  std::optional<double> spacing_mm = {};       ///< between corners; absent: that of the usual tools
};

/// Returns the plan's motion with the speed changes where the photo shows them: nearer the truth
/// than the plan's fractions, because part of each line is under the frame. Lines of a known length
/// may start late, so that theirs are not moved towards the end.
/// @param notices  takes the places that are used, if the photo shows others than the plan
[[nodiscard]] pressure_advance::LineMotion MotionSeen(
    const PhotoPlan& plan, const pressure_advance::PhotoMeasurement& seen,
    std::vector<std::string>& notices);

/// Analyses a photo of a printed pattern (JPEG, PNG, WebP or HEIC). Without values in the plan,
/// reads the numbers printed beside it, and says so in notices; with values of another tool's
/// pattern, refuses numbers that clearly differ. A photo in which the pattern cannot be measured
/// gives a refused analysis; a file that is no picture is an error.
[[nodiscard]] Result<AnalysisRun> AnalysePhoto(const std::filesystem::path& file,
                                               const PhotoPlan& plan);

/// Photo that is analysed by several plans: it is decoded and searched once.
struct OpenPhoto {
  std::filesystem::path file;
  pressure_advance::PhotoSearch search;
};

/// Errors: a file that is no picture.
[[nodiscard]] Result<OpenPhoto> ReadPhotoForSearch(const std::filesystem::path& file);

[[nodiscard]] AnalysisRun AnalysePhoto(OpenPhoto& photo, const PhotoPlan& plan);

/// Does the same for the corners in a picture; refused where there are none.
/// @param picture  in which `view` was found
/// @param file     named in messages
[[nodiscard]] AnalysisRun AnalyseCorners(const Frame& picture, const std::string& file,
                                         const pressure_advance::ChevronView& view, PhotoPlan plan);

}  // namespace trammel::app
