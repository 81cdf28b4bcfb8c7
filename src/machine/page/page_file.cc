#include "machine/page/page_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <optional>
#include <string_view>

#include "machine/net/file_bytes.h"
#include "machine/page/page_decoders.h"

namespace trammel::machine {
namespace {

enum class PageFormat { kTiff, kPng, kJpeg, kPdf, kUnknown };

PageFormat FormatOf(std::span<const std::uint8_t> bytes) {
  const auto starts = [bytes](std::string_view with) {
    return bytes.size() >= with.size() &&
           std::equal(with.begin(), with.end(), bytes.begin(),
                      [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; });
  };
  using std::string_view_literals::operator""sv;
  if (starts("II*\0"sv) || starts("MM\0*"sv) || starts("II+\0"sv) || starts("MM\0+"sv)) {
    return PageFormat::kTiff;
  }
  if (starts("\x89PNG"sv)) return PageFormat::kPng;
  if (starts("\xff\xd8\xff"sv)) return PageFormat::kJpeg;
  if (starts("%PDF"sv)) return PageFormat::kPdf;
  return PageFormat::kUnknown;
}

Result<void> One(Result<Page> page, const PageSink& sink) {
  if (!page) return tl::unexpected(page.error());
  return sink(std::move(*page));
}

constexpr std::size_t kSignature = 8;

Result<void> Read(const std::filesystem::path& path, const PageReadOptions& options,
                  const PageSink& sink) {
  constexpr std::int64_t kMaxPageBytes = 4'000'000'000;
  const auto start = TRY(ReadFileStart(path, kSignature));
  const PageFormat format = FormatOf(start);
  if (start.empty()) return Fail("it is empty; scan again");
  if (format == PageFormat::kUnknown) {
    return Fail("it is no TIFF, PNG, JPEG or PDF; scan or convert it to one of these");
  }
  if (format == PageFormat::kTiff) return ReadTiff(path, options, sink);
  if (format == PageFormat::kPdf) return ReadPdf(path, options, sink);
  const auto bytes = TRY(ReadFileBytes(path, kMaxPageBytes));
  if (format == PageFormat::kPng) return One(DecodePng(bytes, options), sink);
  return One(DecodeJpeg(bytes, options), sink);
}

constexpr double kMaxPixelsOfARow = 1e6;

std::uint8_t OnWhite(unsigned value, unsigned alpha) {
  return static_cast<std::uint8_t>((value * alpha + 255U * (255U - alpha) + 127U) / 255U);
}

// Sample as 8 bits.
class Samples {
 public:
  Samples(const PageLayout& layout, std::span<const std::uint8_t> row)
      : bits_(layout.bits), invert_(layout.white_is_zero), row_(row) {}

  [[nodiscard]] unsigned At(std::size_t i) const {
    unsigned value = 0;
    if (bits_ == 1) {
      value = (row_[i / 8] >> (7 - i % 8) & 1U) * 255U;
    } else if (bits_ == 8) {
      value = row_[i];
    } else {
      std::uint16_t wide = 0;
      std::memcpy(&wide, &row_[2 * i], sizeof wide);
      value = (wide + 128U) / 257U;
    }
    return invert_ ? 255U - value : value;
  }

 private:
  int bits_;
  bool invert_;
  std::span<const std::uint8_t> row_;
};

}  // namespace

Result<Page> MakePage(const PageLayout& layout, const PageReadOptions& options) {
  if (layout.width < 1 || layout.height < 1) {
    return Fail(fmt::format("its header states {} x {} px", layout.width, layout.height));
  }
  if (static_cast<double>(layout.width) > kMaxPixelsOfARow ||
      static_cast<double>(layout.height) > kMaxPixelsOfARow ||
      layout.width * layout.height > options.most_pixels) {
    return Fail(fmt::format(
        "it has {} x {} px, and at most {} megapixels and a million pixels a side are read; scan "
        "only the sheet, or with fewer dpi (600 are enough), or raise the limit",
        layout.width, layout.height, options.most_pixels / 1'000'000));
  }
  if (layout.samples < 1 || layout.samples > 4 ||
      (layout.bits != 1 && layout.bits != 8 && layout.bits != 16) ||
      (layout.bits == 1 && layout.samples != 1)) {
    return Fail(fmt::format(
        "it has {} samples of {} bits a pixel; save it as grey or RGB with 8 or 16 bits",
        layout.samples, layout.bits));
  }
  Page page;
  page.width = static_cast<int>(layout.width);
  page.height = static_cast<int>(layout.height);
  page.channels = layout.samples < 3 ? 1 : 3;
  try {
    // Reserves addresses only: memory is used as rows arrive.
    page.samples.reserve(static_cast<std::size_t>(page.stride()) *
                         static_cast<std::size_t>(page.height));
  } catch (const std::bad_alloc&) {
    return Fail(fmt::format("its {} x {} px do not fit into memory; scan with fewer dpi",
                            layout.width, layout.height));
  }
  return page;
}

Result<void> CheckRaster(const PageLayout& layout, double max_packed, std::uintmax_t file_bytes) {
  const double raster = static_cast<double>(layout.width) * static_cast<double>(layout.height) *
                        layout.samples * layout.bits / 8;
  if (raster <= max_packed * static_cast<double>(file_bytes)) return {};
  return Fail(
      fmt::format("its header states {} x {} px, more than its {} bytes can hold; "
                  "it was cut off or is damaged: copy it again, or scan again",
                  layout.width, layout.height, file_bytes));
}

std::uint8_t* RowOf(Page& page, int y) {
  const auto end = static_cast<std::size_t>(page.stride()) * (static_cast<std::size_t>(y) + 1);
  if (page.samples.size() < end) page.samples.resize(end);
  return page.row(y);
}

void FillRow(const PageLayout& layout, std::span<const std::uint8_t> row, int y, Page& page) {
  if (layout.bits == 8 && layout.samples == 1 && !layout.white_is_zero) {
    std::copy_n(row.begin(), page.width, RowOf(page, y));
    return;
  }
  FillPixels(layout, row, y, 0, 1, page);
}

void FillPixels(const PageLayout& layout, std::span<const std::uint8_t> row, int y, int first,
                int step, Page& page) {
  const auto per_pixel = static_cast<std::size_t>(layout.samples);
  std::uint8_t* const out = RowOf(page, y);
  const Samples samples(layout, row);
  const bool alpha = layout.samples % 2 == 0;
  std::size_t at = 0;
  for (std::ptrdiff_t x = first; x < page.width; x += step, at += per_pixel) {
    const unsigned opaque = alpha ? samples.At(at + per_pixel - 1) : 255U;
    std::uint8_t* pixel = out + x * page.channels;
    if (page.channels == 1) {
      *pixel = OnWhite(samples.At(at), opaque);
    } else {
      for (const std::size_t channel : {2U, 1U, 0U}) {
        *pixel++ = OnWhite(samples.At(at + channel), opaque);
      }
    }
  }
}

Result<void> ForEachPage(const std::filesystem::path& path, const PageReadOptions& options,
                         const PageSink& sink) {
  constexpr std::int64_t kPagesOfMostPixels = 3;
  const std::int64_t most = kPagesOfMostPixels * options.most_pixels;
  std::int64_t pixels = 0;
  std::optional<Error> of_sink;
  const auto counted = [&](Page page) -> Result<void> {
    pixels += std::int64_t{page.width} * page.height;
    if (pixels > most) {
      return Fail(fmt::format("its pages have more than {} megapixels in all; give fewer at a time",
                              most / 1'000'000));
    }
    auto taken = sink(std::move(page));
    if (!taken) of_sink = taken.error();
    return taken;
  };
  Result<void> read;
  try {
    read = Read(path, options, counted);
  } catch (const std::bad_alloc&) {
    read = Fail("it does not fit into memory; scan with fewer dpi");
  }
  if (of_sink) return tl::unexpected(*of_sink);
  if (read) return {};
  return Fail(fmt::format("page {}: {}", path.string(), read.error().message));
}

Result<std::vector<Page>> ReadPages(const std::filesystem::path& path,
                                    const PageReadOptions& options) {
  std::vector<Page> pages;
  const auto read = ForEachPage(path, options, [&](Page page) -> Result<void> {
    pages.push_back(std::move(page));
    return {};
  });
  if (!read) return tl::unexpected(read.error());
  return pages;
}

}  // namespace trammel::machine
