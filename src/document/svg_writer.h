// Writes SVG: paths, shared ids, pictures within it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/frame.h"
#include "document/canvas.h"

namespace trammel::report {

/// Writes places to a tenth of a px, which is finer than a screen shows, those along a line by
/// their distance from the one before: half of the letters. Points must be finite and within 1e9
/// px.
class SvgPath {
 public:
  void MoveTo(const PointPx& point);
  /// REQUIRES a MoveTo before.
  void LineTo(const PointPx& point);
  void Close() { text_ += 'z'; }
  /// A line without length: a disc, where ends are round.
  void Dot(const PointPx& point);

  [[nodiscard]] bool empty() const { return text_.empty(); }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  struct Tenths {
    std::int64_t x = 0;
    std::int64_t y = 0;
  };
  [[nodiscard]] static Tenths Rounded(const PointPx& point);
  void Append(const Tenths& to, const Tenths& from);

  std::string text_;
  Tenths end_;
  bool begun_ = false;  ///< a line, since the last MoveTo
};

/// Not thread-safe. Points must be finite.
class SvgWriter {
 public:
  /// Appends to one path, a new part of it after each break.
  void BeginPath();
  void MoveTo(const PointPx& point);
  void LineTo(const PointPx& point);
  void ClosePath();
  void EndPath(const std::optional<Color>& fill, const std::optional<Stroke>& stroke);

  /// Equal filled discs in a row become one path.
  void Circle(const PointPx& centre, double radius_px, const std::optional<Color>& fill,
              const std::optional<Stroke>& edge);
  /// @param width_px  that the text has on the canvas: kept where the browser's letters differ.
  void Text(const PointPx& at, std::string_view text, const TextStyle& style, double width_px);
  /// @param bytes  of a file of this type: "png", "jpeg".
  void Image(const RectPx& to, std::string_view type, std::string_view bytes, bool enlarged);
  /// Keeps the pixels until the drawing is written: only then is it known how finely.
  void Photo(const RectPx& to, Frame picture);
  void Clip(const RectPx& rect);
  void Unclip();

  /// A file of its own, its photos in full detail.
  [[nodiscard]] std::string File(double width_px, double height_px) const;
  /// An element of an HTML page; `label` says what is seen to those who do not see it.
  [[nodiscard]] std::string Element(double width_px, double height_px, std::string_view label,
                                    const PhotoDetail& detail) const;

 private:
  struct PlacedPhoto {
    std::size_t at = 0;  ///< in the body, before which it comes
    RectPx to;
    Frame picture;
  };
  [[nodiscard]] std::string Content(const PhotoDetail& detail) const;
  void FlushDots();
  void FlushPoint();

  std::string body_;
  std::vector<PlacedPhoto> photos_;  ///< in the body's order
  SvgPath path_;
  PointPx last_;                    ///< of the path
  std::optional<PointPx> waiting_;  ///< too near to it to be seen
  SvgPath dots_;                    ///< of discs that are not written yet
  std::string dots_style_;          ///< theirs
};

/// Cairo numbers some elements by a counter of the whole process, so that the same drawing differs
/// from one call to the next. Here every id that ends in a number is numbered anew in the order of
/// its first mention, with its references.
[[nodiscard]] std::string RenumberSvgIds(std::string_view svg);

/// Reduces a picture to a size in px, rounded, each pixel the mean of those that it covers; a side
/// that is shorter than asked for stays as it is. REQUIRES a picture that is not empty.
[[nodiscard]] Frame Reduced(const BgrView& image, double most_width, double most_height);

}  // namespace trammel::report
