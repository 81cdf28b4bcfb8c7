// Reads files with scans or photos of a sheet.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "tool_offset/offset/analyse.h"
#include "tool_offset/report/offset_report.h"

namespace trammel::app {

/// What is said of the files, beside what they say themselves.
struct ReadingOptions {
  std::vector<double> dpi =
      {};  ///< along a row and down the page, or both in one; empty: as stated
  double most_megapixels = 400;  ///< of a page
  bool photo = false;            ///< it is one; else it is told from the picture, or by dpi a scan
  std::optional<double> film_focal_mm = {};  ///< of a photo
  tool_offset::RadialSpread spread = {};
};

/// Adds --dpi, --photo and --film-focal.
void AddReadingOptions(CLI::App& command, ReadingOptions& options);

struct ReadScan {
  report::OffsetScan scan;
  report::OffsetScanPictures pictures;  ///< empty where none are wanted
};

/// Every page of one file; pages are large, and each is gone when it has been read and drawn.
/// @param sheet  which of several that were printed, from 1
/// Errors: kInput of a file that is no page; kMeasurement of a page that is refused, with why.
[[nodiscard]] Result<std::vector<ReadScan>> ReadScans(const std::string& path, int sheet,
                                                      const tool_offset::SheetPlan& plan,
                                                      const ReadingOptions& options, bool pictures);

/// All scans together, by their sheets; photos of one print answer as one.
[[nodiscard]] tool_offset::CombinedResult CombineScans(
    const tool_offset::SheetPlan& plan, const std::vector<report::OffsetScan>& scans);

}  // namespace trammel::app
