#include "machine/page_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>

#include "machine/file_bytes.h"
#include "machine/page_decoders.h"

namespace trammel::machine {
namespace {

enum class PageFormat { kTiff, kPng, kJpeg, kPnm, kPdf, kUnknown };

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
  if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6') {
    return PageFormat::kPnm;
  }
  return PageFormat::kUnknown;
}

Pages One(Result<Page> page) {
  if (!page) return tl::unexpected(page.error());
  std::vector<Page> pages;
  pages.push_back(std::move(*page));
  return pages;
}

constexpr std::size_t kSignature = 8;

Pages Read(const std::filesystem::path& path, const PageReadOptions& options) {
  std::ifstream file(path, std::ios::binary);
  std::array<std::uint8_t, kSignature> start{};
  file.read(reinterpret_cast<char*>(start.data()), start.size());
  const PageFormat format =
      FormatOf(std::span(start).first(static_cast<std::size_t>(file.gcount())));
  file.close();
  if (format == PageFormat::kTiff) return ReadTiff(path, options);
  if (format == PageFormat::kPdf) return ReadPdf(path, options);
  // Four samples of 16 bits; small limits are better told by the header, which says how many
  // pixels.
  constexpr std::int64_t kAlways = 1'000'000'000;
  const auto bytes = ReadFileBytes(path, std::max(8 * options.most_pixels, kAlways));
  if (!bytes) return tl::unexpected(bytes.error());
  switch (format) {
    case PageFormat::kPng:
      return One(DecodePng(*bytes, options));
    case PageFormat::kJpeg:
      return One(DecodeJpeg(*bytes, options));
    case PageFormat::kPnm:
      return One(DecodePnm(*bytes, options));
    default:
      return Fail(bytes->empty() ? "it is empty; scan again"
                                 : "it is no TIFF, PNG, JPEG, PNM or PDF; scan or convert it to "
                                   "one of these");
  }
}

constexpr double kMostPixelsOfARow = 1e6;

std::uint8_t OnWhite(unsigned value, unsigned alpha) {
  return static_cast<std::uint8_t>((value * alpha + 255U * (255U - alpha) + 127U) / 255U);
}

// A sample as 8 bits.
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
  if (static_cast<double>(layout.width) > kMostPixelsOfARow ||
      static_cast<double>(layout.height) > kMostPixelsOfARow ||
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
    page.samples.resize(static_cast<std::size_t>(page.stride()) *
                        static_cast<std::size_t>(page.height));
  } catch (const std::bad_alloc&) {
    return Fail(fmt::format("its {} x {} px do not fit into memory; scan with fewer dpi",
                            layout.width, layout.height));
  }
  return page;
}

void FillRow(const PageLayout& layout, std::span<const std::uint8_t> row, int y, Page& page) {
  const auto per_pixel = static_cast<std::size_t>(layout.samples);
  const auto width = static_cast<std::size_t>(page.width);
  std::uint8_t* out = page.row(y);
  if (layout.bits == 8 && layout.samples == 1 && !layout.white_is_zero) {
    std::copy_n(row.begin(), width, out);
    return;
  }
  const Samples samples(layout, row);
  const bool alpha = layout.samples % 2 == 0;
  for (std::size_t x = 0; x < width; ++x) {
    const std::size_t first = x * per_pixel;
    const unsigned opaque = alpha ? samples.At(first + per_pixel - 1) : 255U;
    if (page.channels == 1) {
      *out++ = OnWhite(samples.At(first), opaque);
    } else {
      for (const std::size_t channel : {2U, 1U, 0U}) {
        *out++ = OnWhite(samples.At(first + channel), opaque);
      }
    }
  }
}

Result<std::vector<Page>> ReadPages(const std::filesystem::path& path,
                                    const PageReadOptions& options) {
  Pages pages = Read(path, options);
  if (!pages) {
    return Fail(fmt::format("page {}: {}", path.string(), pages.error().message));
  }
  return pages;
}

}  // namespace trammel::machine
