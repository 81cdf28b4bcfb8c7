// Draws lines on paper as G-code: travels, hops, retractions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tool_offset/sheet/sheet_bed.h"

namespace trammel::tool_offset {

/// One tool's filament.
struct PenTool {
  double filament_per_mm = 0;
  double retract_mm = 0;
};

/// Absolute positions, relative E. The nozzle is up, and the filament drawn back, whenever it does
/// not draw.
class SheetPen {
 public:
  explicit SheetPen(const SheetPlan& plan);

  void Line(std::string_view text);
  void Lines(const std::vector<std::string>& lines);
  /// The user's own text, ended by a line end.
  void Block(std::string_view text);

  /// From now on draws with this tool, whose filament has `pushed_out_mm` to go until it is at the
  /// nozzle's tip. Somebody else may have moved the head.
  void TakeTool(const PenTool& tool);
  /// Rises above everything.
  void Lift();
  /// Waits aside, above everything.
  void Park();
  /// Waits high above the bed's back edge, out of the way of hands that tape paper down.
  void ParkForPaper();
  /// Draws without a run-in, after pushing out `prime_mm` where the line begins.
  void DrawPrimeLine(const Leg& leg, double prime_mm);
  /// Runs in, draws one leg.
  void DrawLeg(const Leg& leg);
  /// One line round the sheet, `inset_mm` within the outermost.
  void DrawBox(double inset_mm);

  [[nodiscard]] double filament_mm() const { return filament_mm_; }
  [[nodiscard]] double time_s() const { return time_s_; }
  [[nodiscard]] std::string Take() { return std::move(out_); }

 private:
  void TravelTo(const SheetPoint& point, double speed_mm_s);
  void MoveTo(const SheetPoint& point, double speed_mm_s, double filament_mm);
  void MoveZ(double z_mm);
  void MoveAside(const settings::ParkPosition& park);
  void Push(double filament_mm);
  void Lower();
  void Raise();
  void Count(double length_mm, double speed_mm_s);

  const SheetPlan& plan_;
  double print_z_mm_ = 0;
  PenTool tool_;
  std::string out_;
  double filament_mm_ = 0;
  double time_s_ = 0;
  BedPoint at_;
  double z_mm_ = 0;
};

}  // namespace trammel::tool_offset
