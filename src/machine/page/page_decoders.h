// Decoders of the page formats. Each fills a Page row by row as the rows arrive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "machine/page/page_file.h"

namespace trammel::machine {

/// Row layout from a file's header.
struct PageLayout {
  std::int64_t width = 0;
  std::int64_t height = 0;
  int samples = 1;             ///< per pixel: grey, grey and alpha, RGB, RGB and alpha
  int bits = 8;                ///< per sample: 1, 8 or 16 (native byte order)
  bool white_is_zero = false;  ///< greyscale only
};

/// Creates a page of the layout's size without rows: a header costs no memory. Error: too large, or
/// an unsupported layout.
[[nodiscard]] Result<Page> MakePage(const PageLayout& layout, const PageReadOptions& options);

/// Returns a row to fill. Its memory is allocated with the first call for it or for a row below.
/// REQUIRES 0 <= y < height.
[[nodiscard]] std::uint8_t* RowOf(Page& page, int y);

/// Fills one row. REQUIRES a page of this layout, 0 <= y < height, and a whole row.
void FillRow(const PageLayout& layout, std::span<const std::uint8_t> row, int y, Page& page);

/// Fills every `step`th pixel of a row from `first` on. REQUIRES as many pixels in `row`.
void FillPixels(const PageLayout& layout, std::span<const std::uint8_t> row, int y, int first,
                int step, Page& page);

/// Rejects a raster that is larger than the file can contain at the maximum compression
/// `most_packed`.
[[nodiscard]] Result<void> CheckRaster(const PageLayout& layout, double max_packed,
                                       std::uintmax_t file_bytes);

/// Messages do not name the file.
[[nodiscard]] Result<void> ReadTiff(const std::filesystem::path& path,
                                    const PageReadOptions& options, const PageSink& sink);
[[nodiscard]] Result<void> ReadPdf(const std::filesystem::path& path,
                                   const PageReadOptions& options, const PageSink& sink);
[[nodiscard]] Result<Page> DecodePng(std::span<const std::uint8_t> bytes,
                                     const PageReadOptions& options);
[[nodiscard]] Result<Page> DecodeJpeg(std::span<const std::uint8_t> bytes,
                                      const PageReadOptions& options);

}  // namespace trammel::machine
