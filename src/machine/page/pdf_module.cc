// trammel-pdf.so.
#ifndef POINTERHOLDER_TRANSITION
#define POINTERHOLDER_TRANSITION 4  // std::shared_ptr, as newer releases have it
#endif
#include "machine/page/pdf_module.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <new>
#include <optional>
#include <qpdf/Pipeline.hh>
#include <qpdf/QPDF.hh>
#include <qpdf/QPDFMatrix.hh>
#include <qpdf/QPDFObjectHandle.hh>
#include <qpdf/QPDFPageDocumentHelper.hh>
#include <qpdf/QPDFPageObjectHelper.hh>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "machine/module/module.h"

namespace trammel::machine {
namespace {

/// Picture, or a mask through which a colour is drawn.
struct DrawnPicture {
  QPDFObjectHandle picture;
  QPDFMatrix sheet_from_picture;  ///< unit square, y upwards, to points

  /// True if its rows run up the sheet, or it is mirrored: viewers show it the other way round.
  [[nodiscard]] bool mirrored() const;
  [[nodiscard]] double width_pt() const;
  [[nodiscard]] double height_pt() const;
  [[nodiscard]] double area_pt2() const;
};

std::string NameAt(QPDFObjectHandle dictionary, const char* key) {
  QPDFObjectHandle value = dictionary.getKey(key);
  return value.isName() ? value.getName() : std::string();
}

/// Follows the operators that place pictures, including forms.
class Drawing final : public QPDFObjectHandle::ParserCallbacks {
 public:
  Drawing(const QPDFPageObjectHelper& holder, QPDFMatrix matrix, int depth,
          std::vector<DrawnPicture>& drawn)
      : holder_(holder), matrix_(matrix), depth_(depth), drawn_(drawn) {}

  void Follow() { holder_.parseContents(this); }

  void handleObject(QPDFObjectHandle object) override {
    if (!object.isOperator()) {
      constexpr std::size_t kMaxOperands = 1000;
      if (operands_.size() < kMaxOperands) operands_.push_back(object);
      if (object.isInlineImage()) drawn_.push_back({object, matrix_});
      return;
    }
    const std::string name = object.getOperatorValue();
    if (name == "q") {
      constexpr std::size_t kMaxSaved = 1000;
      if (saved_.size() < kMaxSaved) saved_.push_back(matrix_);
    } else if (name == "Q" && !saved_.empty()) {
      matrix_ = saved_.back();
      saved_.pop_back();
    } else if (name == "cm") {
      Concatenate();
    } else if (name == "Do" && !operands_.empty() && operands_.back().isName()) {
      Draw(operands_.back().getName());
    }
    operands_.clear();
  }
  void handleEOF() override {}

 private:
  void Concatenate() {
    constexpr std::size_t kNumbers = 6;
    if (operands_.size() != kNumbers) return;
    const auto number = [&](std::size_t i) {
      return operands_[i].isNumber() ? operands_[i].getNumericValue() : 0;
    };
    matrix_.concat({number(0), number(1), number(2), number(3), number(4), number(5)});
  }

  void Draw(const std::string& name) {
    constexpr int kDeepest = 8;
    QPDFObjectHandle resources = holder_.getAttribute("/Resources", false);
    QPDFObjectHandle objects =
        resources.isDictionary() ? resources.getKey("/XObject") : QPDFObjectHandle();
    if (!objects.isInitialized() || !objects.isDictionary()) return;
    QPDFObjectHandle object = objects.getKey(name);
    if (!object.isStream()) return;
    const std::string kind = NameAt(object.getDict(), "/Subtype");
    if (kind == "/Image") drawn_.push_back({object, matrix_});
    if (kind != "/Form" || depth_ >= kDeepest) return;
    QPDFMatrix matrix = matrix_;
    QPDFObjectHandle own = object.getDict().getKey("/Matrix");
    if (own.isMatrix()) matrix.concat(own.getArrayAsMatrix());
    Drawing(QPDFPageObjectHelper(object), matrix, depth_ + 1, drawn_).Follow();
  }

  QPDFPageObjectHelper holder_;
  QPDFMatrix matrix_;
  int depth_;
  std::vector<DrawnPicture>& drawn_;
  std::vector<QPDFMatrix> saved_;
  std::vector<QPDFObjectHandle> operands_;
};

bool DrawnPicture::mirrored() const {
  const QPDFMatrix& m = sheet_from_picture;
  return m.a * m.d - m.b * m.c < 0;
}
double DrawnPicture::width_pt() const {
  return std::hypot(sheet_from_picture.a, sheet_from_picture.b);
}
double DrawnPicture::height_pt() const {
  return std::hypot(sheet_from_picture.c, sheet_from_picture.d);
}
double DrawnPicture::area_pt2() const {
  const QPDFMatrix& m = sheet_from_picture;
  return std::abs(m.a * m.d - m.b * m.c);
}

/// Returns the one picture that a scanner puts on a page, possibly beside logos. Errors: no
/// picture, several that share the page (strips, or the layers of a compact PDF), one that is drawn
/// askew.
Result<DrawnPicture> PictureOf(QPDFPageObjectHelper& page) {
  constexpr double kMaxBeside = 0.1;  // share of its area
  constexpr double kAskew = 1e-3;
  std::vector<DrawnPicture> drawn;
  Drawing(page, QPDFMatrix(), 0, drawn).Follow();
  if (drawn.empty()) return Fail("it holds no picture; scan to TIFF, PNG or JPEG");
  const auto largest = std::max_element(
      drawn.begin(), drawn.end(),
      [](const auto& left, const auto& right) { return left.area_pt2() < right.area_pt2(); });
  const auto sharing = std::count_if(drawn.begin(), drawn.end(), [&](const auto& picture) {
    return picture.area_pt2() > kMaxBeside * largest->area_pt2();
  });
  if (sharing > 1) {
    return Fail(
        fmt::format("it is put together from {} pictures (strips, or the layers of a compact PDF), "
                    "whose edges would pass for lines; scan to TIFF, PNG or JPEG",
                    drawn.size()));
  }
  if (largest->picture.isInlineImage()) {
    return Fail("its picture lies within the page's text; scan to TIFF, PNG or JPEG");
  }
  const QPDFMatrix& m = largest->sheet_from_picture;
  if (std::abs(m.a * m.c + m.b * m.d) > kAskew * largest->area_pt2()) {
    return Fail("its picture is drawn askew; scan to TIFF, PNG or JPEG");
  }
  return *largest;
}

std::int64_t Whole(QPDFObjectHandle dictionary, const char* key, std::int64_t otherwise) {
  QPDFObjectHandle value = dictionary.getKey(key);
  return value.isInteger() ? value.getIntValue() : otherwise;
}

// Returns the samples per pixel; 0 for unsupported colours.
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

/// Thrown once all wanted data arrived. Not a std::exception, which the library would catch.
struct Enough {};

/// Passes on unpacked data as it arrives, and no more than is wanted.
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

/// Palette of a picture with indexed samples.
struct Palette {
  int bits = 0;                      ///< per colour index: 1, 2, 4 or 8
  std::vector<std::uint8_t> colour;  ///< layout.samples each
};

/// Replaces indices by colours, row by row.
class Expand final : public Pipeline {
 public:
  Expand(const PageLayout& layout, const Palette& palette, Pipeline& next)
      : Pipeline("palette", &next),
        palette_(palette),
        samples_(static_cast<std::size_t>(layout.samples)),
        packed_(static_cast<std::size_t>((layout.width * palette.bits + 7) / 8)),
        row_(static_cast<std::size_t>(layout.width) * samples_) {}

  void write(unsigned char const* data, std::size_t size) override {
    for (std::size_t i = 0; i < size; ++i) {
      packed_[filled_++] = data[i];
      if (filled_ < packed_.size()) continue;
      filled_ = 0;
      WriteRow();
    }
  }
  void finish() override {}

 private:
  void WriteRow() {
    const auto bits = static_cast<std::size_t>(palette_.bits);
    const std::size_t colours = palette_.colour.size() / samples_;
    for (std::size_t x = 0; x * samples_ < row_.size(); ++x) {
      const std::size_t at = x * bits;
      const std::size_t number = packed_[at / 8] >> (8 - bits - at % 8) & ((1U << bits) - 1U);
      const std::size_t colour = std::min(number, colours - 1);
      std::copy_n(palette_.colour.begin() + static_cast<std::ptrdiff_t>(colour * samples_),
                  samples_, row_.begin() + static_cast<std::ptrdiff_t>(x * samples_));
    }
    getNext()->write(row_.data(), row_.size());
  }

  const Palette& palette_;
  std::size_t samples_;
  std::vector<std::uint8_t> packed_;
  std::vector<std::uint8_t> row_;
  std::size_t filled_ = 0;
};

std::uint64_t RowBytes(const PageLayout& layout) {
  return static_cast<std::uint64_t>((layout.width * layout.samples * layout.bits + 7) / 8);
}

/// True if its size in bytes fits into a number.
bool MayBePage(const PageLayout& layout) {
  constexpr std::int64_t kMax = 1'000'000;
  const auto within = [](std::int64_t number, std::int64_t most) {
    return number > 0 && number <= most;
  };
  return within(layout.width, kMax) && within(layout.height, kMax) && within(layout.samples, 4) &&
         within(layout.bits, 16);
}

/// Returns the colours of an indexed picture; empty for any other.
Result<Palette> PaletteOf(QPDFObjectHandle dictionary, PageLayout& layout) {
  constexpr int kParts = 4;  // /Indexed, the colours' space, the highest number, the colours
  QPDFObjectHandle space = dictionary.getKey("/ColorSpace");
  if (!space.isArray() || space.getArrayNItems() != kParts || !space.getArrayItem(0).isName()) {
    return Palette{};
  }
  const std::string name = space.getArrayItem(0).getName();
  if (name != "/Indexed" && name != "/I") return Palette{};
  QPDFObjectHandle table = space.getArrayItem(3);
  Palette palette;
  palette.bits = layout.bits;
  if (table.isString()) {
    const std::string text = table.getStringValue();
    palette.colour.assign(text.begin(), text.end());
  } else if (table.isStream()) {
    const auto bytes = table.getStreamData(qpdf_dl_specialized);
    palette.colour.assign(bytes->getBuffer(), bytes->getBuffer() + bytes->getSize());
  }
  layout.samples = SamplesOf(space.getArrayItem(1));
  const bool whole = layout.bits == 1 || layout.bits == 2 || layout.bits == 4 || layout.bits == 8;
  if (!whole || layout.samples == 0 ||
      palette.colour.size() < static_cast<std::size_t>(layout.samples)) {
    return Fail("its colours are a palette that is not read; scan to TIFF, PNG or JPEG");
  }
  layout.bits = 8;
  return palette;
}

Result<PdfPicture> Describe(QPDFObjectHandle picture, Palette& palette) {
  QPDFObjectHandle dictionary = picture.getDict();
  PdfPicture told;
  const std::string filter = FilterOf(dictionary);
  told.jpeg = filter == "/DCTDecode" || filter == "/DCT";
  if (told.jpeg) return told;
  if (filter == "/FlateDecode") {
    told.max_packed = 1032;
  } else if (filter == "/LZWDecode") {
    told.max_packed = 2600;
  } else if (filter == "/RunLengthDecode") {
    told.max_packed = 64;
  } else if (!filter.empty()) {
    return Fail(fmt::format("its picture is packed by {}; scan to TIFF, PNG or JPEG", filter));
  }
  PageLayout& layout = told.layout;
  layout.width = Whole(dictionary, "/Width", 0);
  layout.height = Whole(dictionary, "/Height", 0);
  // Through a mask the page's colour is drawn where samples are 0: black on white.
  QPDFObjectHandle is_mask = dictionary.getKey("/ImageMask");
  const bool mask = is_mask.isBool() && is_mask.getBoolValue();
  layout.samples = mask ? 1 : SamplesOf(dictionary.getKey("/ColorSpace"));
  layout.bits = mask ? 1 : static_cast<int>(Whole(dictionary, "/BitsPerComponent", 0));
  auto colours = TRY(PaletteOf(dictionary, layout));
  palette = std::move(colours);
  if (palette.bits > 0) told.max_packed *= 8.0 * layout.samples / palette.bits;
  QPDFObjectHandle decode = dictionary.getKey("/Decode");
  layout.white_is_zero = layout.samples == 1 && palette.bits == 0 && decode.isArray() &&
                         decode.getArrayNItems() == 2 && decode.getArrayItem(0).isNumber() &&
                         decode.getArrayItem(0).getNumericValue() == 1;
  return told;
}

/// Rejects a mask finer than the picture: it contains the printed shapes, and the picture only
/// their colours.
Result<void> CheckMask(QPDFObjectHandle dictionary) {
  for (const char* key : {"/SMask", "/Mask"}) {
    QPDFObjectHandle mask = dictionary.getKey(key);
    if (!mask.isStream()) continue;
    if (Whole(mask.getDict(), "/Width", 0) > Whole(dictionary, "/Width", 0)) {
      return Fail(
          "it is put together from layers (a compact PDF): its shapes lie in a mask; scan to TIFF, "
          "PNG or JPEG");
    }
  }
  return {};
}

Result<void> SendPage(QPDFPageObjectHelper helper, std::uint64_t file_bytes,
                      const ChildSender& sender) {
  const auto drawn = TRY(PictureOf(helper));
  QPDFObjectHandle picture = drawn.picture;
  TRY(CheckMask(picture.getDict()));
  Palette palette;
  auto told = TRY(Describe(picture, palette));
  told.width_pt = drawn.width_pt();
  told.height_pt = drawn.height_pt();
  told.mirrored = drawn.mirrored();
  sender.Send(kPdfPicture, std::span(reinterpret_cast<const std::uint8_t*>(&told), sizeof told));
  std::uint64_t wanted = 0;  // 0 if the picture cannot be a page: the caller refuses it
  if (told.jpeg) {
    wanted = file_bytes;
  } else if (MayBePage(told.layout)) {
    wanted = RowBytes(told.layout) * static_cast<std::uint64_t>(told.layout.height);
  }
  ToParent to_parent(sender, wanted);
  std::optional<Expand> expand;
  if (palette.bits > 0 && MayBePage(told.layout)) expand.emplace(told.layout, palette, to_parent);
  try {
    picture.pipeStreamData(expand ? static_cast<Pipeline*>(&*expand) : &to_parent, 0,
                           told.jpeg ? qpdf_dl_none : qpdf_dl_specialized, true);
  } catch (const Enough&) {
  }
  sender.Send(kPdfPageEnds, std::string_view());
  return {};
}

Result<void> SendPages(const std::filesystem::path& path, std::uint64_t file_bytes,
                       std::uint64_t max_bytes, const PageReadOptions& options,
                       const ChildSender& sender) {
  // Without memory the library continues, and then reports a damaged file.
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
    if (helpers.empty() || helpers.size() > static_cast<std::size_t>(options.max_pages)) {
      return Fail(
          fmt::format("it has {} pages; 1 to {} are read", helpers.size(), options.max_pages));
    }
    for (QPDFPageObjectHelper& helper : helpers) TRY(SendPage(helper, file_bytes, sender));
    return {};
  } catch (const std::exception& failure) {
    if (ran_out) {
      return Fail(fmt::format(
          "unpacking it takes more than {} MB, which no scan of {} bytes needs; scan to TIFF",
          max_bytes >> 20U, file_bytes));
    }
    return Fail(
        fmt::format("the decoder rejects it ({}); copy it again, or scan to TIFF", failure.what()));
  }
}

constexpr PdfModule kModule = {SendPages};

}  // namespace
}  // namespace trammel::machine

TRAMMEL_MODULE(trammel::machine::kModule)
