#include "machine/page/page_writer.h"

#include <fmt/format.h>
#include <tiffio.h>
#include <unistd.h>

#include <memory>
#include <vector>

#include "files/new_file.h"
#include "image/png_writer.h"

namespace trammel::machine {
namespace {

// RGB, as the format has it.
void TakeRow(const Page& page, int y, std::vector<std::uint8_t>& row) {
  const std::uint8_t* from = page.view().row(y);
  row.assign(from, from + page.stride());
  if (page.channels == 3) {
    for (std::size_t i = 0; i + 2 < row.size(); i += 3) std::swap(row[i], row[i + 2]);
  }
}

Result<void> WritePng(const Page& page, const files::NewFile& file) {
  image::PngForm form;
  form.width_px = page.width;
  form.height_px = page.height;
  form.channels = page.channels;
  form.packing = image::PngForm::Packing::kDense;
  form.dpi_x = page.dpi_x;
  form.dpi_y = page.dpi_y;
  auto png = image::PngWriter::Create(form, [&file](std::span<const std::uint8_t> bytes) {
    return file.Write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  });
  if (!png) return tl::unexpected(png.error());
  for (int y = 0; y < page.height; ++y) {
    if (auto written = png->WriteRow(page.view().row(y)); !written) return written;
  }
  return png->Finish();
}

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};

bool WriteTiff(const Page& page, int fd) {
  const std::unique_ptr<TIFF, CloseTiff> tiff(TIFFFdOpen(dup(fd), "page", "w"));
  if (!tiff) return false;
  TIFF* const to = tiff.get();
  TIFFSetField(to, TIFFTAG_IMAGEWIDTH, page.width);
  TIFFSetField(to, TIFFTAG_IMAGELENGTH, page.height);
  TIFFSetField(to, TIFFTAG_SAMPLESPERPIXEL, page.channels);
  TIFFSetField(to, TIFFTAG_BITSPERSAMPLE, 8);
  TIFFSetField(to, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(to, TIFFTAG_PHOTOMETRIC,
               page.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(to, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
  TIFFSetField(to, TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(to, 0));
  if (page.dpi_x && page.dpi_y) {
    TIFFSetField(to, TIFFTAG_RESOLUTIONUNIT, RESUNIT_INCH);
    TIFFSetField(to, TIFFTAG_XRESOLUTION, *page.dpi_x);
    TIFFSetField(to, TIFFTAG_YRESOLUTION, *page.dpi_y);
  }
  std::vector<std::uint8_t> row;
  for (int y = 0; y < page.height; ++y) {
    TakeRow(page, y, row);
    if (TIFFWriteScanline(to, row.data(), static_cast<std::uint32_t>(y)) != 1) return false;
  }
  return TIFFFlush(to) == 1;
}

}  // namespace

Result<void> CheckPagePath(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  if (ending != ".png" && ending != ".tif" && ending != ".tiff") {
    return Fail(fmt::format("page {}: its name must end in .png, .tif or .tiff", path.string()));
  }
  auto free = files::CheckTarget(path, files::IfThere::kRefuse, "give another name");
  return free ? free : Fail("page " + free.error().message);
}

Result<void> WritePage(const Page& page, const std::filesystem::path& path) {
  if (auto checked = CheckPagePath(path); !checked) return checked;
  auto file = files::NewFile::Create(path, files::IfThere::kRefuse);
  if (!file) return Fail("page " + file.error().message);
  const bool png = path.extension() == ".png";
  if (png ? !WritePng(page, *file) : !WriteTiff(page, file->fd())) {
    return Fail(fmt::format(
        "page {}: it cannot be written; is there room, and may you write there?", path.string()));
  }
  return file->Commit();
}

}  // namespace trammel::machine
