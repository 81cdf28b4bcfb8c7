// Reads scanned pages: TIFF, PNG, JPEG and PDF.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "base/page.h"
#include "base/result.h"

namespace trammel::machine {

struct PageReadOptions {
  std::int64_t most_pixels = 400'000'000;  ///< per page, > 0; three times as many per file
  int max_pages = 32;                      ///< per file, > 0
};

/// Receives a page; an error ends the reading.
using PageSink = std::function<Result<void>(Page)>;

/// Reads every page of a file, one after the other. Grey and black-and-white pages have one
/// channel, coloured ones three; 16 bits become 8 (a scanner's noise is coarser), transparency is
/// blended on white.
///
/// TIFF (any strips; tiles, palettes and other rarities up to 200 megapixels), PNG, JPEG (no CMYK),
/// and PDFs that draw one picture a page, as scanners write them: the stored picture, mirrored if
/// the page draws it so, its resolution from the drawn size.
///
/// @returns errors (kInput), which name the file, the fault and the remedy: another format, a
/// truncated file, sizes beyond the options' or beyond what so few bytes can hold, whatever a
/// decoder rejects, and the sink's, unchanged.
/// Sizes are checked before decoding. Input may be hostile.
/// Memory: the file (not of TIFF and PDF), and that of a page, which grows with its rows; of a
/// progressive JPEG (up to 200 megapixels) three times that. A PDF is unpacked by a separate
/// process with limited memory and time.
[[nodiscard]] Result<void> ForEachPage(const std::filesystem::path& path,
                                       const PageReadOptions& options, const PageSink& sink);

/// Reads all pages at once.
[[nodiscard]] Result<std::vector<Page>> ReadPages(const std::filesystem::path& path,
                                                  const PageReadOptions& options = {});

}  // namespace trammel::machine
