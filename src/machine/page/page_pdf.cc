#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "machine/net/child_process.h"
#include "machine/page/page_decoders.h"
#include "machine/page/pdf_module.h"

namespace trammel::machine {
namespace {

constexpr int kMaxSeconds = 20;  // CPU time

/// Memory limit of the library for a file, bytes.
std::uint64_t MemoryFor(std::uint64_t file_bytes) {
  constexpr std::uint64_t kAlways = std::uint64_t{256} << 20U;
  return kAlways + 4 * file_bytes;
}

std::uint64_t RowBytes(const PageLayout& layout) {
  return static_cast<std::uint64_t>((layout.width * layout.samples * layout.bits + 7) / 8);
}

/// Mirrors a picture as its page draws it, without rotation, and computes its resolution from the
/// drawn size.
Page AsDrawn(const PdfPicture& told, Page page) {
  constexpr double kPointsPerInch = 72;
  if (told.mirrored) {
    const auto row = static_cast<std::size_t>(page.stride());
    for (int top = 0, bottom = page.height - 1; top < bottom; ++top, --bottom) {
      std::swap_ranges(page.row(top), page.row(top) + row, page.row(bottom));
    }
  }
  const double x = page.width / (told.width_pt / kPointsPerInch);
  const double y = page.height / (told.height_pt / kPointsPerInch);
  if (std::isfinite(x) && std::isfinite(y)) {
    page.dpi_x = x;
    page.dpi_y = y;
  }
  return page;
}

/// Builds a page from the child's messages.
class PdfPage {
 public:
  explicit PdfPage(std::uint64_t file_bytes) : file_bytes_(file_bytes) {}

  Result<void> Begin(const ChildMessage& message, const PageReadOptions& options) {
    if (message.bytes.size() != sizeof told_) return Fail("its decoder failed; scan to TIFF");
    std::memcpy(&told_, message.bytes.data(), sizeof told_);
    rows_ = 0;
    bytes_.clear();
    if (told_.jpeg) return {};
    auto page = TRY(MakePage(told_.layout, options));
    page_ = std::move(page);
    return CheckRaster(told_.layout, told_.max_packed, file_bytes_);
  }

  void Add(const ChildMessage& message) {
    bytes_.insert(bytes_.end(), message.bytes.begin(), message.bytes.end());
    if (told_.jpeg) return;
    const auto row = static_cast<std::size_t>(RowBytes(told_.layout));
    std::span<std::uint8_t> left(bytes_);
    for (; left.size() >= row && rows_ < page_.height; left = left.subspan(row)) {
      const auto samples = left.first(row);
      if (told_.layout.bits == 16) {  // high byte first
        for (std::size_t i = 0; i + 1 < row; i += 2) std::swap(samples[i], samples[i + 1]);
      }
      FillRow(told_.layout, samples, rows_++, page_);
    }
    bytes_.erase(bytes_.begin(), bytes_.end() - static_cast<std::ptrdiff_t>(left.size()));
  }

  Result<Page> End(const PageReadOptions& options) {
    if (told_.jpeg) {
      auto page = TRY(DecodeJpeg(bytes_, options));
      return AsDrawn(told_, std::move(page));
    }
    if (rows_ < page_.height) {
      return Fail("its picture ends early; copy the file again, or scan again");
    }
    return AsDrawn(told_, std::move(page_));
  }

 private:
  std::uint64_t file_bytes_;
  PdfPicture told_;
  Page page_;
  int rows_ = 0;
  std::vector<std::uint8_t> bytes_;
};

Result<void> TakePages(ChildProcess& child, std::uint64_t file_bytes,
                       const PageReadOptions& options, const PageSink& sink) {
  constexpr double kSilence_s = 120;  // for a busy machine: CPU time is limited separately
  PdfPage page(file_bytes);
  ChildMessage message;
  for (;;) {
    if (child.Receive(message, kSilence_s, {}) != Received::kMessage) {
      return Fail(fmt::format(
          "its decoder ended without a word ({}): unpacking its {} bytes takes more than {} s or "
          "{} MB, or it is damaged; scan to TIFF",
          child.End(), file_bytes, kMaxSeconds, MemoryFor(file_bytes) >> 20U));
    }
    Result<void> taken;
    switch (message.kind) {
      case kPdfPicture:
        taken = page.Begin(message, options);
        break;
      case kPdfBytes:
        page.Add(message);
        break;
      case kPdfPageEnds: {
        auto whole = page.End(options);
        taken = whole ? sink(std::move(*whole)) : tl::unexpected(whole.error());
        break;
      }
      case kPdfFault:
        return Fail(std::string(message.bytes.begin(), message.bytes.end()));
      default:
        return {};
    }
    if (!taken) return taken;
  }
}

}  // namespace

Result<void> ReadPdf(const std::filesystem::path& path, const PageReadOptions& options,
                     const PageSink& sink) {
  constexpr double kPatience_s = 1;
  std::error_code unknown;
  const std::uintmax_t file_bytes = std::filesystem::file_size(path, unknown);
  if (unknown) return Fail(unknown.message());
  const auto module = TRY(FindPdfModule());
  auto child = TRY(ChildProcess::Start(
      [&](const ChildSender& sender) {
        LimitThisProcess(MemoryFor(file_bytes), kMaxSeconds);
        const auto sent =
            module->send_pages(path, file_bytes, MemoryFor(file_bytes), options, sender);
        sender.Send(sent ? kPdfFileEnds : kPdfFault,
                    sent ? std::string_view() : sent.error().message);
      },
      kPatience_s));
  return TakePages(child, file_bytes, options, sink);
}

}  // namespace trammel::machine
