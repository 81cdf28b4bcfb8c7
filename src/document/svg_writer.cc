#include "document/svg_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <utility>

#include "base/check.h"
#include "document/page.h"
#include "image/jpeg_writer.h"

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

namespace {

/// Returns the source pixels covered by one of `target` pixels.
std::pair<int, int> Covered(int i, int target, int source) {
  const auto first = static_cast<int>(std::int64_t{i} * source / target);
  const auto last = static_cast<int>((std::int64_t{i} + 1) * source / target);
  return {first, std::max(first + 1, last)};
}

}  // namespace

Frame Reduced(const BgrView& image, double max_width, double max_height) {
  Frame out(std::clamp(static_cast<int>(std::lround(max_width)), 1, image.width),
            std::clamp(static_cast<int>(std::lround(max_height)), 1, image.height));
  for (int y = 0; y < out.height; ++y) {
    const auto [y0, y1] = Covered(y, out.height, image.height);
    std::uint8_t* to = out.row(y);
    for (int x = 0; x < out.width; ++x, to += 3) {
      const auto [x0, x1] = Covered(x, out.width, image.width);
      std::uint64_t sum[3] = {0, 0, 0};
      for (int row = y0; row < y1; ++row) {
        const std::uint8_t* pixel = image.row(row) + std::ptrdiff_t{3} * x0;
        for (int column = x0; column < x1; ++column, pixel += 3) {
          for (int channel = 0; channel < 3; ++channel) sum[channel] += pixel[channel];
        }
      }
      const auto count = static_cast<std::uint64_t>(x1 - x0) * static_cast<std::uint64_t>(y1 - y0);
      for (int channel = 0; channel < 3; ++channel) {
        to[channel] = static_cast<std::uint8_t>((sum[channel] + count / 2) / count);
      }
    }
  }
  return out;
}

namespace {

/// Formats to a hundredth, without final zeros; never "-0".
std::string Number(double value) {
  std::string text = fmt::format("{:.2f}", value);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

/// Returns fill="#1d2430", with its opacity if it is not opaque.
std::string Paint(std::string_view attribute, const Color& color) {
  std::string text = fmt::format("{}=\"{}\"", attribute, HexText(color));
  if (color.alpha < 1) text += fmt::format(" {}-opacity=\"{}\"", attribute, Number(color.alpha));
  return text;
}

/// Encodes a photo or scan as JPEG: a fifth of the same pixels' PNG.
std::string JpegOf(const BgrView& picture, int quality) {
  std::vector<std::uint8_t> bytes;
  const PageView pixels{picture.data, picture.width, picture.height, 3, picture.stride};
  const auto done =
      image::EncodeJpeg(pixels, {.quality = quality, .dpi = {}, .own_tables = true}, bytes);
  TRAMMEL_CHECK(done, "{}", done.error().message);
  return {bytes.begin(), bytes.end()};
}

std::string StrokeText(const Stroke& stroke) {
  std::string text = Paint("stroke", stroke.color);
  if (stroke.width_px != 1) text += fmt::format(" stroke-width=\"{}\"", Number(stroke.width_px));
  if (stroke.round_ends) text += " stroke-linecap=\"round\"";
  if (!stroke.dash_px.empty()) {
    text += " stroke-dasharray=\"";
    for (std::size_t i = 0; i < stroke.dash_px.size(); ++i) {
      text += (i > 0 ? " " : "") + Number(stroke.dash_px[i]);
    }
    text += "\"";
  }
  return text;
}

std::string Style(const std::optional<Color>& fill, const std::optional<Stroke>& stroke) {
  std::string text = fill && fill->alpha > 0 ? Paint("fill", *fill) : "fill=\"none\"";
  if (stroke) text += " " + StrokeText(*stroke);
  return text;
}

std::string Box(const RectPx& rect) {
  return fmt::format("x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"", Number(rect.x), Number(rect.y),
                     Number(rect.width), Number(rect.height));
}

std::string ImageElement(const RectPx& to, std::string_view type, std::string_view bytes,
                         bool enlarged) {
  return fmt::format(
      "<image {} preserveAspectRatio=\"none\"{} href=\"data:image/{};base64,{}\"/>\n", Box(to),
      enlarged ? " style=\"image-rendering:pixelated\"" : "", type, Base64(bytes));
}

}  // namespace

void SvgWriter::FlushDots() {
  if (dots_.empty()) return;
  body_ += fmt::format("<path d=\"{}\" {}/>\n", dots_.text(), dots_style_);
  dots_ = {};
}

void SvgWriter::BeginPath() {
  path_ = {};
  waiting_.reset();
}

void SvgWriter::FlushPoint() {
  if (waiting_) path_.LineTo(*waiting_);
  waiting_.reset();
}

void SvgWriter::MoveTo(const PointPx& point) {
  FlushPoint();
  path_.MoveTo(point);
  last_ = point;
}

void SvgWriter::LineTo(const PointPx& point) {
  constexpr double kSeen_px = 0.4;
  if (std::hypot(point.x - last_.x, point.y - last_.y) < kSeen_px) {
    waiting_ = point;  // only the last of those that no eye tells apart
    return;
  }
  waiting_.reset();
  path_.LineTo(point);
  last_ = point;
}

void SvgWriter::ClosePath() {
  FlushPoint();
  path_.Close();
}

void SvgWriter::EndPath(const std::optional<Color>& fill, const std::optional<Stroke>& stroke) {
  FlushPoint();
  if (path_.empty()) return;
  FlushDots();
  body_ += fmt::format("<path d=\"{}\" {}/>\n", path_.text(), Style(fill, stroke));
  path_ = {};
}

void SvgWriter::Circle(const PointPx& centre, double radius_px, const std::optional<Color>& fill,
                       const std::optional<Stroke>& edge) {
  if (fill && !edge) {
    // A line of zero length with round ends is a disc.
    const Stroke disc{.color = *fill, .width_px = 2 * radius_px, .round_ends = true};
    const std::string style = Style(std::nullopt, disc);
    if (style != dots_style_) FlushDots();
    dots_style_ = style;
    dots_.Dot(centre);
    return;
  }
  FlushDots();
  body_ += fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {}/>\n", Number(centre.x),
                       Number(centre.y), Number(radius_px), Style(fill, edge));
}

void SvgWriter::Text(const PointPx& at, std::string_view text, const TextStyle& style,
                     double width_px) {
  if (text.empty()) return;
  FlushDots();
  body_ += fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\" {}", Number(at.x), Number(at.y),
                       Number(style.size_px), Paint("fill", style.color));
  if (style.bold) body_ += " font-weight=\"bold\"";
  if (style.align != Align::kStart) {
    body_ += fmt::format(" text-anchor=\"{}\"", style.align == Align::kMiddle ? "middle" : "end");
  }
  constexpr double kDegrees = 180 / std::numbers::pi;
  if (style.angle_rad != 0) {
    body_ += fmt::format(" transform=\"rotate({} {} {})\"", Number(style.angle_rad * kDegrees),
                         Number(at.x), Number(at.y));
  }
  if (width_px > 0) body_ += fmt::format(" textLength=\"{}\"", Number(width_px));
  body_ += fmt::format(">{}</text>\n", EscapeHtml(text));
}

void SvgWriter::Image(const RectPx& to, std::string_view type, std::string_view bytes,
                      bool enlarged) {
  FlushDots();
  body_ += ImageElement(to, type, bytes, enlarged);
}

void SvgWriter::Photo(const RectPx& to, Frame picture) {
  FlushDots();
  photos_.push_back({body_.size(), to, std::move(picture)});
}

void SvgWriter::Clip(const RectPx& rect) {
  FlushDots();
  // Clips by an inner drawing, which needs no id; ids would have to be unique on a page.
  body_ += fmt::format("<svg {} viewBox=\"{} {} {} {}\" preserveAspectRatio=\"none\">\n", Box(rect),
                       Number(rect.x), Number(rect.y), Number(rect.width), Number(rect.height));
}

void SvgWriter::Unclip() {
  FlushDots();
  body_ += "</svg>\n";
}

std::string SvgWriter::Content(const PhotoDetail& detail) const {
  std::string content;
  std::size_t written = 0;
  for (const PlacedPhoto& photo : photos_) {
    const Frame kept = Reduced(photo.picture.view(), photo.to.width * detail.density,
                               photo.to.height * detail.density);
    content.append(body_, written, photo.at - written);
    content += ImageElement(photo.to, "jpeg", JpegOf(kept.view(), detail.quality), false);
    written = photo.at;
  }
  content.append(body_, written);
  if (!dots_.empty()) content += fmt::format("<path d=\"{}\" {}/>\n", dots_.text(), dots_style_);
  return content;
}

std::string SvgWriter::File(double width_px, double height_px) const {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}px\" height=\"{1}px\" viewBox=\"0 0 "
      "{0} {1}\" font-family=\"DejaVu Sans,Verdana,sans-serif\" "
      "stroke-linejoin=\"round\" xml:space=\"preserve\">\n{2}</svg>\n",
      Number(width_px), Number(height_px), Content({}));
}

std::string SvgWriter::Element(double width_px, double height_px, std::string_view label,
                               const PhotoDetail& detail) const {
  return fmt::format(
      "<svg role=\"img\" aria-label=\"{3}\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"DejaVu Sans,Verdana,sans-serif\" stroke-linejoin=\"round\" "
      "xml:space=\"preserve\">\n{2}</svg>\n",
      Number(width_px), Number(height_px), Content(detail), EscapeHtml(label));
}

namespace {

bool IsLetter(char c) { return c >= 'a' && c <= 'z'; }
bool IsNumberPart(char c) { return (c >= '0' && c <= '9') || c == '-'; }

/// Returns the length of `letters[-digits…]` at the start of the text; 0 if it does not end in a
/// number.
std::size_t IdLength(std::string_view text, std::size_t& letters) {
  letters = 0;
  while (letters < text.size() && IsLetter(text[letters])) {
    ++letters;
  }
  std::size_t end = letters;
  while (end < text.size() && IsNumberPart(text[end])) {
    ++end;
  }
  return letters > 0 && end > letters ? end : 0;
}

}  // namespace

std::string RenumberSvgIds(std::string_view svg) {
  constexpr std::string_view kDeclaration = " id=\"";
  constexpr std::string_view kLink = "href=\"#";
  constexpr std::string_view kUrl = "url(#";
  std::map<std::string, std::string, std::less<>> renamed;
  std::string out;
  out.reserve(svg.size());
  std::size_t at = 0;
  while (at < svg.size()) {
    std::string_view mark;
    for (const std::string_view candidate : {kDeclaration, kLink, kUrl}) {
      if (svg.substr(at, candidate.size()) == candidate) {
        mark = candidate;
      }
    }
    if (mark.empty()) {
      out += svg[at++];
      continue;
    }
    out += mark;
    at += mark.size();
    std::size_t letters = 0;
    const std::size_t length = IdLength(svg.substr(at), letters);
    if (length == 0) {
      continue;
    }
    const std::string_view id = svg.substr(at, length);
    const auto [entry, added] = renamed.try_emplace(std::string(id));
    if (added) {
      entry->second = std::string(id.substr(0, letters)) + std::to_string(renamed.size());
    }
    out += entry->second;
    at += length;
  }
  return out;
}

}  // namespace trammel::report
