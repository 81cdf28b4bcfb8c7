#include <fmt/format.h>

#include <cmath>
#include <exception>
#define POINTERHOLDER_TRANSITION 4  // std::shared_ptr, as newer releases have it
#include <qpdf/Buffer.hh>
#include <qpdf/QPDF.hh>
#include <qpdf/QPDFObjectHandle.hh>
#include <qpdf/QPDFPageDocumentHelper.hh>
#include <qpdf/QPDFPageObjectHelper.hh>
#include <string>

#include "machine/page_decoders.h"

namespace trammel::machine {
namespace {

std::int64_t Whole(QPDFObjectHandle dictionary, const char* key, std::int64_t otherwise) {
  QPDFObjectHandle value = dictionary.getKey(key);
  return value.isInteger() ? value.getIntValue() : otherwise;
}

double Pixels(QPDFObjectHandle picture) {
  QPDFObjectHandle dictionary = picture.getDict();
  return static_cast<double>(Whole(dictionary, "/Width", 0)) *
         static_cast<double>(Whole(dictionary, "/Height", 0));
}

// The one picture that a scanner puts on a page; logos and masks may lie beside it.
Result<QPDFObjectHandle> PictureOf(QPDFPageObjectHelper& page) {
  constexpr double kMostBeside = 0.1;  // of its pixels
  std::vector<QPDFObjectHandle> pictures;
  page.forEachImage(true, [&](QPDFObjectHandle& picture, QPDFObjectHandle& /*holder*/,
                              const std::string& /*key*/) { pictures.push_back(picture); });
  if (pictures.empty()) {
    return Fail("it holds no picture; scan to TIFF, PNG or JPEG");
  }
  std::size_t largest = 0;
  for (std::size_t i = 1; i < pictures.size(); ++i) {
    if (Pixels(pictures[i]) > Pixels(pictures[largest])) largest = i;
  }
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (i != largest && Pixels(pictures[i]) > kMostBeside * Pixels(pictures[largest])) {
      return Fail(fmt::format(
          "it is put together from {} pictures, whose edges would pass for lines; scan to TIFF, "
          "PNG or JPEG",
          pictures.size()));
    }
  }
  return pictures[largest];
}

// Samples per pixel; 0 for colours that are not read.
int SamplesOf(QPDFObjectHandle space) {
  const std::string name =
      space.isArray() && space.getArrayNItems() > 0
          ? (space.getArrayItem(0).isName() ? space.getArrayItem(0).getName() : std::string())
          : (space.isName() ? space.getName() : std::string());
  if (name == "/DeviceGray" || name == "/CalGray" || name == "/G") return 1;
  if (name == "/DeviceRGB" || name == "/CalRGB" || name == "/RGB") return 3;
  if (name == "/ICCBased" && space.getArrayNItems() > 1 && space.getArrayItem(1).isStream()) {
    const std::int64_t count = Whole(space.getArrayItem(1).getDict(), "/N", 0);
    return count == 1 || count == 3 ? static_cast<int>(count) : 0;
  }
  return 0;
}

std::string FilterOf(QPDFObjectHandle dictionary) {
  QPDFObjectHandle filter = dictionary.getKey("/Filter");
  if (filter.isName()) return filter.getName();
  if (filter.isArray() && filter.getArrayNItems() == 1 && filter.getArrayItem(0).isName()) {
    return filter.getArrayItem(0).getName();
  }
  return filter.isNull() ? "" : "several filters";
}

Result<Page> DecodeSamples(QPDFObjectHandle picture, const PageReadOptions& options) {
  QPDFObjectHandle dictionary = picture.getDict();
  PageLayout layout;
  layout.width = Whole(dictionary, "/Width", 0);
  layout.height = Whole(dictionary, "/Height", 0);
  layout.samples = SamplesOf(dictionary.getKey("/ColorSpace"));
  layout.bits = static_cast<int>(Whole(dictionary, "/BitsPerComponent", 0));
  QPDFObjectHandle decode = dictionary.getKey("/Decode");
  layout.white_is_zero = layout.samples == 1 && decode.isArray() && decode.getArrayNItems() == 2 &&
                         decode.getArrayItem(0).isNumber() &&
                         decode.getArrayItem(0).getNumericValue() == 1;
  auto page = MakePage(layout, options);
  if (!page) return page;
  const auto data = picture.getStreamData(qpdf_dl_specialized);
  const auto row = static_cast<std::size_t>((layout.width * layout.samples * layout.bits + 7) / 8);
  if (data->getSize() < row * static_cast<std::size_t>(page->height)) {
    return Fail("its picture ends early; copy the file again, or scan again");
  }
  for (int y = 0; y < page->height; ++y) {
    std::vector<std::uint8_t> wide;
    std::span<const std::uint8_t> samples(data->getBuffer() + row * static_cast<std::size_t>(y),
                                          row);
    if (layout.bits == 16) {  // high byte first
      wide.assign(samples.begin(), samples.end());
      for (std::size_t i = 0; i + 1 < row; i += 2) std::swap(wide[i], wide[i + 1]);
      samples = wide;
    }
    FillRow(layout, samples, y, *page);
  }
  return page;
}

// Of a picture that fills the sheet, whichever way it was turned.
void TakeResolution(QPDFPageObjectHelper& helper, Page& page) {
  constexpr double kPointsPerInch = 72;
  constexpr double kMostStretch = 1.05;  // scanners cut the margins off, but not along one axis
  QPDFObjectHandle box = helper.getMediaBox();
  if (!box.isRectangle()) return;
  const QPDFObjectHandle::Rectangle sheet = box.getArrayAsRectangle();
  double width = std::abs(sheet.urx - sheet.llx) / kPointsPerInch;
  double height = std::abs(sheet.ury - sheet.lly) / kPointsPerInch;
  if ((page.width > page.height) != (width > height)) std::swap(width, height);
  const double x = page.width / width;
  const double y = page.height / height;
  if (std::isfinite(x) && std::isfinite(y) && x > 0 && x < kMostStretch * y &&
      y < kMostStretch * x) {
    page.dpi_x = x;
    page.dpi_y = y;
  }
}

Result<Page> ReadPage(QPDFPageObjectHelper helper, const PageReadOptions& options) {
  const auto picture = PictureOf(helper);
  if (!picture) return tl::unexpected(picture.error());
  const std::string filter = FilterOf(QPDFObjectHandle(*picture).getDict());
  Result<Page> page = Fail("");
  if (filter == "/DCTDecode" || filter == "/DCT") {
    const auto raw = QPDFObjectHandle(*picture).getRawStreamData();
    page = DecodeJpeg({raw->getBuffer(), raw->getSize()}, options);
  } else if (filter.empty() || filter == "/FlateDecode" || filter == "/LZWDecode" ||
             filter == "/RunLengthDecode") {
    page = DecodeSamples(*picture, options);
  } else {
    return Fail(fmt::format("its picture is packed by {}; scan to TIFF, PNG or JPEG", filter));
  }
  if (page) TakeResolution(helper, *page);
  return page;
}

}  // namespace

Pages ReadPdf(const std::filesystem::path& path, const PageReadOptions& options) {
  try {
    QPDF pdf;
    pdf.setSuppressWarnings(true);
    pdf.processFile(path.c_str());
    std::vector<QPDFPageObjectHelper> helpers = QPDFPageDocumentHelper(pdf).getAllPages();
    if (helpers.empty() || helpers.size() > static_cast<std::size_t>(options.most_pages)) {
      return Fail(
          fmt::format("it has {} pages; 1 to {} are read", helpers.size(), options.most_pages));
    }
    std::vector<Page> pages;
    for (QPDFPageObjectHelper& helper : helpers) {
      auto page = ReadPage(helper, options);
      if (!page) return tl::unexpected(page.error());
      pages.push_back(std::move(*page));
    }
    return pages;
  } catch (const std::exception& failure) {
    return Fail(
        fmt::format("the decoder rejects it ({}); copy it again, or scan to TIFF", failure.what()));
  }
}

}  // namespace trammel::machine
