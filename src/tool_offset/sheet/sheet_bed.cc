#include "tool_offset/sheet/sheet_bed.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tool_offset/sheet/sheet_layout.h"

namespace trammel::tool_offset {
namespace {

BedPoint Turned(const SheetPoint& point, double tilt_deg) {
  const double tilt_rad = tilt_deg * std::numbers::pi / 180;
  return {point.u_mm * std::cos(tilt_rad) - point.v_mm * std::sin(tilt_rad),
          point.u_mm * std::sin(tilt_rad) + point.v_mm * std::cos(tilt_rad)};
}

/// Returns the middle of the box: as set, or so that the print, with the prime lines below the box,
/// is centred on the bed.
BedPoint Middle(const SheetSettings& settings) {
  const settings::PrinterSettings& printer = settings.printer;
  const BedPoint below = Turned({0, PrimeDepth_mm(settings) / 2}, settings.tilt_deg);
  return {settings.position_x_mm.value_or(printer.bed_origin_x_mm + printer.bed_size_x_mm / 2 +
                                          below.x_mm),
          settings.position_y_mm.value_or(printer.bed_origin_y_mm + printer.bed_size_y_mm / 2 +
                                          below.y_mm)};
}

BedPoint OnBed(const SheetSettings& settings, const SheetPoint& point) {
  const BedPoint middle = Middle(settings);
  const BedPoint turned = Turned(point, settings.tilt_deg);
  return {middle.x_mm + turned.x_mm, middle.y_mm + turned.y_mm};
}

}  // namespace

std::array<BedPoint, 4> SheetCorners(const SheetSettings& settings, double width_mm,
                                     double height_mm) {
  const double u_mm = (width_mm + settings.line_width_mm) / 2;
  const double top_mm = (height_mm + settings.line_width_mm) / 2;
  const double bottom_mm = -top_mm - PrimeDepth_mm(settings);
  return {OnBed(settings, {-u_mm, bottom_mm}), OnBed(settings, {u_mm, bottom_mm}),
          OnBed(settings, {u_mm, top_mm}), OnBed(settings, {-u_mm, top_mm})};
}

BedBounds SheetBounds(const SheetSettings& settings, double width_mm, double height_mm) {
  const auto corners = SheetCorners(settings, width_mm, height_mm);
  const auto [left, right] = std::minmax_element(
      corners.begin(), corners.end(), [](const auto& a, const auto& b) { return a.x_mm < b.x_mm; });
  const auto [front, back] = std::minmax_element(
      corners.begin(), corners.end(), [](const auto& a, const auto& b) { return a.y_mm < b.y_mm; });
  return {left->x_mm, front->y_mm, right->x_mm, back->y_mm};
}

double SheetReach(const SheetSettings& settings, double width_mm, double height_mm) {
  double reach = 0;
  for (const BedPoint& corner : SheetCorners(settings, width_mm, height_mm)) {
    reach = std::max(reach, settings::BedReach(settings.printer, corner.x_mm, corner.y_mm,
                                               settings.printer.bed_margin_mm));
  }
  return reach;
}

std::optional<PaperOnBed> PaperAround(const SheetPlan& plan) {
  const BedBounds print = SheetBounds(plan.settings, plan.width_mm, plan.height_mm);
  const double x_mm = print.max_x_mm - print.min_x_mm;
  const double y_mm = print.max_y_mm - print.min_y_mm;
  const auto asked_for = FindPaper(plan.settings.paper);
  for (const PaperSize& paper : PaperSizes()) {
    const bool is_asked_for = asked_for && asked_for->name == paper.name;
    if ((paper.name == "letter" && !is_asked_for) || !FitsPaper(paper, x_mm, y_mm)) continue;
    const bool lying = x_mm > y_mm;
    const double half_x_mm = (lying ? paper.long_mm : paper.short_mm) / 2;
    const double half_y_mm = (lying ? paper.short_mm : paper.long_mm) / 2;
    const double middle_x_mm = (print.min_x_mm + print.max_x_mm) / 2;
    const double middle_y_mm = (print.min_y_mm + print.max_y_mm) / 2;
    return PaperOnBed{std::string(paper.name),
                      {middle_x_mm - half_x_mm, middle_y_mm - half_y_mm, middle_x_mm + half_x_mm,
                       middle_y_mm + half_y_mm}};
  }
  return std::nullopt;
}

BedPoint OnBed(const SheetPlan& plan, const SheetPoint& point) {
  return OnBed(plan.settings, point);
}

PaperPark PaperParkOf(const SheetSettings& settings) {
  const settings::PrinterSettings& printer = settings.printer;
  const settings::ParkPosition park = settings::ParkPositionOf(printer);
  const double back_mm = printer.bed_origin_y_mm + printer.bed_size_y_mm - printer.bed_margin_mm;
  const double lifted_mm = settings.layer_height_mm + settings.paper_thickness_mm +
                           printer.z_offset_mm + printer.park_lift_mm;
  return {park.x_mm, printer.park_y_mm ? park.y_mm : back_mm,
          std::max(settings.paper_clearance_mm, lifted_mm)};
}

}  // namespace trammel::tool_offset
