// Finds the targets in a survey's pictures.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/page.h"
#include "base/result.h"
#include "part_alignment/survey/survey.h"
#include "part_alignment/targets/code_book.h"
#include "part_alignment/targets/ring_finder.h"

namespace trammel::procedure {

struct SurveyReadOptions {
  part_alignment::CodeBook book;
  part_alignment::FinderOptions finder;
  /// Added to the detector's own sigma, in quadrature: errors that it cannot detect (lens,
  /// vibration). >= 0
  double extra_sigma_px = 0.005;
  /// Also finds bright discs without a ring, as plain points.
  bool plain = false;
};

struct SurveyReading {
  std::vector<part_alignment::SurveyPicture> pictures;  ///< named by their files
  std::vector<std::string> notices;
};

/// Finds the targets in one picture.
/// @param grey  one channel
/// Errors: FindTargets'.
[[nodiscard]] Result<part_alignment::SurveyPicture> ReadSurveyPicture(
    const std::string& name, const PageView& grey, const SurveyReadOptions& options,
    part_alignment::FinderWorkspace& workspace, std::vector<std::string>& notices);

/// Reads each picture as stored (EXIF rotation is ignored) and finds the targets in it.
/// @param tell  progress, a line for each picture.
/// Errors: a file that cannot be read, is no picture or is listed twice.
[[nodiscard]] Result<SurveyReading> ReadSurveyPictures(
    const std::vector<std::filesystem::path>& paths, const SurveyReadOptions& options,
    const std::function<void(const std::string&)>& tell);

}  // namespace trammel::procedure
