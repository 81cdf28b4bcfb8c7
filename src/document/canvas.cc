#include "document/canvas.h"

#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <utility>

#include "base/check.h"
#include "base/utf8.h"
#include "document/cairo_handles.h"
#include "document/svg_writer.h"
#include "image/png_writer.h"

namespace trammel::report {
namespace {

// D65, the white of sRGB (IEC 61966-2-1).
constexpr std::array<double, 3> kWhite = {0.95047, 1.0, 1.08883};
constexpr double kCieDelta = 6.0 / 29.0;

double Linear(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

double Encoded(double linear) {
  const double bounded = std::clamp(linear, 0.0, 1.0);
  return bounded <= 0.0031308 ? 12.92 * bounded : 1.055 * std::pow(bounded, 1 / 2.4) - 0.055;
}

double FromLab(double f) {
  return f > kCieDelta ? f * f * f : 3 * kCieDelta * kCieDelta * (f - 4.0 / 29.0);
}

Color LabToColor(double lightness, double a, double b) {
  const double fy = (lightness + 16) / 116;
  const double x = kWhite[0] * FromLab(fy + a / 500);
  const double y = kWhite[1] * FromLab(fy);
  const double z = kWhite[2] * FromLab(fy - b / 200);
  return {Encoded(3.2406 * x - 1.5372 * y - 0.4986 * z),
          Encoded(-0.9689 * x + 1.8758 * y + 0.0415 * z),
          Encoded(0.0557 * x - 0.2040 * y + 1.0570 * z)};
}

}  // namespace

std::string HexText(const Color& color) {
  const auto byte = [](double part) {
    return static_cast<int>(std::lround(std::clamp(part, 0.0, 1.0) * 255));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(color.red), byte(color.green), byte(color.blue));
}

std::string DarkPaletteStyle() {
  std::string style;
  for (const auto& [light, dark] : kPalette) {
    style += fmt::format("svg [fill=\"{0}\"]{{fill:{1}}}svg [stroke=\"{0}\"]{{stroke:{1}}}\n",
                         HexText(light), HexText(dark));
  }
  return style;
}

Color MapColor(double fraction) {
  const double t = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) : 0.0;
  // Path through Lab: hue from violet over blue and green to yellow. The chroma is just below the
  // limit of sRGB, which is lowest for the blue-greens.
  const double hue_rad = 5.30 - 3.60 * t;
  const double chroma = 25 + 130 * (t - 0.35) * (t - 0.35);
  const double lightness = 14 + 76 * t;
  return LabToColor(lightness, chroma * std::cos(hue_rad), chroma * std::sin(hue_rad));
}

double Lightness(const Color& color) {
  const double y =
      0.2126 * Linear(color.red) + 0.7152 * Linear(color.green) + 0.0722 * Linear(color.blue);
  return y > kCieDelta * kCieDelta * kCieDelta
             ? 116 * std::cbrt(y) - 16
             : 116 * (y / (3 * kCieDelta * kCieDelta) + 4.0 / 29.0) - 16;
}

namespace {

constexpr double kMaxSidePx = 8192;
constexpr const char* kFont = "DejaVu Sans";

struct FontOptionsDeleter {
  void operator()(cairo_font_options_t* options) const { cairo_font_options_destroy(options); }
};

bool Finite(const PointPx& point) { return std::isfinite(point.x) && std::isfinite(point.y); }

void SetColor(cairo_t* context, const Color& color) {
  cairo_set_source_rgba(context, color.red, color.green, color.blue, color.alpha);
}

/// Disables hinting, which would make letters depend on the position and on the machine's settings.
void FixFontRendering(cairo_t* context) {
  const std::unique_ptr<cairo_font_options_t, FontOptionsDeleter> options(
      cairo_font_options_create());
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(context, options.get());
}

Surface SurfaceOf(const BgrView& image) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, image.width, image.height));
  TRAMMEL_CHECK(cairo_surface_status(surface.get()) == CAIRO_STATUS_SUCCESS, "{}x{} px",
                image.width, image.height);
  unsigned char* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* pixel = image.row(y);
    for (int x = 0; x < image.width; ++x, pixel += 3) {
      const std::uint32_t value =
          std::uint32_t{pixel[2]} << 16U | std::uint32_t{pixel[1]} << 8U | std::uint32_t{pixel[0]};
      std::memcpy(data + std::ptrdiff_t{y} * stride + std::ptrdiff_t{4} * x, &value, sizeof value);
    }
  }
  cairo_surface_mark_dirty(surface.get());
  return surface;
}

/// Encodes PNG by the module image: Cairo's own writer uses zlib's level 6, which for a photo takes
/// longer than all else.
std::string PngOf(cairo_surface_t* surface) {
  cairo_surface_flush(surface);
  image::PngForm form;
  form.width_px = cairo_image_surface_get_width(surface);
  form.height_px = cairo_image_surface_get_height(surface);
  form.channels = 3;
  form.packing = image::PngForm::Packing::kDense;
  std::string png;
  auto writer = image::PngWriter::Create(form, [&png](std::span<const std::uint8_t> bytes) {
    png.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return Result<void>();
  });
  TRAMMEL_CHECK(writer.has_value(), "{}", writer.error().message);
  std::vector<std::uint8_t> bgr(3 * static_cast<std::size_t>(form.width_px));
  for (int y = 0; y < form.height_px; ++y) {
    const unsigned char* pixels = cairo_image_surface_get_data(surface) +
                                  std::ptrdiff_t{y} * cairo_image_surface_get_stride(surface);
    for (std::size_t x = 0; x < bgr.size() / 3; ++x) {
      std::uint32_t pixel;
      std::memcpy(&pixel, pixels + 4 * x, sizeof pixel);
      bgr[3 * x] = static_cast<std::uint8_t>(pixel);
      bgr[3 * x + 1] = static_cast<std::uint8_t>(pixel >> 8U);
      bgr[3 * x + 2] = static_cast<std::uint8_t>(pixel >> 16U);
    }
    const auto written = writer->WriteRow(bgr.data());
    TRAMMEL_CHECK(written.has_value(), "{}", written.error().message);
  }
  const auto finished = writer->Finish();
  TRAMMEL_CHECK(finished.has_value(), "{}", finished.error().message);
  return png;
}

}  // namespace

struct Canvas::State {
  Surface surface;
  Context context;
  SvgWriter svg;  ///< the same strokes
};

Canvas::Canvas(double width_px, double height_px) : width_px_(width_px), height_px_(height_px) {
  TRAMMEL_CHECK(width_px > 0 && width_px <= kMaxSidePx && height_px > 0 && height_px <= kMaxSidePx,
                "width_px = {}, height_px = {}", width_px, height_px);
  state_ = std::make_unique<State>();
  const cairo_rectangle_t extents = {0, 0, width_px, height_px};
  state_->surface.reset(cairo_recording_surface_create(CAIRO_CONTENT_COLOR_ALPHA, &extents));
  state_->context.reset(cairo_create(state_->surface.get()));
  FixFontRendering(state_->context.get());
  cairo_set_line_join(state_->context.get(), CAIRO_LINE_JOIN_ROUND);
  FillRect({0, 0, width_px, height_px}, kPaper);
}

Canvas::~Canvas() = default;
Canvas::Canvas(Canvas&&) noexcept = default;
Canvas& Canvas::operator=(Canvas&&) noexcept = default;

void Canvas::SetStroke(const Stroke& stroke) {
  cairo_t* context = state_->context.get();
  SetColor(context, stroke.color);
  cairo_set_line_width(context, stroke.width_px);
  cairo_set_line_cap(context, stroke.round_ends ? CAIRO_LINE_CAP_ROUND : CAIRO_LINE_CAP_BUTT);
  cairo_set_dash(context, stroke.dash_px.data(), static_cast<int>(stroke.dash_px.size()), 0);
}

void Canvas::SetFont(const TextStyle& style) const {
  cairo_t* context = state_->context.get();
  cairo_select_font_face(context, kFont, CAIRO_FONT_SLANT_NORMAL,
                         style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, style.size_px);
}

void Canvas::FillRect(const RectPx& rect, const Color& fill) {
  const PointPx corners[] = {{rect.x, rect.y},
                             {rect.right(), rect.y},
                             {rect.right(), rect.bottom()},
                             {rect.x, rect.bottom()}};
  Polygon(corners, fill);
}

void Canvas::StrokeRect(const RectPx& rect, const Stroke& stroke) {
  const PointPx corners[] = {{rect.x, rect.y},
                             {rect.right(), rect.y},
                             {rect.right(), rect.bottom()},
                             {rect.x, rect.bottom()}};
  Polygon(corners, WithAlpha(kPaper, 0), stroke);
}

void Canvas::Polyline(std::span<const PointPx> points, const Stroke& stroke) {
  cairo_t* context = state_->context.get();
  cairo_new_path(context);
  state_->svg.BeginPath();
  bool pen_down = false;
  for (const PointPx& point : points) {
    if (!Finite(point)) {
      pen_down = false;
    } else if (pen_down) {
      cairo_line_to(context, point.x, point.y);
      state_->svg.LineTo(point);
    } else {
      cairo_move_to(context, point.x, point.y);
      state_->svg.MoveTo(point);
      pen_down = true;
    }
  }
  SetStroke(stroke);
  cairo_stroke(context);
  state_->svg.EndPath(std::nullopt, stroke);
}

void Canvas::Polygon(std::span<const PointPx> points, const Color& fill,
                     const std::optional<Stroke>& edge) {
  if (points.empty() || !std::all_of(points.begin(), points.end(), Finite)) {
    return;
  }
  cairo_t* context = state_->context.get();
  cairo_new_path(context);
  state_->svg.BeginPath();
  for (const PointPx& point : points) {
    cairo_line_to(context, point.x, point.y);
    if (&point == points.data()) {
      state_->svg.MoveTo(point);
    } else {
      state_->svg.LineTo(point);
    }
  }
  cairo_close_path(context);
  state_->svg.ClosePath();
  state_->svg.EndPath(fill, edge);
  if (fill.alpha > 0) {
    SetColor(context, fill);
    cairo_fill_preserve(context);
  }
  if (edge) {
    SetStroke(*edge);
    cairo_stroke(context);
  }
  cairo_new_path(context);
}

void Canvas::Circle(const PointPx& centre, double radius_px, const std::optional<Color>& fill,
                    const std::optional<Stroke>& edge) {
  if (!Finite(centre)) {
    return;
  }
  cairo_t* context = state_->context.get();
  cairo_new_path(context);
  cairo_arc(context, centre.x, centre.y, radius_px, 0, 2 * std::numbers::pi);
  state_->svg.Circle(centre, radius_px, fill, edge);
  if (fill) {
    SetColor(context, *fill);
    cairo_fill_preserve(context);
  }
  if (edge) {
    SetStroke(*edge);
    cairo_stroke(context);
  }
  cairo_new_path(context);
}

void Canvas::Text(const PointPx& at, std::string_view text, const TextStyle& style) {
  if (!Finite(at)) {
    return;
  }
  cairo_t* context = state_->context.get();
  const std::string safe = Utf8OrReplaced(text);
  const double width = TextWidth(text, style);
  state_->svg.Text(at, safe, style, width);
  cairo_save(context);
  SetFont(style);
  SetColor(context, style.color);
  cairo_translate(context, at.x, at.y);
  cairo_rotate(context, style.angle_rad);
  const double before = style.align == Align::kMiddle ? 0.5 : style.align == Align::kEnd ? 1 : 0;
  cairo_move_to(context, -before * width, 0);
  cairo_show_text(context, safe.c_str());
  cairo_restore(context);
}

double Canvas::TextWidth(std::string_view text, const TextStyle& style) const {
  SetFont(style);
  cairo_text_extents_t extents;
  cairo_text_extents(state_->context.get(), Utf8OrReplaced(text).c_str(), &extents);
  return extents.x_advance;
}

void Canvas::Image(const BgrView& image, const RectPx& to, Pixels pixels) {
  if (image.width <= 0 || image.height <= 0 || to.width <= 0 || to.height <= 0) {
    return;
  }
  constexpr double kDensity = PhotoDetail{}.density;
  Frame shown = Reduced(image, to.width * kDensity, to.height * kDensity);
  const Surface surface = SurfaceOf(shown.view());
  const bool enlarged = shown.width < to.width || shown.height < to.height;
  if (pixels == Pixels::kExact) {
    state_->svg.Image(to, "png", PngOf(surface.get()), enlarged);
  }
  cairo_t* context = state_->context.get();
  cairo_save(context);
  cairo_translate(context, to.x, to.y);
  cairo_scale(context, to.width / shown.width, to.height / shown.height);
  cairo_set_source_surface(context, surface.get(), 0, 0);
  cairo_pattern_set_filter(cairo_get_source(context),
                           enlarged ? CAIRO_FILTER_NEAREST : CAIRO_FILTER_GOOD);
  cairo_pattern_set_extend(cairo_get_source(context), CAIRO_EXTEND_PAD);
  cairo_rectangle(context, 0, 0, shown.width, shown.height);
  cairo_fill(context);
  cairo_restore(context);
  if (pixels == Pixels::kPhoto) state_->svg.Photo(to, std::move(shown));
}

void Canvas::Clip(const RectPx& rect) {
  cairo_t* context = state_->context.get();
  cairo_save(context);
  cairo_rectangle(context, rect.x, rect.y, rect.width, rect.height);
  cairo_clip(context);
  state_->svg.Clip(rect);
}

void Canvas::Unclip() {
  cairo_restore(state_->context.get());
  state_->svg.Unclip();
}

std::string Canvas::ToPng(double scale) const {
  const Canvas* const self = this;
  return StackedPng({&self, 1}, scale);
}

std::string Canvas::StackedPng(std::span<const Canvas* const> drawings, double scale) {
  TRAMMEL_CHECK(scale > 0 && scale <= 4 && !drawings.empty(), "scale = {}, {} drawings", scale,
                drawings.size());
  double width_px = 0, height_px = 0;
  for (const Canvas* drawing : drawings) {
    width_px = std::max(width_px, drawing->width_px());
    height_px += drawing->height_px();
  }
  const Surface image(cairo_image_surface_create(CAIRO_FORMAT_RGB24,
                                                 static_cast<int>(std::ceil(width_px * scale)),
                                                 static_cast<int>(std::ceil(height_px * scale))));
  const Context context(cairo_create(image.get()));
  cairo_set_source_rgb(context.get(), 1, 1, 1);  // remainder of the last pixel row
  cairo_paint(context.get());
  cairo_scale(context.get(), scale, scale);
  double top_px = 0;
  for (const Canvas* drawing : drawings) {
    cairo_set_source_surface(context.get(), drawing->state_->surface.get(), 0, top_px);
    cairo_paint(context.get());
    top_px += drawing->height_px();
  }
  TRAMMEL_CHECK(cairo_status(context.get()) == CAIRO_STATUS_SUCCESS, "a {} x {} px drawing: {}",
                width_px, height_px, cairo_status_to_string(cairo_status(context.get())));
  return PngOf(image.get());
}

std::string Canvas::ToSvg() const { return state_->svg.File(width_px_, height_px_); }

std::string Canvas::ToSvgElement(std::string_view label, const PhotoDetail& detail) const {
  return state_->svg.Element(width_px_, height_px_, label, detail);
}

}  // namespace trammel::report
