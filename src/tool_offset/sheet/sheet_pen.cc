#include "tool_offset/sheet/sheet_pen.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gcode/number.h"

namespace trammel::tool_offset {
namespace {

using gcode::FormatNumber;

constexpr int kPositionDecimals = 4;  // 0.1 µm: finer than what is measured
constexpr int kFilamentDecimals = 5;  // 0.01 µm of filament
constexpr int kFeedDecimals = 1;      // mm/min

std::string Feed(double speed_mm_s) { return " F" + FormatNumber(speed_mm_s * 60, kFeedDecimals); }

}  // namespace

SheetPen::SheetPen(const SheetPlan& plan)
    : plan_(plan),
      print_z_mm_(plan.settings.layer_height_mm + plan.settings.paper_thickness_mm +
                  plan.settings.printer.z_offset_mm) {}

void SheetPen::Line(std::string_view text) {
  out_ += text;
  out_ += '\n';
}

void SheetPen::Lines(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) Line(line);
}

void SheetPen::Block(std::string_view text) {
  out_ += text;
  if (!text.empty() && text.back() != '\n') out_ += '\n';
}

void SheetPen::TakeTool(const PenTool& tool) { tool_ = tool; }

void SheetPen::Lift() { MoveZ(print_z_mm_ + plan_.settings.printer.park_lift_mm); }

void SheetPen::Park() {
  Lift();
  MoveAside(settings::ParkPositionOf(plan_.settings.printer));
}

void SheetPen::ParkForPaper() {
  const PaperPark park = PaperParkOf(plan_.settings);
  MoveZ(park.z_mm);
  MoveAside({park.x_mm, park.y_mm});
}

void SheetPen::MoveAside(const settings::ParkPosition& park) {
  const double speed_mm_s = plan_.settings.printer.travel_speed_mm_s;
  Line(fmt::format("G1 X{} Y{}{}", FormatNumber(park.x_mm, kPositionDecimals),
                   FormatNumber(park.y_mm, kPositionDecimals), Feed(speed_mm_s)));
  Count(std::hypot(park.x_mm - at_.x_mm, park.y_mm - at_.y_mm), speed_mm_s);
  at_ = {park.x_mm, park.y_mm};
}

void SheetPen::DrawPrimeLine(const Leg& leg, double prime_mm) {
  TravelTo(leg.start, plan_.settings.printer.travel_speed_mm_s);
  Lower();
  Push(prime_mm + tool_.retract_mm);
  MoveTo(leg.end, plan_.settings.print_speed_mm_s,
         std::hypot(leg.end.u_mm - leg.start.u_mm, leg.end.v_mm - leg.start.v_mm) *
             tool_.filament_per_mm);
  Raise();
}

void SheetPen::DrawLeg(const Leg& leg) {
  const SheetSettings& settings = plan_.settings;
  const double along_u_mm = leg.end.u_mm - leg.start.u_mm;
  const double along_v_mm = leg.end.v_mm - leg.start.v_mm;
  const double length_mm = std::hypot(along_u_mm, along_v_mm);
  const double back = settings.run_in_mm / length_mm;
  TravelTo({leg.start.u_mm - back * along_u_mm, leg.start.v_mm - back * along_v_mm},
           settings.printer.travel_speed_mm_s);
  // Above the paper: the play is taken up before the nozzle touches down.
  TravelTo(leg.start, settings.print_speed_mm_s);
  Lower();
  Push(tool_.retract_mm);
  MoveTo(leg.end, settings.print_speed_mm_s, length_mm * tool_.filament_per_mm);
  Raise();
}

void SheetPen::DrawBox(double inset_mm) {
  const double u_mm = plan_.width_mm / 2 - inset_mm;
  const double v_mm = plan_.height_mm / 2 - inset_mm;
  const std::array<SheetPoint, 5> corners{
      {{-u_mm, -v_mm}, {u_mm, -v_mm}, {u_mm, v_mm}, {-u_mm, v_mm}, {-u_mm, -v_mm}}};
  TravelTo(corners[0], plan_.settings.printer.travel_speed_mm_s);
  Lower();
  Push(tool_.retract_mm);
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const double length_mm = i % 2 == 1 ? 2 * u_mm : 2 * v_mm;
    MoveTo(corners[i], plan_.settings.print_speed_mm_s, length_mm * tool_.filament_per_mm);
  }
  Raise();
}

void SheetPen::TravelTo(const SheetPoint& point, double speed_mm_s) {
  // From above everything down to where it travels, once it is there.
  const double hop_mm = print_z_mm_ + plan_.settings.printer.z_hop_mm;
  MoveTo(point, speed_mm_s, 0);
  if (z_mm_ != hop_mm) MoveZ(hop_mm);
}

void SheetPen::MoveTo(const SheetPoint& point, double speed_mm_s, double filament_mm) {
  const BedPoint to = OnBed(plan_, point);
  std::string line = fmt::format("G1 X{} Y{}", FormatNumber(to.x_mm, kPositionDecimals),
                                 FormatNumber(to.y_mm, kPositionDecimals));
  if (filament_mm != 0) line += " E" + FormatNumber(filament_mm, kFilamentDecimals);
  Line(line + Feed(speed_mm_s));
  Count(std::hypot(to.x_mm - at_.x_mm, to.y_mm - at_.y_mm), speed_mm_s);
  at_ = to;
  filament_mm_ += filament_mm;
}

void SheetPen::MoveZ(double z_mm) {
  const double speed_mm_s = plan_.settings.printer.z_speed_mm_s;
  Line(fmt::format("G1 Z{}{}", FormatNumber(z_mm, kPositionDecimals), Feed(speed_mm_s)));
  Count(std::abs(z_mm - z_mm_), speed_mm_s);
  z_mm_ = z_mm;
}

void SheetPen::Push(double filament_mm) {
  if (filament_mm == 0) return;
  const double speed_mm_s = plan_.settings.printer.retract_speed_mm_s;
  Line(fmt::format("G1 E{}{}", FormatNumber(filament_mm, kFilamentDecimals), Feed(speed_mm_s)));
  Count(std::abs(filament_mm), speed_mm_s);
  filament_mm_ += filament_mm;
}

void SheetPen::Lower() { MoveZ(print_z_mm_); }

void SheetPen::Raise() {
  Push(-tool_.retract_mm);
  MoveZ(print_z_mm_ + plan_.settings.printer.z_hop_mm);
}

void SheetPen::Count(double length_mm, double speed_mm_s) {
  // From rest to rest.
  const double a_mm_s2 = plan_.settings.acceleration_mm_s2;
  const double peak_mm_s = std::min(speed_mm_s, std::sqrt(a_mm_s2 * length_mm));
  if (length_mm > 0) time_s_ += length_mm / peak_mm_s + peak_mm_s / a_mm_s2;
}

}  // namespace trammel::tool_offset
