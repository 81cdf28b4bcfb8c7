#include "sim/scanner/scanner_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include "base/page.h"
#include "files/new_file.h"
#include "image/jpeg_writer.h"
#include "image/png_writer.h"

namespace trammel::sim {
namespace {

static_assert(std::endian::native == std::endian::little, "TIFFs are written little-endian");

using Bytes = std::vector<std::uint8_t>;

void PutLittle(Bytes& bytes, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::string Extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// One TIFF directory with the data that its fields point to.
class TiffHead {
 public:
  TiffHead(const PageFormat& format, std::optional<double> dpi);
  [[nodiscard]] Bytes Take();

 private:
  static constexpr std::uint64_t kShort = 3;
  static constexpr std::uint64_t kLong = 4;
  static constexpr std::uint64_t kRational = 5;

  void Field(std::uint64_t tag, std::uint64_t type, std::uint64_t count, std::uint64_t value);
  // Where data of this length will lie; it is added by the caller.
  [[nodiscard]] std::uint64_t Place() const { return data_start_ + data_.size(); }

  Bytes fields_;
  std::uint64_t count_ = 0;
  std::uint64_t data_start_;
  Bytes data_;
};

void TiffHead::Field(std::uint64_t tag, std::uint64_t type, std::uint64_t count,
                     std::uint64_t value) {
  PutLittle(fields_, tag, 2);
  PutLittle(fields_, type, 2);
  PutLittle(fields_, count, 4);
  PutLittle(fields_, value, 4);
  ++count_;
}

TiffHead::TiffHead(const PageFormat& format, std::optional<double> dpi)
    : data_start_(8 + 2 + 12 * (dpi ? 12U : 9U) + 4) {
  constexpr std::uint64_t kStripBytes = 1 << 18;
  const std::uint64_t rows = static_cast<std::uint64_t>(format.height_px);
  const std::uint64_t row_bytes = format.row_bytes();
  const std::uint64_t strip_rows = std::clamp<std::uint64_t>(kStripBytes / row_bytes, 1, rows);
  const std::uint64_t strips = (rows + strip_rows - 1) / strip_rows;
  const auto channels = static_cast<std::uint64_t>(format.channels);
  Field(256, kLong, 1, static_cast<std::uint64_t>(format.width_px));
  Field(257, kLong, 1, rows);
  const auto bits = static_cast<std::uint64_t>(format.bits);
  Field(258, kShort, channels, channels == 1 ? bits : Place());
  for (std::uint64_t i = 0; channels > 1 && i < channels; ++i) PutLittle(data_, bits, 2);
  Field(259, kShort, 1, 1);                      // not compressed
  Field(262, kShort, 1, channels == 1 ? 1 : 2);  // black is zero; red green blue
  const std::uint64_t offsets_at = Place();
  const std::uint64_t counts_at = offsets_at + (strips > 1 ? 4 * strips : 0);
  const std::uint64_t resolution_at = counts_at + (strips > 1 ? 4 * strips : 0);
  const std::uint64_t pixels_at = resolution_at + (dpi ? 8 : 0);
  Field(273, kLong, strips, strips > 1 ? offsets_at : pixels_at);
  Field(277, kShort, 1, channels);
  Field(278, kLong, 1, strip_rows);
  Field(279, kLong, strips, strips > 1 ? counts_at : rows * row_bytes);
  if (dpi) {
    Field(282, kRational, 1, resolution_at);
    Field(283, kRational, 1, resolution_at);
    Field(296, kShort, 1, 2);  // per inch
  }
  for (std::uint64_t i = 0; strips > 1 && i < strips; ++i) {
    PutLittle(data_, pixels_at + i * strip_rows * row_bytes, 4);
  }
  for (std::uint64_t i = 0; strips > 1 && i < strips; ++i) {
    PutLittle(data_, std::min(strip_rows, rows - i * strip_rows) * row_bytes, 4);
  }
  if (dpi) {
    PutLittle(data_, static_cast<std::uint64_t>(std::lround(*dpi * 1000)), 4);
    PutLittle(data_, 1000, 4);
  }
}

Bytes TiffHead::Take() {
  Bytes head = {'I', 'I', 42, 0, 8, 0, 0, 0};
  PutLittle(head, count_, 2);
  head.insert(head.end(), fields_.begin(), fields_.end());
  PutLittle(head, 0, 4);
  head.insert(head.end(), data_.begin(), data_.end());
  return head;
}

Result<void> WritePng(const SheetScan& scan, const Random& random, const PageFileOptions& options,
                      const RowSink& put) {
  const PageFormat& format = scan.format();
  image::PngForm form;
  form.width_px = format.width_px;
  form.height_px = format.height_px;
  form.channels = format.channels;
  form.bits = format.bits;
  form.order = image::PngForm::Order::kRgb;
  form.dpi_x = form.dpi_y = options.dpi;
  auto png = image::PngWriter::Create(form, put);
  if (!png) return tl::unexpected(png.error());
  const auto rendered = scan.Render(
      random, [&](std::span<const std::uint8_t> row) { return png->WriteRow(row.data()); });
  if (!rendered) return rendered;
  return png->Finish();
}

Result<void> WriteJpeg(const SheetScan& scan, const Random& random, const PageFileOptions& options,
                       const RowSink& put) {
  const PageFormat& format = scan.format();
  Page page;
  page.width = format.width_px;
  page.height = format.height_px;
  page.channels = format.channels;
  const auto rendered = scan.Render(random, [&](std::span<const std::uint8_t> row) {
    const std::size_t begin = page.samples.size();
    page.samples.insert(page.samples.end(), row.begin(), row.end());
    for (std::size_t at = begin; format.channels == 3 && at < page.samples.size(); at += 3) {
      std::swap(page.samples[at], page.samples[at + 2]);
    }
    return Result<void>{};
  });
  if (!rendered) return rendered;
  Bytes jpeg;
  auto encoded = image::EncodeJpeg(page.view(), {options.jpeg_quality, options.dpi}, jpeg);
  return encoded ? put(jpeg) : encoded;
}

Result<void> Write(const files::NewFile& file, const SheetScan& scan, const Random& random,
                   const PageFileOptions& options, const std::string& extension) {
  const auto put = [&file](std::span<const std::uint8_t> bytes) {
    return file.Write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  };
  const PageFormat& format = scan.format();
  if (extension == ".png") return WritePng(scan, random, options, put);
  if (extension == ".jpg" || extension == ".jpeg") return WriteJpeg(scan, random, options, put);
  if (const auto head = put(TiffHead(format, options.dpi).Take()); !head) return head;
  return scan.Render(random, put);
}

Result<void> Check(const PageFormat& format, const PageFileOptions& options,
                   const std::string& extension) {
  constexpr std::array kKnown = {".png", ".jpg", ".jpeg", ".tif", ".tiff"};
  if (std::find(kKnown.begin(), kKnown.end(), extension) == kKnown.end()) {
    return Fail(fmt::format("'{}' is no kind of picture that is written; choose .png, .jpg or .tif",
                            extension.substr(0, 20)));
  }
  const bool jpeg = extension == ".jpg" || extension == ".jpeg";
  if (jpeg && format.bits == 16) return Fail("JPEG has 8 bits; choose --bits 8, .png or .tif");
  if (jpeg && !(options.jpeg_quality >= 1 && options.jpeg_quality <= 100)) {
    return Fail(
        fmt::format("the JPEG quality is {}; it must lie within 1 … 100", options.jpeg_quality));
  }
  if (options.dpi && !(*options.dpi >= 1 && *options.dpi <= 60000)) {
    return Fail(
        fmt::format("the file is to say {} dpi; it must lie within 1 … 60000", *options.dpi));
  }
  const double bytes = static_cast<double>(format.row_bytes()) * format.height_px;
  if (extension.substr(0, 4) == ".tif" && bytes > 4.2e9) {
    return Fail(
        fmt::format("a TIFF holds 4 GB, this scan has {:.1f}; choose .png, fewer bits or "
                    "a lower resolution",
                    bytes / 1e9));
  }
  return {};
}

}  // namespace

Result<void> WriteScan(const SheetScan& scan, const Random& random, const PageFileOptions& options,
                       const std::filesystem::path& path) {
  const std::string extension = Extension(path);
  if (const auto checked = Check(scan.format(), options, extension); !checked) return checked;
  auto file = files::NewFile::Create(path, files::IfThere::kRefuse);
  if (!file) return tl::unexpected(file.error());
  if (auto written = Write(*file, scan, random, options, extension); !written) return written;
  return file->Commit();
}

}  // namespace trammel::sim
