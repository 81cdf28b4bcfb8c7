// Writes strokes as SVG: short paths, letters as text, colours by their names in the palette, so
// that a page's style can turn them for the dark (document/color.h).
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/frame.h"
#include "document/canvas.h"
#include "document/svg_path.h"

namespace trammel::report {

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

}  // namespace trammel::report
