#include "document/svg_path.h"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstdlib>

namespace trammel::report {
namespace {

/// "12", "-3.4", ".5": no more than SVG needs.
std::string Number(std::int64_t tenths) {
  const std::int64_t size = std::abs(tenths);
  std::string text = tenths < 0 ? "-" : "";
  if (size >= 10 || size == 0) text += fmt::format("{}", size / 10);
  if (size % 10 != 0) text += fmt::format(".{}", size % 10);
  return text;
}

}  // namespace

SvgPath::Tenths SvgPath::Rounded(const PointPx& point) {
  return {std::llround(point.x * 10), std::llround(point.y * 10)};
}

void SvgPath::Append(const Tenths& to, const Tenths& from) {
  const std::string x = Number(to.x - from.x);
  const std::string y = Number(to.y - from.y);
  const bool after_number = std::isalpha(static_cast<unsigned char>(text_.back())) == 0;
  if (after_number && x[0] != '-') text_ += ' ';
  text_ += x;
  if (y[0] != '-') text_ += ' ';
  text_ += y;
  end_ = to;
}

void SvgPath::MoveTo(const PointPx& point) {
  text_ += 'M';
  Append(Rounded(point), {});
  begun_ = false;
}

void SvgPath::LineTo(const PointPx& point) {
  if (!begun_) text_ += 'l';
  begun_ = true;
  Append(Rounded(point), end_);
}

void SvgPath::Dot(const PointPx& point) {
  MoveTo(point);
  text_ += "h0";
}

}  // namespace trammel::report
