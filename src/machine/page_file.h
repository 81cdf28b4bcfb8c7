// Reads scanned pages: TIFF, PNG, JPEG, PNM and PDF.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/page.h"
#include "base/result.h"

namespace trammel::machine {

struct PageReadOptions {
  std::int64_t most_pixels = 4'000'000'000;  ///< of a page, > 0
  int most_pages = 32;                       ///< of a file, > 0
};

/// Every page of a file. Grey and black-and-white pages have one channel, coloured ones three; 16
/// bits become 8 (the noise of a scanner is coarser), transparency is laid on white.
///
/// TIFF (any strips; tiles, palettes and other rarities up to 500 megapixels), PNG, JPEG (no CMYK),
/// PNM (P1 to P6), and PDFs that hold one picture a page, as scanners write them: the picture is
/// taken as it was stored, its resolution from the size of the sheet.
///
/// @returns errors (kInput), which name the file, what is wrong and what to do: a format that is
/// none of these, a file that ends early, sizes beyond the options', whatever a decoder rejects.
/// Sizes are checked before anything is decoded. Input may be hostile.
/// Memory: that of the pages, and some rows; of a compressed PDF, twice that of one page.
[[nodiscard]] Result<std::vector<Page>> ReadPages(const std::filesystem::path& path,
                                                  const PageReadOptions& options = {});

}  // namespace trammel::machine
