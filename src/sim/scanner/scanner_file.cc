#include "sim/scanner/scanner_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <vector>

#include "base/page.h"
#include "files/new_file.h"
#include "image/jpeg_writer.h"
#include "image/png_writer.h"

namespace trammel::sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string Extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
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
  auto png = TRY(image::PngWriter::Create(form, put));
  TRY(scan.Render(random,
                  [&](std::span<const std::uint8_t> row) { return png.WriteRow(row.data()); }));
  return png.Finish();
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

Result<void> Check(const PageFormat& format, const PageFileOptions& options,
                   const std::string& extension) {
  constexpr std::array kKnown = {".png", ".jpg", ".jpeg"};
  if (std::find(kKnown.begin(), kKnown.end(), extension) == kKnown.end()) {
    return Fail(fmt::format("'{}' is no kind of picture that is written; choose .png or .jpg",
                            extension.substr(0, 20)));
  }
  const bool jpeg = extension == ".jpg" || extension == ".jpeg";
  if (jpeg && format.bits == 16) return Fail("JPEG has 8 bits; choose --bits 8 or .png");
  if (jpeg && !(options.jpeg_quality >= 1 && options.jpeg_quality <= 100)) {
    return Fail(
        fmt::format("the JPEG quality is {}; it must lie within 1 … 100", options.jpeg_quality));
  }
  if (options.dpi && !(*options.dpi >= 1 && *options.dpi <= 60000)) {
    return Fail(
        fmt::format("the file is to say {} dpi; it must lie within 1 … 60000", *options.dpi));
  }
  return {};
}

}  // namespace

Result<void> WriteScan(const SheetScan& scan, const Random& random, const PageFileOptions& options,
                       const std::filesystem::path& path) {
  const std::string extension = Extension(path);
  TRY(Check(scan.format(), options, extension));
  auto file = files::NewFile::Create(path, files::IfThere::kRefuse);
  if (!file) return tl::unexpected(file.error());
  const auto put = [&file](std::span<const std::uint8_t> bytes) {
    return file->Write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  };
  auto written = extension == ".png" ? WritePng(scan, random, options, put)
                                     : WriteJpeg(scan, random, options, put);
  return written ? file->Commit() : written;
}

}  // namespace trammel::sim
