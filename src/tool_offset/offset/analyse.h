#pragma once

#include <optional>
#include <span>

#include "base/page.h"
#include "base/result.h"
#include "tool_offset/reading/sheet_result.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

struct AnalyseOptions {
  /// Dots per inch that the file or the user states; only compared with what the sheet says.
  std::optional<double> dpi_x;
  std::optional<double> dpi_y;
  std::optional<PageKind> kind = PageKind::kScan;  ///< absent: told from the picture
  PhotoSource photo = {};                          ///< of a photo
};

/// Finds the sheet on the page, reads every tool's combs and fits them together.
///
/// A tool that did not print, is too faint or cannot be told from its surroundings is refused by
/// name in its own reading; so is a structure. Fails only where the sheet itself cannot be used, or
/// where nobody says whether it is a scan or a photo and both may be.
/// Offsets that bring teeth to touch are read from whole combs and carry a notice.
/// @param plan  of the sheet that was printed.
/// Accuracy: below 0.1 µm on a clean drawn scan; with scatter s of each leg and n teeth, an
/// offset's
///           standard uncertainty is about s / sqrt(2 n) (analyse_test).
/// Cost: see bench/sheet_bench.cc. Uses all processors.
[[nodiscard]] Result<SheetResult> AnalyseSheet(const PageView& page, const SheetPlan& plan,
                                               const AnalyseOptions& options = {});

/// Answers from all photos of one print together: seen from several places, lines of another height
/// or colour show themselves (SheetModel).
/// @param photos  of the same print and plan, with the same camera; at least one. Each was read
/// with
///                as a photo.
/// @returns the first one's reading, with everybody's answers.
[[nodiscard]] SheetResult JoinPhotos(const SheetPlan& plan, std::span<const SheetResult> photos);

}  // namespace trammel::tool_offset
