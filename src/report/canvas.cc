#include "report/canvas.h"

#include <cairo-svg.h>
#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <utility>

#include "base/check.h"
#include "base/utf8.h"
#include "report/cairo_handles.h"
#include "report/svg_ids.h"

namespace trammel::report {
namespace {

constexpr double kMaxSidePx = 8192;
constexpr const char* kFont = "DejaVu Sans";
constexpr double kImageDensity = 2;  ///< pixels kept of a picture per px of the canvas

struct FontOptionsDeleter {
  void operator()(cairo_font_options_t* options) const { cairo_font_options_destroy(options); }
};

bool Finite(const PointPx& point) { return std::isfinite(point.x) && std::isfinite(point.y); }

void SetColor(cairo_t* context, const Color& color) {
  cairo_set_source_rgba(context, color.red, color.green, color.blue, color.alpha);
}

/// Hinting would make letters depend on the position and on the machine's settings.
void FixFontRendering(cairo_t* context) {
  const std::unique_ptr<cairo_font_options_t, FontOptionsDeleter> options(
      cairo_font_options_create());
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(context, options.get());
}

/// Mean over the source pixels that one target pixel covers; the nearest one where it covers less.
std::uint32_t CoveredMean(const BgrView& image, int x, int y, int width, int height) {
  const auto span = [](int i, int target, int source) {
    const auto first = static_cast<int>(std::int64_t{i} * source / target);
    const auto last = static_cast<int>((std::int64_t{i} + 1) * source / target);
    return std::pair{first, std::max(first + 1, last)};
  };
  const auto [x0, x1] = span(x, width, image.width);
  const auto [y0, y1] = span(y, height, image.height);
  std::uint64_t sum[3] = {0, 0, 0};
  for (int row = y0; row < y1; ++row) {
    const std::uint8_t* pixel = image.row(row) + std::ptrdiff_t{3} * x0;
    for (int column = x0; column < x1; ++column, pixel += 3) {
      sum[0] += pixel[0];
      sum[1] += pixel[1];
      sum[2] += pixel[2];
    }
  }
  const std::uint64_t count =
      static_cast<std::uint64_t>(x1 - x0) * static_cast<std::uint64_t>(y1 - y0);
  const auto mean = [&](int channel) {
    return static_cast<std::uint32_t>((sum[channel] + count / 2) / count);
  };
  return mean(2) << 16U | mean(1) << 8U | mean(0);
}

}  // namespace

struct Canvas::State {
  Surface surface;
  Context context;
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
  bool pen_down = false;
  for (const PointPx& point : points) {
    if (!Finite(point)) {
      pen_down = false;
    } else if (pen_down) {
      cairo_line_to(context, point.x, point.y);
    } else {
      cairo_move_to(context, point.x, point.y);
      pen_down = true;
    }
  }
  SetStroke(stroke);
  cairo_stroke(context);
}

void Canvas::Polygon(std::span<const PointPx> points, const Color& fill,
                     const std::optional<Stroke>& edge) {
  if (points.empty() || !std::all_of(points.begin(), points.end(), Finite)) {
    return;
  }
  cairo_t* context = state_->context.get();
  cairo_new_path(context);
  for (const PointPx& point : points) {
    cairo_line_to(context, point.x, point.y);
  }
  cairo_close_path(context);
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
  const double width = style.align == Align::kStart ? 0 : TextWidth(text, style);
  cairo_save(context);
  SetFont(style);
  SetColor(context, style.color);
  cairo_translate(context, at.x, at.y);
  cairo_rotate(context, style.angle_rad);
  cairo_move_to(context, style.align == Align::kMiddle ? -width / 2 : -width, 0);
  cairo_show_text(context, safe.c_str());
  cairo_restore(context);
}

double Canvas::TextWidth(std::string_view text, const TextStyle& style) const {
  SetFont(style);
  cairo_text_extents_t extents;
  cairo_text_extents(state_->context.get(), Utf8OrReplaced(text).c_str(), &extents);
  return extents.x_advance;
}

void Canvas::Image(const BgrView& image, const RectPx& to) {
  if (image.width <= 0 || image.height <= 0 || to.width <= 0 || to.height <= 0) {
    return;
  }
  const int width = std::max(1, static_cast<int>(std::lround(to.width * kImageDensity)));
  const int height = std::max(1, static_cast<int>(std::lround(to.height * kImageDensity)));
  const Surface pixels(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  TRAMMEL_CHECK(cairo_surface_status(pixels.get()) == CAIRO_STATUS_SUCCESS, "{}x{} px", width,
                height);
  unsigned char* data = cairo_image_surface_get_data(pixels.get());
  const int stride = cairo_image_surface_get_stride(pixels.get());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::uint32_t value = CoveredMean(image, x, y, width, height);
      std::memcpy(data + std::ptrdiff_t{y} * stride + std::ptrdiff_t{4} * x, &value, sizeof value);
    }
  }
  cairo_surface_mark_dirty(pixels.get());
  cairo_t* context = state_->context.get();
  cairo_save(context);
  cairo_translate(context, to.x, to.y);
  cairo_scale(context, to.width / width, to.height / height);
  cairo_set_source_surface(context, pixels.get(), 0, 0);
  cairo_pattern_set_filter(cairo_get_source(context), CAIRO_FILTER_GOOD);
  cairo_pattern_set_extend(cairo_get_source(context), CAIRO_EXTEND_PAD);
  cairo_rectangle(context, 0, 0, width, height);
  cairo_fill(context);
  cairo_restore(context);
}

void Canvas::Clip(const RectPx& rect) {
  cairo_t* context = state_->context.get();
  cairo_save(context);
  cairo_rectangle(context, rect.x, rect.y, rect.width, rect.height);
  cairo_clip(context);
}

void Canvas::Unclip() { cairo_restore(state_->context.get()); }

std::string Canvas::ToPng(double scale) const {
  TRAMMEL_CHECK(scale > 0 && scale <= 4, "scale = {}", scale);
  const Surface image(cairo_image_surface_create(CAIRO_FORMAT_RGB24,
                                                 static_cast<int>(std::ceil(width_px_ * scale)),
                                                 static_cast<int>(std::ceil(height_px_ * scale))));
  const Context context(cairo_create(image.get()));
  cairo_set_source_rgb(context.get(), 1, 1, 1);  // what the last row has beyond the canvas
  cairo_paint(context.get());
  cairo_scale(context.get(), scale, scale);
  cairo_set_source_surface(context.get(), state_->surface.get(), 0, 0);
  cairo_paint(context.get());
  std::string png;
  const cairo_status_t status = cairo_surface_write_to_png_stream(image.get(), AppendBytes, &png);
  TRAMMEL_CHECK(
      status == CAIRO_STATUS_SUCCESS && cairo_status(context.get()) == CAIRO_STATUS_SUCCESS,
      "a {} x {} px drawing: {}", width_px_, height_px_, cairo_status_to_string(status));
  return png;
}

std::string Canvas::ToSvg() const {
  std::string svg;
  const Surface surface(
      cairo_svg_surface_create_for_stream(AppendBytes, &svg, width_px_, height_px_));
  cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PX);
  {
    const Context context(cairo_create(surface.get()));
    cairo_set_source_surface(context.get(), state_->surface.get(), 0, 0);
    cairo_paint(context.get());
  }
  cairo_surface_finish(surface.get());
  const cairo_status_t status = cairo_surface_status(surface.get());
  TRAMMEL_CHECK(status == CAIRO_STATUS_SUCCESS, "a {} x {} px drawing: {}", width_px_, height_px_,
                cairo_status_to_string(status));
  return RenumberSvgIds(svg);
}

}  // namespace trammel::report
