// The data of an SVG path.
#pragma once

#include <cstdint>
#include <string>

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

}  // namespace trammel::report
