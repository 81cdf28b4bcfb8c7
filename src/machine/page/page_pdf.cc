#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#define POINTERHOLDER_TRANSITION 4  // std::shared_ptr, as newer releases have it
#include <qpdf/Pipeline.hh>
#include <qpdf/QPDF.hh>
#include <qpdf/QPDFObjectHandle.hh>
#include <qpdf/QPDFPageDocumentHelper.hh>
#include <qpdf/QPDFPageObjectHelper.hh>
#include <string>
#include <string_view>
#include <system_error>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "machine/net/child_limits.h"
#include "machine/net/child_process.h"
#include "machine/page/page_decoders.h"

namespace trammel::machine {
namespace {

constexpr int kMostSeconds = 20;  // of computing

/// What the library may take for a file, bytes.
std::uint64_t MemoryFor(std::uint64_t file_bytes) {
  constexpr std::uint64_t kAlways = std::uint64_t{256} << 20U;
  return kAlways + 4 * file_bytes;
}

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

/// What the child tells of a page, before the bytes of its picture.
struct PdfPicture {
  PageLayout layout;
  bool jpeg = false;
  double sheet_width_pt = 0;
  double sheet_height_pt = 0;
};
static_assert(std::is_trivially_copyable_v<PdfPicture>);

enum Kind : std::uint32_t { kPicture = 1, kBytes, kPageEnds, kFileEnds, kFault };

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
      if (!sender_.Send(kBytes, std::span(data, count))) throw Enough{};
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

Result<PdfPicture> Describe(QPDFObjectHandle picture, std::uint64_t file_bytes,
                            const PageReadOptions& options) {
  QPDFObjectHandle dictionary = picture.getDict();
  PdfPicture told;
  const std::string filter = FilterOf(dictionary);
  told.jpeg = filter == "/DCTDecode" || filter == "/DCT";
  if (told.jpeg) return told;
  double most_packed = 1;
  if (filter == "/FlateDecode") {
    most_packed = 1032;
  } else if (filter == "/LZWDecode") {
    most_packed = 2600;
  } else if (filter == "/RunLengthDecode") {
    most_packed = 64;
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
  if (auto page = MakePage(layout, options); !page) return tl::unexpected(page.error());
  if (auto fits = CheckRaster(layout, most_packed, file_bytes); !fits) {
    return tl::unexpected(fits.error());
  }
  return told;
}

Result<void> SendPage(QPDFPageObjectHelper helper, std::uint64_t file_bytes,
                      const PageReadOptions& options, const ChildSender& sender) {
  auto picture = PictureOf(helper);
  if (!picture) return tl::unexpected(picture.error());
  auto told = Describe(*picture, file_bytes, options);
  if (!told) return tl::unexpected(told.error());
  std::tie(told->sheet_width_pt, told->sheet_height_pt) = SheetOf(helper);
  sender.Send(kPicture, std::span(reinterpret_cast<const std::uint8_t*>(&*told), sizeof *told));
  const std::uint64_t wanted =
      told->jpeg ? file_bytes
                 : RowBytes(told->layout) * static_cast<std::uint64_t>(told->layout.height);
  ToParent pipeline(sender, wanted);
  try {
    picture->pipeStreamData(&pipeline, 0, told->jpeg ? qpdf_dl_none : qpdf_dl_specialized, true);
  } catch (const Enough&) {
  }
  sender.Send(kPageEnds, std::string_view());
  return {};
}

Result<void> SendPages(const std::filesystem::path& path, std::uint64_t file_bytes,
                       const PageReadOptions& options, const ChildSender& sender) {
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
      if (auto sent = SendPage(helper, file_bytes, options, sender); !sent) return sent;
    }
    return {};
  } catch (const std::exception& failure) {
    if (ran_out) {
      return Fail(fmt::format(
          "unpacking it takes more than {} MB, which no scan of {} bytes needs; scan to TIFF",
          MemoryFor(file_bytes) >> 20U, file_bytes));
    }
    return Fail(
        fmt::format("the decoder rejects it ({}); copy it again, or scan to TIFF", failure.what()));
  }
}

// Of a picture that fills the sheet, whichever way it was turned.
void TakeResolution(const PdfPicture& told, Page& page) {
  constexpr double kPointsPerInch = 72;
  constexpr double kMostStretch = 1.05;  // scanners cut the margins off, but not along one axis
  double width = told.sheet_width_pt / kPointsPerInch;
  double height = told.sheet_height_pt / kPointsPerInch;
  if ((page.width > page.height) != (width > height)) std::swap(width, height);
  const double x = page.width / width;
  const double y = page.height / height;
  if (std::isfinite(x) && std::isfinite(y) && x > 0 && x < kMostStretch * y &&
      y < kMostStretch * x) {
    page.dpi_x = x;
    page.dpi_y = y;
  }
}

/// Puts a page together from what the child tells.
class PdfPage {
 public:
  Result<void> Begin(const ChildMessage& message, const PageReadOptions& options) {
    if (message.bytes.size() != sizeof told_) return Fail("its decoder failed; scan to TIFF");
    std::memcpy(&told_, message.bytes.data(), sizeof told_);
    rows_ = 0;
    bytes_.clear();
    if (told_.jpeg) return {};
    auto page = MakePage(told_.layout, options);
    if (!page) return tl::unexpected(page.error());
    page_ = std::move(*page);
    return {};
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
      auto page = DecodeJpeg(bytes_, options);
      if (page) TakeResolution(told_, *page);
      return page;
    }
    if (rows_ < page_.height) {
      return Fail("its picture ends early; copy the file again, or scan again");
    }
    TakeResolution(told_, page_);
    return std::move(page_);
  }

 private:
  PdfPicture told_;
  Page page_;
  int rows_ = 0;
  std::vector<std::uint8_t> bytes_;
};

Result<void> TakePages(ChildProcess& child, std::uint64_t file_bytes,
                       const PageReadOptions& options, const PageSink& sink) {
  constexpr double kSilence_s = 120;  // its seconds of computing are limited; a machine may be busy
  PdfPage page;
  ChildMessage message;
  for (;;) {
    if (child.Receive(message, kSilence_s, {}) != Heard::kMessage) {
      return Fail(fmt::format(
          "its decoder ended without a word ({}): unpacking its {} bytes takes more than {} s or "
          "{} MB, or it is damaged; scan to TIFF",
          child.End(), file_bytes, kMostSeconds, MemoryFor(file_bytes) >> 20U));
    }
    Result<void> taken;
    switch (message.kind) {
      case kPicture:
        taken = page.Begin(message, options);
        break;
      case kBytes:
        page.Add(message);
        break;
      case kPageEnds: {
        auto whole = page.End(options);
        taken = whole ? sink(std::move(*whole)) : tl::unexpected(whole.error());
        break;
      }
      case kFault:
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
  // Nothing bounds what the library unpacks for itself (tables, objects) but the process it is in.
  auto child = ChildProcess::Start(
      [&](const ChildSender& sender) {
        LimitThisProcess(MemoryFor(file_bytes), kMostSeconds);
        const auto sent = SendPages(path, file_bytes, options, sender);
        sender.Send(sent ? kFileEnds : kFault, sent ? std::string_view() : sent.error().message);
      },
      kPatience_s);
  if (!child) return tl::unexpected(child.error());
  return TakePages(*child, file_bytes, options, sink);
}

}  // namespace trammel::machine
