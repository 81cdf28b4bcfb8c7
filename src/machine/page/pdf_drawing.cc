#include "machine/page/pdf_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

namespace trammel::machine {
namespace {

std::string NameAt(QPDFObjectHandle dictionary, const char* key) {
  QPDFObjectHandle value = dictionary.getKey(key);
  return value.isName() ? value.getName() : std::string();
}

/// Follows the operators that place pictures, into forms as well.
class Drawing final : public QPDFObjectHandle::ParserCallbacks {
 public:
  Drawing(const QPDFPageObjectHelper& holder, QPDFMatrix matrix, int depth,
          std::vector<DrawnPicture>& drawn)
      : holder_(holder), matrix_(matrix), depth_(depth), drawn_(drawn) {}

  void Follow() { holder_.parseContents(this); }

  void handleObject(QPDFObjectHandle object) override {
    if (!object.isOperator()) {
      constexpr std::size_t kMostOperands = 1000;
      if (operands_.size() < kMostOperands) operands_.push_back(object);
      if (object.isInlineImage()) drawn_.push_back({object, matrix_});
      return;
    }
    const std::string name = object.getOperatorValue();
    if (name == "q") {
      constexpr std::size_t kMostSaved = 1000;
      if (saved_.size() < kMostSaved) saved_.push_back(matrix_);
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

}  // namespace

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

Result<DrawnPicture> PictureOf(QPDFPageObjectHelper& page) {
  constexpr double kMostBeside = 0.1;  // of its area
  constexpr double kAskew = 1e-3;
  std::vector<DrawnPicture> drawn;
  Drawing(page, QPDFMatrix(), 0, drawn).Follow();
  if (drawn.empty()) return Fail("it holds no picture; scan to TIFF, PNG or JPEG");
  const auto largest = std::max_element(
      drawn.begin(), drawn.end(),
      [](const auto& left, const auto& right) { return left.area_pt2() < right.area_pt2(); });
  const auto sharing = std::count_if(drawn.begin(), drawn.end(), [&](const auto& picture) {
    return picture.area_pt2() > kMostBeside * largest->area_pt2();
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

}  // namespace trammel::machine
