// One decoder for each format of pages. All of them fill a Page row by row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "machine/page_file.h"

namespace trammel::machine {

/// What a file's header says of its rows.
struct PageLayout {
  std::int64_t width = 0;
  std::int64_t height = 0;
  int samples = 1;             ///< per pixel: grey, grey and alpha, RGB, RGB and alpha
  int bits = 8;                ///< of a sample: 1, 8 or 16 (in the processor's order)
  bool white_is_zero = false;  ///< of grey
};

/// An empty page of the layout's size; an error where it is too large or none that is read.
[[nodiscard]] Result<Page> MakePage(const PageLayout& layout, const PageReadOptions& options);

/// Fills one row. REQUIRES a page of this layout, 0 <= y < height, and a whole row.
void FillRow(const PageLayout& layout, std::span<const std::uint8_t> row, int y, Page& page);

/// Messages do not name the file.
using Pages = Result<std::vector<Page>>;
[[nodiscard]] Pages ReadTiff(const std::filesystem::path& path, const PageReadOptions& options);
[[nodiscard]] Pages ReadPdf(const std::filesystem::path& path, const PageReadOptions& options);
[[nodiscard]] Result<Page> DecodePng(std::span<const std::uint8_t> bytes,
                                     const PageReadOptions& options);
[[nodiscard]] Result<Page> DecodeJpeg(std::span<const std::uint8_t> bytes,
                                      const PageReadOptions& options);
[[nodiscard]] Result<Page> DecodePnm(std::span<const std::uint8_t> bytes,
                                     const PageReadOptions& options);

}  // namespace trammel::machine
