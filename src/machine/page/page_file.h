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
  std::int64_t most_pixels = 400'000'000;  ///< of a page, > 0; three times as many in all of a file
  int most_pages = 32;                     ///< of a file, > 0
};

/// Takes a page; an error ends the reading.
using PageSink = std::function<Result<void>(Page)>;

/// Every page of a file, one after the other. Grey and black-and-white pages have one channel,
/// coloured ones three; 16 bits become 8 (the noise of a scanner is coarser), transparency is laid
/// on white.
///
/// TIFF (any strips; tiles, palettes and other rarities up to 200 megapixels), PNG, JPEG (no CMYK),
/// and PDFs that draw one picture a page, as scanners write them: the picture is taken as it was
/// stored, mirrored where the page draws it so, its resolution from how large it is drawn.
///
/// @returns errors (kInput), which name the file, what is wrong and what to do: a format that is
/// none of these, a file that ends early, sizes beyond the options' or beyond what so few bytes can
/// hold, whatever a decoder rejects, and the sink's, as they are.
/// Sizes are checked before anything is decoded. Input may be hostile.
/// Memory: the file (not of TIFF and PDF), and that of a page, which grows as its rows come; of a
/// progressive JPEG (up to 200 megapixels) three times that. A PDF is unpacked by a process of its
/// own, whose memory and time are limited.
[[nodiscard]] Result<void> ForEachPage(const std::filesystem::path& path,
                                       const PageReadOptions& options, const PageSink& sink);

/// The same, all pages at once.
[[nodiscard]] Result<std::vector<Page>> ReadPages(const std::filesystem::path& path,
                                                  const PageReadOptions& options = {});

}  // namespace trammel::machine
