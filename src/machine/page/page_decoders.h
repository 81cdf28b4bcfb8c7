// One decoder for each format of pages. All of them fill a Page row by row, as the rows come.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "machine/page/page_file.h"

namespace trammel::machine {

/// What a file's header says of its rows.
struct PageLayout {
  std::int64_t width = 0;
  std::int64_t height = 0;
  int samples = 1;             ///< per pixel: grey, grey and alpha, RGB, RGB and alpha
  int bits = 8;                ///< of a sample: 1, 8 or 16 (in the processor's order)
  bool white_is_zero = false;  ///< of grey
};

/// A page of the layout's size without its rows: a header costs nothing until they come. An error
/// where it is too large or none that is read.
[[nodiscard]] Result<Page> MakePage(const PageLayout& layout, const PageReadOptions& options);

/// One row to fill. It takes its memory with the first call for it or for one below.
/// REQUIRES 0 <= y < height.
[[nodiscard]] std::uint8_t* RowOf(Page& page, int y);

/// Fills one row. REQUIRES a page of this layout, 0 <= y < height, and a whole row.
void FillRow(const PageLayout& layout, std::span<const std::uint8_t> row, int y, Page& page);

/// Fills every `step`th pixel of a row from `first` on. REQUIRES as many in `row`.
void FillPixels(const PageLayout& layout, std::span<const std::uint8_t> row, int y, int first,
                int step, Page& page);

/// Refuses a raster that is larger than packing by `most_packed` at best can make of the file.
[[nodiscard]] Result<void> CheckRaster(const PageLayout& layout, double most_packed,
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
