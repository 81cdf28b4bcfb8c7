#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "machine/page/page_decoders.h"

namespace trammel::machine {
namespace {

/// Reads what stands as text: P2, P3 and P1 rasters, and every header.
class PnmText {
 public:
  explicit PnmText(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// The next number; -1 where there is none, or it is larger than anything allowed.
  std::int64_t Number() {
    SkipBlanks();
    std::int64_t value = -1;
    while (at_ < bytes_.size() && bytes_[at_] >= '0' && bytes_[at_] <= '9') {
      value = (value < 0 ? 0 : value) * 10 + (bytes_[at_++] - '0');
      if (value > kMostOfANumber) return -1;
    }
    return value;
  }

  /// P1 may leave out the blanks between its digits.
  int Bit() {
    SkipBlanks();
    if (at_ >= bytes_.size() || (bytes_[at_] != '0' && bytes_[at_] != '1')) return -1;
    return bytes_[at_++] - '0';
  }

  /// The raster of a binary file starts one blank after the header.
  std::span<const std::uint8_t> Rest() const {
    return bytes_.subspan(std::min(at_ + 1, bytes_.size()));
  }

 private:
  static constexpr std::int64_t kMostOfANumber = 1'000'000'000;

  void SkipBlanks() {
    while (at_ < bytes_.size()) {
      if (bytes_[at_] == '#') {
        while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
      } else if (bytes_[at_] > ' ') {
        return;
      } else {
        ++at_;
      }
    }
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 2;
};

struct PnmHeader {
  PageLayout layout;
  bool text = false;
  std::int64_t most = 1;  ///< the value of white
};

Result<PnmHeader> ReadHeader(char kind, PnmText& text) {
  PnmHeader header;
  header.text = kind <= '3';
  const bool bits = kind == '1' || kind == '4';
  header.layout.samples = kind == '3' || kind == '6' ? 3 : 1;
  header.layout.width = text.Number();
  header.layout.height = text.Number();
  header.most = bits ? 1 : text.Number();
  if (header.most < 1 || header.most > 65535) {
    return Fail("its header is no PNM header: three numbers are expected");
  }
  header.layout.white_is_zero = bits;
  header.layout.bits = bits && !header.text ? 1 : header.most > 255 && !header.text ? 16 : 8;
  return header;
}

Error EndsEarly(int row) {
  return {ErrorKind::kInput,
          fmt::format("it ends in row {}; copy it again, or scan again", row + 1)};
}

// Values of any range to 8 or 16 bits in the processor's order.
void Scale(const PnmHeader& header, std::span<const std::uint8_t> raw,
           std::vector<std::uint8_t>& row) {
  if (header.layout.bits == 16) {
    for (std::size_t i = 0; i + 1 < row.size(); i += 2) {
      const std::int64_t value = raw[i] << 8 | raw[i + 1];
      const auto wide =
          static_cast<std::uint16_t>(std::min(value, header.most) * 65535 / header.most);
      std::memcpy(&row[i], &wide, sizeof wide);
    }
    return;
  }
  for (std::size_t i = 0; i < row.size(); ++i) {
    row[i] = header.layout.bits == 1
                 ? raw[i]
                 : static_cast<std::uint8_t>(std::min<std::int64_t>(raw[i], header.most) * 255 /
                                             header.most);
  }
}

/// What is left behind the header must hold the raster; of a text, two bytes a value at least.
Result<void> CheckRest(const PnmHeader& header, std::size_t rest) {
  const PageLayout& layout = header.layout;
  const double row = static_cast<double>(layout.width) * layout.samples;
  const bool spaced = header.text && !layout.white_is_zero;
  const double row_bytes = header.text ? (spaced ? 2 : 1) * row : std::ceil(row * layout.bits / 8);
  const double whole = row_bytes * static_cast<double>(layout.height) - (spaced ? 1 : 0);
  if (whole <= static_cast<double>(rest)) return {};
  return Fail(
      fmt::format("its header states {} x {} px in at least {:.0f} bytes, {} are there: it ends in "
                  "row {}; copy "
                  "it again, or scan again",
                  layout.width, layout.height, whole, rest,
                  1 + static_cast<std::int64_t>(static_cast<double>(rest) / row_bytes)));
}

Result<Page> FillFromText(const PnmHeader& header, PnmText& text, Page page) {
  std::vector<std::uint8_t> row(static_cast<std::size_t>(page.stride()));
  for (int y = 0; y < page.height; ++y) {
    for (std::uint8_t& sample : row) {
      const std::int64_t value = header.layout.white_is_zero ? text.Bit() : text.Number();
      if (value < 0) return tl::unexpected(EndsEarly(y));
      sample = static_cast<std::uint8_t>(std::min(value, header.most) * 255 / header.most);
    }
    FillRow(header.layout, row, y, page);
  }
  return page;
}

}  // namespace

Result<Page> DecodePnm(std::span<const std::uint8_t> bytes, const PageReadOptions& options) {
  PnmText text(bytes);
  const auto header = ReadHeader(bytes.size() > 1 ? static_cast<char>(bytes[1]) : ' ', text);
  if (!header) return tl::unexpected(header.error());
  if (header->layout.width > 0 && header->layout.height > 0) {
    const std::size_t rest = text.Rest().size() + (header->text ? 1 : 0);
    if (auto fits = CheckRest(*header, rest); !fits) return tl::unexpected(fits.error());
  }
  auto page = MakePage(header->layout, options);
  if (!page || header->text) {
    return page ? FillFromText(*header, text, std::move(*page)) : page;
  }
  const PageLayout& layout = header->layout;
  const auto bits = static_cast<std::size_t>(layout.width * layout.samples * layout.bits);
  std::vector<std::uint8_t> row((bits + 7) / 8);
  std::span<const std::uint8_t> raster = text.Rest();
  for (int y = 0; y < page->height; ++y) {
    if (raster.size() < row.size()) return tl::unexpected(EndsEarly(y));
    Scale(*header, raster, row);
    FillRow(layout, row, y, *page);
    raster = raster.subspan(row.size());
  }
  return page;
}

}  // namespace trammel::machine
