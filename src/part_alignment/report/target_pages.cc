#include "part_alignment/report/target_pages.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>
#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>

#include "base/check.h"
#include "document/cairo_handles.h"
#include "document/svg_writer.h"
#include "part_alignment/targets/target.h"

namespace trammel::report {
namespace {

namespace pa = part_alignment;

constexpr double kPointsPerMm = 72 / 25.4;
constexpr double kFineLine_mm = 0.1;
constexpr const char* kFont = "DejaVu Sans";

void Grey(cairo_t* context, double level) { cairo_set_source_rgb(context, level, level, level); }

void Line(cairo_t* context, double x0, double y0, double x1, double y1, double width_mm) {
  cairo_set_line_width(context, width_mm);
  cairo_move_to(context, x0, y0);
  cairo_line_to(context, x1, y1);
  cairo_stroke(context);
}

/// Draws the corners of the square to cut along, outside it.
void DrawCropMarks(cairo_t* context, const pa::PlacedTarget& target, double square_mm) {
  constexpr double kGap_mm = 0.3;
  constexpr double kMark_mm = 1.2;
  const double half = 0.5 * square_mm;
  Grey(context, 0.5);
  for (const int sx : {-1, 1}) {
    for (const int sy : {-1, 1}) {
      const double x = target.x_mm + sx * half;
      const double y = target.y_mm + sy * half;
      Line(context, x + sx * kGap_mm, y, x + sx * (kGap_mm + kMark_mm), y, kFineLine_mm);
      Line(context, x, y + sy * kGap_mm, x, y + sy * (kGap_mm + kMark_mm), kFineLine_mm);
    }
  }
}

/// Draws disc and ring. Adjacent inked segments are one path, to avoid a seam between them.
void DrawRing(cairo_t* context, const pa::PlacedTarget& target, const pa::SheetRequest& request) {
  const double step = 2 * std::numbers::pi / request.bits;
  const auto inked = [&](int k) {
    return (target.word >> ((k + request.bits) % request.bits) & 1U) != 0;
  };
  for (int k = 0; k < request.bits; ++k) {
    if (!inked(k) || inked(k - 1)) continue;
    int end = k + 1;
    while (inked(end)) ++end;
    // Cairo's angles grow from x towards y, which is down: clockwise.
    cairo_new_path(context);
    cairo_arc(context, target.x_mm, target.y_mm, pa::kRingOuter * request.radius_mm, k * step,
              end * step);
    cairo_arc_negative(context, target.x_mm, target.y_mm, pa::kRingInner * request.radius_mm,
                       end * step, k * step);
    cairo_close_path(context);
    cairo_fill(context);
  }
}

void DrawTarget(cairo_t* context, const pa::TargetSheet& sheet, const pa::PlacedTarget& target) {
  const pa::SheetRequest& request = sheet.request;
  if (request.bright) {
    Grey(context, 0);
    cairo_rectangle(context, target.x_mm - 0.5 * sheet.square_mm,
                    target.y_mm - 0.5 * sheet.square_mm, sheet.square_mm, sheet.square_mm);
    cairo_fill(context);
  }
  Grey(context, request.bright ? 1 : 0);
  cairo_new_path(context);
  cairo_arc(context, target.x_mm, target.y_mm, request.radius_mm, 0, 2 * std::numbers::pi);
  cairo_fill(context);
  if (target.number > 0) DrawRing(context, target, request);
  DrawCropMarks(context, target, sheet.square_mm);
  Grey(context, 0);
  cairo_set_font_size(context, 1.35 * sheet.label_mm);
  const std::string label =
      target.number > 0 ? fmt::format("{} · {}", target.number, request.bits) : "plain";
  cairo_move_to(context, target.x_mm - 0.5 * sheet.square_mm + 1,
                target.y_mm + 0.5 * sheet.square_mm + 1.35 * sheet.label_mm);
  cairo_show_text(context, label.c_str());
}

void DrawScaleBar(cairo_t* context, const pa::TargetSheet& sheet, int page) {
  constexpr double kTick_mm = 3;
  const pa::PrintedScaleBar& bar = sheet.scale_bar;
  Grey(context, 0);
  const double end = bar.x_mm + bar.length_mm;
  Line(context, bar.x_mm, bar.y_mm, end, bar.y_mm, kFineLine_mm);
  for (int i = 0; 10 * i <= bar.length_mm + 0.5; ++i) {
    const double x = bar.x_mm + 10 * i;
    const bool outer = i == 0 || 10 * (i + 1) > bar.length_mm + 0.5;
    Line(context, x, bar.y_mm - (outer ? kTick_mm : kTick_mm / 2), x, bar.y_mm, kFineLine_mm);
  }
  cairo_set_font_size(context, 3);
  cairo_move_to(context, bar.x_mm, bar.y_mm + 4);
  const std::string text = fmt::format(
      "{:.0f} mm from the first to the last line · print at 100 % · disc radius {:g} mm · page {} "
      "of {}",
      bar.length_mm, sheet.request.radius_mm, page + 1, sheet.pages);
  cairo_show_text(context, text.c_str());
}

void DrawPage(cairo_t* context, const pa::TargetSheet& sheet, int page) {
  cairo_select_font_face(context, kFont, CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_tolerance(context, 0.01);
  for (const pa::PlacedTarget& target : sheet.targets) {
    if (target.page == page) DrawTarget(context, sheet, target);
  }
  DrawScaleBar(context, sheet, page);
}

void CheckDone(cairo_surface_t* surface, const char* what) {
  const cairo_status_t status = cairo_surface_status(surface);
  TRAMMEL_CHECK(status == CAIRO_STATUS_SUCCESS, "{} of targets: {}", what,
                cairo_status_to_string(status));
}

}  // namespace

std::string TargetPagesPdf(const part_alignment::TargetSheet& sheet) {
  std::string pdf;
  const Surface surface(cairo_pdf_surface_create_for_stream(
      AppendBytes, &pdf, sheet.request.page_width_mm * kPointsPerMm,
      sheet.request.page_height_mm * kPointsPerMm));
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, "Targets");
  // Equal sheets yield equal bytes: no creation time.
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE,
                                 "2000-01-01T00:00:00Z");
  {
    const Context context(cairo_create(surface.get()));
    cairo_scale(context.get(), kPointsPerMm, kPointsPerMm);
    for (int page = 0; page < sheet.pages; ++page) {
      DrawPage(context.get(), sheet, page);
      cairo_show_page(context.get());
    }
  }
  cairo_surface_finish(surface.get());
  CheckDone(surface.get(), "PDF");
  return pdf;
}

std::string TargetPageSvg(const part_alignment::TargetSheet& sheet, int page) {
  std::string svg;
  const Surface surface(cairo_svg_surface_create_for_stream(
      AppendBytes, &svg, sheet.request.page_width_mm, sheet.request.page_height_mm));
  cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_MM);
  {
    const Context context(cairo_create(surface.get()));
    DrawPage(context.get(), sheet, page);
  }
  cairo_surface_finish(surface.get());
  CheckDone(surface.get(), "SVG");
  return RenumberSvgIds(svg);
}

Page TargetPageImage(const part_alignment::TargetSheet& sheet, int page, double px_per_mm) {
  constexpr int kMaxSide = 30000;
  TRAMMEL_CHECK(px_per_mm > 0 && px_per_mm <= 100, "px_per_mm = {}", px_per_mm);
  Page image;
  image.width = static_cast<int>(std::lround(sheet.request.page_width_mm * px_per_mm));
  image.height = static_cast<int>(std::lround(sheet.request.page_height_mm * px_per_mm));
  TRAMMEL_CHECK(
      image.width > 0 && image.width <= kMaxSide && image.height > 0 && image.height <= kMaxSide,
      "{} x {} px", image.width, image.height);
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, image.width, image.height));
  {
    const Context context(cairo_create(surface.get()));
    cairo_set_antialias(context.get(), CAIRO_ANTIALIAS_BEST);
    Grey(context.get(), 1);
    cairo_paint(context.get());
    cairo_scale(context.get(), px_per_mm, px_per_mm);
    DrawPage(context.get(), sheet, page);
  }
  CheckDone(surface.get(), "picture");
  cairo_surface_flush(surface.get());
  const unsigned char* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      image.samples.push_back(data[std::ptrdiff_t{y} * stride + std::ptrdiff_t{4} * x]);
    }
  }
  return image;
}

}  // namespace trammel::report
