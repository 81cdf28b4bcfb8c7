// trammel-pdf.so.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <new>
#define POINTERHOLDER_TRANSITION 4  // std::shared_ptr, as newer releases have it
#include <qpdf/Pipeline.hh>
#include <qpdf/QPDF.hh>
#include <qpdf/QPDFObjectHandle.hh>
#include <qpdf/QPDFPageDocumentHelper.hh>
#include <qpdf/QPDFPageObjectHelper.hh>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "machine/module/module.h"
#include "machine/page/pdf_module.h"

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

// Width and height of the sheet in points; 0 where it states none.
std::pair<double, double> SheetOf(QPDFPageObjectHelper& helper) {
  QPDFObjectHandle box = helper.getMediaBox();
  if (!box.isRectangle()) return {0, 0};
  const QPDFObjectHandle::Rectangle sheet = box.getArrayAsRectangle();
  return {std::abs(sheet.urx - sheet.llx), std::abs(sheet.ury - sheet.lly)};
}

/// Thrown where all that is wanted has come. No std::exception, which the library would keep.
struct Enough {};

/// Hands on what is unpacked, as it comes, and no more than is wanted.
class ToParent final : public Pipeline {
 public:
  ToParent(const ChildSender& sender, std::uint64_t wanted)
      : Pipeline("to parent", nullptr), sender_(sender), left_(wanted) {}

  void write(unsigned char const* data, std::size_t size) override {
    constexpr std::size_t kPiece = std::size_t{1} << 16U;
    while (size > 0 && left_ > 0) {
      const std::size_t count = std::min({size, kPiece, static_cast<std::size_t>(left_)});
      if (!sender_.Send(kPdfBytes, std::span(data, count))) throw Enough{};
      data += count;
      size -= count;
      left_ -= count;
    }
    if (left_ == 0) throw Enough{};
  }
  void finish() override {}

 private:
  const ChildSender& sender_;
  std::uint64_t left_;
};

std::uint64_t RowBytes(const PageLayout& layout) {
  return static_cast<std::uint64_t>((layout.width * layout.samples * layout.bits + 7) / 8);
}

/// Whether the count of its bytes is a number at all.
bool MayBePage(const PageLayout& layout) {
  constexpr std::int64_t kMost = 1'000'000;
  const auto within = [](std::int64_t number, std::int64_t most) {
    return number > 0 && number <= most;
  };
  return within(layout.width, kMost) && within(layout.height, kMost) && within(layout.samples, 4) &&
         within(layout.bits, 16);
}

Result<PdfPicture> Describe(QPDFObjectHandle picture) {
  QPDFObjectHandle dictionary = picture.getDict();
  PdfPicture told;
  const std::string filter = FilterOf(dictionary);
  told.jpeg = filter == "/DCTDecode" || filter == "/DCT";
  if (told.jpeg) return told;
  if (filter == "/FlateDecode") {
    told.most_packed = 1032;
  } else if (filter == "/LZWDecode") {
    told.most_packed = 2600;
  } else if (filter == "/RunLengthDecode") {
    told.most_packed = 64;
  } else if (!filter.empty()) {
    return Fail(fmt::format("its picture is packed by {}; scan to TIFF, PNG or JPEG", filter));
  }
  PageLayout& layout = told.layout;
  layout.width = Whole(dictionary, "/Width", 0);
  layout.height = Whole(dictionary, "/Height", 0);
  layout.samples = SamplesOf(dictionary.getKey("/ColorSpace"));
  layout.bits = static_cast<int>(Whole(dictionary, "/BitsPerComponent", 0));
  QPDFObjectHandle decode = dictionary.getKey("/Decode");
  layout.white_is_zero = layout.samples == 1 && decode.isArray() && decode.getArrayNItems() == 2 &&
                         decode.getArrayItem(0).isNumber() &&
                         decode.getArrayItem(0).getNumericValue() == 1;
  return told;
}

Result<void> SendPage(QPDFPageObjectHelper helper, std::uint64_t file_bytes,
                      const ChildSender& sender) {
  auto picture = PictureOf(helper);
  if (!picture) return tl::unexpected(picture.error());
  auto told = Describe(*picture);
  if (!told) return tl::unexpected(told.error());
  std::tie(told->sheet_width_pt, told->sheet_height_pt) = SheetOf(helper);
  sender.Send(kPdfPicture, std::span(reinterpret_cast<const std::uint8_t*>(&*told), sizeof *told));
  std::uint64_t wanted = 0;  // of a picture that no page can be: the caller refuses it
  if (told->jpeg) {
    wanted = file_bytes;
  } else if (MayBePage(told->layout)) {
    wanted = RowBytes(told->layout) * static_cast<std::uint64_t>(told->layout.height);
  }
  ToParent pipeline(sender, wanted);
  try {
    picture->pipeStreamData(&pipeline, 0, told->jpeg ? qpdf_dl_none : qpdf_dl_specialized, true);
  } catch (const Enough&) {
  }
  sender.Send(kPdfPageEnds, std::string_view());
  return {};
}

Result<void> SendPages(const std::filesystem::path& path, std::uint64_t file_bytes,
                       std::uint64_t most_bytes, const PageReadOptions& options,
                       const ChildSender& sender) {
  // The library goes on where memory fails it, and then blames the file.
  static bool ran_out = false;
  std::set_new_handler([] {
    ran_out = true;
    throw std::bad_alloc();
  });
  try {
    QPDF pdf;
    pdf.setSuppressWarnings(true);
    pdf.processFile(path.c_str());
    std::vector<QPDFPageObjectHelper> helpers = QPDFPageDocumentHelper(pdf).getAllPages();
    if (helpers.empty() || helpers.size() > static_cast<std::size_t>(options.most_pages)) {
      return Fail(
          fmt::format("it has {} pages; 1 to {} are read", helpers.size(), options.most_pages));
    }
    for (QPDFPageObjectHelper& helper : helpers) {
      if (auto sent = SendPage(helper, file_bytes, sender); !sent) return sent;
    }
    return {};
  } catch (const std::exception& failure) {
    if (ran_out) {
      return Fail(fmt::format(
          "unpacking it takes more than {} MB, which no scan of {} bytes needs; scan to TIFF",
          most_bytes >> 20U, file_bytes));
    }
    return Fail(
        fmt::format("the decoder rejects it ({}); copy it again, or scan to TIFF", failure.what()));
  }
}

constexpr PdfModule kModule = {SendPages};

}  // namespace
}  // namespace trammel::machine

TRAMMEL_MODULE(trammel::machine::kModule)
