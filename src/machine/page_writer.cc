#include "machine/page_writer.h"

#include <fmt/format.h>
#include <png.h>
#include <tiffio.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <vector>

#include "files/new_file.h"

namespace trammel::machine {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

// RGB, as both formats have it.
void TakeRow(const Page& page, int y, std::vector<std::uint8_t>& row) {
  const std::uint8_t* from = page.view().row(y);
  row.assign(from, from + page.stride());
  if (page.channels == 3) {
    for (std::size_t i = 0; i + 2 < row.size(); i += 3) std::swap(row[i], row[i + 2]);
  }
}

// The library's errors jump: nothing with a destructor may live here.
bool WritePngRows(png_structp png, png_infop info, std::FILE* file, const Page& page,
                  std::vector<std::uint8_t>& row) {
  constexpr double kInchesPerMeter = 1 / 0.0254;
  constexpr int kFast = 3;  // zlib; a scan's noise does not pack well anyway
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_init_io(png, file);
  png_set_compression_level(png, kFast);
  png_set_IHDR(png, info, static_cast<png_uint_32>(page.width),
               static_cast<png_uint_32>(page.height), 8,
               page.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (page.dpi_x && page.dpi_y) {
    png_set_pHYs(png, info, static_cast<png_uint_32>(*page.dpi_x * kInchesPerMeter + 0.5),
                 static_cast<png_uint_32>(*page.dpi_y * kInchesPerMeter + 0.5),
                 PNG_RESOLUTION_METER);
  }
  png_write_info(png, info);
  for (int y = 0; y < page.height; ++y) {
    TakeRow(page, y, row);
    png_write_row(png, row.data());
  }
  png_write_end(png, nullptr);
  return true;
}

bool WritePng(const Page& page, int fd) {
  const File file(fdopen(dup(fd), "wb"));
  if (!file) return false;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  std::vector<std::uint8_t> row;
  const bool written = info != nullptr && WritePngRows(png, info, file.get(), page, row);
  png_destroy_write_struct(&png, &info);
  return written && std::fflush(file.get()) == 0;
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
  if (png ? !WritePng(page, file->fd()) : !WriteTiff(page, file->fd())) {
    return Fail(fmt::format(
        "page {}: it cannot be written; is there room, and may you write there?", path.string()));
  }
  return file->Commit();
}

}  // namespace trammel::machine
