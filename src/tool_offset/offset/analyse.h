#pragma once

#include <optional>
#include <span>

#include "base/page.h"
#include "base/result.h"
#include "tool_offset/reading/sheet_result.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

struct AnalyseOptions {
  /// Dots per inch stated by the file or the user; only compared with the sheet's.
  std::optional<double> dpi_x;
  std::optional<double> dpi_y;
  std::optional<PageKind> kind = PageKind::kScan;  ///< absent: told from the picture
  PhotoSource photo = {};                          ///< photos only
};

/// Finds the sheet on the page, reads every tool's combs and fits them together.
///
/// A tool that did not print, is too faint or cannot be separated from its surroundings is refused
/// by name in its own reading; so is a structure. Fails only if the sheet itself is unusable, or if
/// it may be both scan and photo and neither is stated. Offsets that bring teeth to touch are read
/// from whole combs and carry a notice.
/// @param plan  of the sheet that was printed.
/// Accuracy: below 0.1 µm on a clean drawn scan; with scatter s of each leg and n teeth, an
/// offset's standard uncertainty is about s / sqrt(2 n) (analyse_test).
/// Cost: see bench/sheet_bench.cc. Uses all processors.
[[nodiscard]] Result<SheetResult> AnalyseSheet(const PageView& page, const SheetPlan& plan,
                                               const AnalyseOptions& options = {});

/// Evaluates all photos of one print together: from several camera positions, lines of another
/// height or colour are recognisable (SheetModel).
/// @param photos  of the same print and plan, with the same camera; at least one. Each was read
/// with as a photo.
/// @returns the first one's reading, with the common results.
[[nodiscard]] SheetResult JoinPhotos(const SheetPlan& plan, std::span<const SheetResult> photos);

}  // namespace trammel::tool_offset
