// Writes SVG: paths, shared ids, embedded pictures.
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

/// Writes coordinates to a tenth of a px, finer than a screen shows, along a line relative to the
/// previous point: half of the characters. Points must be finite and within 1e9 px.
class SvgPath {
 public:
  void MoveTo(const PointPx& point);
  /// REQUIRES an earlier MoveTo.
  void LineTo(const PointPx& point);
  void Close() { text_ += 'z'; }
  /// Appends a line of zero length: a disc, where ends are round.
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
  /// Starts a path; each break begins a new part of it.
  void BeginPath();
  void MoveTo(const PointPx& point);
  void LineTo(const PointPx& point);
  void ClosePath();
  void EndPath(const std::optional<Color>& fill, const std::optional<Stroke>& stroke);

  /// Merges equal filled discs in a row into one path.
  void Circle(const PointPx& centre, double radius_px, const std::optional<Color>& fill,
              const std::optional<Stroke>& edge);
  /// @param width_px  that the text has on the canvas: kept where the browser's letters differ.
  void Text(const PointPx& at, std::string_view text, const TextStyle& style, double width_px);
  /// @param bytes  of a file of this type: "png", "jpeg".
  void Image(const RectPx& to, std::string_view type, std::string_view bytes, bool enlarged);
  /// Stores the pixels until the drawing is written, when the resolution is known.
  void Photo(const RectPx& to, Frame picture);
  void Clip(const RectPx& rect);
  void Unclip();

  /// Returns a separate file, its photos in full detail.
  [[nodiscard]] std::string File(double width_px, double height_px) const;
  /// Returns an element of an HTML page; `label` is its text alternative.
  [[nodiscard]] std::string Element(double width_px, double height_px, std::string_view label,
                                    const PhotoDetail& detail) const;

 private:
  struct PlacedPhoto {
    std::size_t at = 0;  ///< insertion offset in the body
    RectPx to;
    Frame picture;
  };
  [[nodiscard]] std::string Content(const PhotoDetail& detail) const;
  void FlushDots();
  void FlushPoint();

  std::string body_;
  std::vector<PlacedPhoto> photos_;  ///< in body order
  SvgPath path_;
  PointPx last_;                    ///< path's last point
  std::optional<PointPx> waiting_;  ///< too near to it to be seen
  SvgPath dots_;                    ///< discs not yet written
  std::string dots_style_;          ///< theirs
};

/// Renumbers every id that ends in a number in the order of first mention, with its references.
/// Cairo numbers some elements by a counter of the whole process, so that the same drawing differs
/// from one call to the next.
[[nodiscard]] std::string RenumberSvgIds(std::string_view svg);

/// Reduces a picture to a size in px, rounded, each pixel the mean of those that it covers. A side
/// that is already shorter is unchanged. REQUIRES a picture that is not empty.
[[nodiscard]] Frame Reduced(const BgrView& image, double max_width, double max_height);

}  // namespace trammel::report
