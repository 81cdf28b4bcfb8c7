#include "tool_offset/sheet/sheet_gcode.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "base/check.h"
#include "gcode/bead.h"
#include "gcode/dialect.h"
#include "settings/material.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_comments.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::tool_offset {
namespace {

/// Filament of one tool.
struct PenTool {
  double filament_per_mm = 0;
  double retract_mm = 0;
};

/// Pen with absolute positions and relative E. While it does not draw, the nozzle is up and the
/// filament retracted.
class SheetPen {
 public:
  explicit SheetPen(const SheetPlan& plan);

  void Line(std::string_view text);
  void Lines(const std::vector<std::string>& lines);
  /// Adds the user's own text, ended by a line end.
  void Block(std::string_view text);

  /// Selects this tool for drawing; its filament is `pushed_out_mm` away from the nozzle's tip.
  /// Somebody else may have moved the head.
  void TakeTool(const PenTool& tool);
  /// Rises above everything.
  void Lift();
  /// Waits aside, above everything.
  void Park();
  /// Waits high above the bed's back edge, out of the way of hands that tape paper down.
  void ParkForPaper();
  /// Draws without a run-in, after extruding `prime_mm` at the start of the line.
  void DrawPrimeLine(const Leg& leg, double prime_mm);
  /// Runs in, draws one leg.
  void DrawLeg(const Leg& leg);
  /// Draws one line round the sheet, `inset_mm` within the outermost.
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

using gcode::FormatNumber;

constexpr int kPositionDecimals = 4;  // 0.1 µm: finer than what is measured
constexpr int kFilamentDecimals = 5;  // 0.01 µm of filament
constexpr int kFeedDecimals = 1;      // mm/min

std::string Feed(double speed_mm_s) { return " F" + FormatNumber(speed_mm_s * 60, kFeedDecimals); }

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
  // Above the paper: the backlash is taken up before the nozzle touches down.
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
  // Descends from above everything to travel height only at the target.
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
  // Counts a motion from rest to rest.
  const double a_mm_s2 = plan_.settings.acceleration_mm_s2;
  const double peak_mm_s = std::min(speed_mm_s, std::sqrt(a_mm_s2 * length_mm));
  if (length_mm > 0) time_s_ += length_mm / peak_mm_s + peak_mm_s / a_mm_s2;
}

/// Lines drawn by one tool between pick-up and return.
struct Turn {
  std::size_t place = 0;  ///< index in `tools`
  int pick_up = 0;
};

/// Returns every tool once per pick-up, the reference tool first. A tool's turns are never
/// consecutive: in between it is put back.
std::vector<Turn> Turns(const SheetSettings& settings) {
  const std::size_t reference = ReferencePlace(settings);
  std::vector<Turn> turns;
  for (int pick_up = 0; pick_up <= settings.pick_ups; ++pick_up) {
    turns.push_back({reference, pick_up});
    for (std::size_t place = 0; place < settings.tools.size(); ++place) {
      if (place != reference) turns.push_back({place, pick_up});
    }
  }
  return turns;
}

class Writer {
 public:
  Writer(const SheetPlan& plan, PaperComes paper)
      : plan_(plan),
        settings_(plan.settings),
        dialect_(settings_.printer.dialect),
        paper_(paper),
        pen_(plan) {}

  /// Homes, and picks up the reference tool.
  std::string WritePickUp() {
    const std::size_t reference = ReferencePlace(settings_);
    pen_.Block(Expand(settings_.start_gcode, SheetPlaceholders(plan_)));
    pen_.Line("G21 ; mm");
    WriteModes();
    pen_.Lift();
    ChangeTool(reference, reference);
    return pen_.Take();
  }

  SheetGcode Write() {
    const std::vector<Turn> turns = Turns(settings_);
    WriteHead();
    WriteStart();
    SheetGcode result;
    for (std::size_t i = 0; i < turns.size(); ++i) {
      if (i > 0) {
        const bool again =
            std::any_of(turns.begin() + static_cast<std::ptrdiff_t>(i), turns.end(),
                        [&](const Turn& t) { return t.place == turns[i - 1].place; });
        PutBack(turns[i - 1].place, again);
        ++result.tool_changes;
      }
      PickUp(turns[i], i == 0 ? turns[i].place : turns[i - 1].place);
      Draw(turns[i]);
    }
    WriteEnd(turns.back().place);
    result.filament_mm = pen_.filament_mm();
    result.time_s = pen_.time_s();
    result.text = pen_.Take();
    return result;
  }

 private:
  std::string Expand(const std::string& text, const std::vector<gcode::Placeholder>& known) const {
    Result<std::string> expanded = gcode::ExpandPlaceholders(text, known);
    TRAMMEL_CHECK(expanded.has_value(), "{}", expanded.error().message);
    return *std::move(expanded);
  }

  void WriteHead() {
    const auto number = [](double value) { return gcode::FormatNumber(value, 3); };
    pen_.Line("; trammel: tool offset pattern");
    pen_.Line(fmt::format("; sheet {}: {} x {} mm turned by {} degrees, dialect {}", plan_.sheet_id,
                          number(plan_.width_mm), number(plan_.height_mm),
                          number(settings_.tilt_deg), ToString(dialect_)));
    pen_.Line("; heated to " + DescribeTemperatures(settings_));
    pen_.Line("; afterwards " + DescribeAfterwards(settings_));
    pen_.Line("; the scan is read with this file: keep it; the comments below are its settings");
    pen_.Block(FormatSheetComments(plan_));
  }

  /// Sets modes that the user's own G-code may have changed. Marlin's G90 makes E absolute too,
  /// hence the order.
  void WriteModes() {
    pen_.Line("G90 ; absolute positions");
    pen_.Line("M83 ; relative E");
  }

  /// Turns all heaters off, and cools until hands may touch.
  void CoolDown() {
    for (const int tool : settings_.tools) {
      pen_.Line(gcode::ToolTemperatureCommand(dialect_, tool, 0));
    }
    pen_.Lines(gcode::CoolBedCommands(dialect_, kTouchableBed_c));
    for (const int tool : settings_.tools) {
      pen_.Lines(gcode::CoolToolCommands(dialect_, tool, kTouchableNozzle_c));
    }
  }

  void WaitForPaper() {
    const std::size_t reference = ReferencePlace(settings_);
    pen_.Line("; the paper comes now, onto a cold bed");
    pen_.ParkForPaper();
    pen_.Line(gcode::WaitForMovesCommand());
    CoolDown();
    if (!settings_.pause) return;
    if (settings_.pause_gcode.empty()) {
      pen_.Lines(gcode::PauseCommands(dialect_, "Tape the paper to the bed, then go on"));
    } else {
      pen_.Block(Expand(settings_.pause_gcode, ToolPlaceholders(plan_, reference, reference)));
    }
  }

  void Heat() {
    const double bed_c = settings::TemperaturesOf(OnPaper(settings_)).bed_c;
    pen_.Line("; heating, aside from the paper");
    pen_.Lines(gcode::DisplayCommands(dialect_, "Heating"));
    WriteModes();
    pen_.Park();
    pen_.Line(fmt::format("M140 S{}", gcode::FormatNumber(bed_c, 1)));
    for (std::size_t place = 0; place < settings_.tools.size(); ++place) {
      pen_.Line(gcode::ToolTemperatureCommand(dialect_, settings_.tools[place],
                                              ToolIdleTemperature_c(settings_, place)));
    }
    if (bed_c > 0) pen_.Line(fmt::format("M190 S{}", gcode::FormatNumber(bed_c, 1)));
  }

  void WriteStart() {
    const std::size_t reference = ReferencePlace(settings_);
    if (paper_ == PaperComes::kInTheFile) {
      pen_.Line("; start G-code");
      pen_.Block(Expand(settings_.start_gcode, SheetPlaceholders(plan_)));
    } else {
      pen_.Line("; homed, cold, and with the paper on the bed already");
    }
    pen_.Line("; pattern");
    pen_.Line("G21 ; mm");
    WriteModes();
    pen_.Lift();
    // Firmwares save offsets with the state: it has to be saved and restored with the same tool.
    ChangeTool(reference, reference);
    pen_.Lines(gcode::SaveStateCommands(dialect_));
    WriteModes();
    pen_.Line("M220 S100 ; speeds as written, whatever override was left over");
    pen_.Line("M221 S100 ; so is the filament");
    pen_.Line("M107 ; no fan on a first layer");
    pen_.Line(gcode::LimitCommand(dialect_, settings_.acceleration_mm_s2, std::nullopt));
    if (paper_ == PaperComes::kInTheFile) WaitForPaper();
    Heat();
  }

  void ChangeTool(std::size_t place, std::size_t previous) {
    pen_.Block(Expand(settings_.tool_change_gcode, ToolPlaceholders(plan_, place, previous)));
    WriteModes();
    pen_.Lift();
  }

  void PutBack(std::size_t place, bool again) {
    if (!settings_.wipe_gcode.empty()) {
      pen_.Lift();
      pen_.Block(Expand(settings_.wipe_gcode, ToolPlaceholders(plan_, place, place)));
      WriteModes();
    }
    pen_.Park();
    pen_.Line(gcode::ToolTemperatureCommand(dialect_, settings_.tools[place],
                                            again ? ToolIdleTemperature_c(settings_, place) : 0));
  }

  void PickUp(const Turn& turn, std::size_t previous) {
    const int tool = settings_.tools[turn.place];
    pen_.Line(fmt::format("; tool {}{}", tool,
                          turn.pick_up == 0 ? "" : fmt::format(", pick-up {}", turn.pick_up)));
    // Heated before it is taken from its dock: there it oozes onto no paper.
    pen_.Lines(gcode::HeatToolCommands(dialect_, tool, ToolTemperature_c(settings_, turn.place)));
    if (turn.place != previous) ChangeTool(turn.place, previous);
    if (!settings_.prime_gcode.empty()) {
      pen_.Block(Expand(settings_.prime_gcode, ToolPlaceholders(plan_, turn.place, previous)));
      WriteModes();
      pen_.Lift();
    }
    const double flow = settings_.flows.empty() ? 1 : settings_.flows[turn.place];
    pen_.TakeTool({flow * gcode::FilamentPerMm(settings_.line_width_mm, settings_.layer_height_mm,
                                               settings_.filament.filament_diameter_mm),
                   settings_.retract_lengths_mm.empty()
                       ? settings_.printer.retract_length_mm
                       : settings_.retract_lengths_mm[turn.place]});
  }

  void Draw(const Turn& turn) {
    const int tool = settings_.tools[turn.place];
    for (const PrimeLine& line : plan_.prime_lines) {
      if (line.tool != tool || line.pick_up != turn.pick_up) continue;
      pen_.Line("; prime line");
      pen_.DrawPrimeLine(line.leg, settings_.prime_length_mm);
    }
    if (turn.pick_up == 0 && tool == settings_.reference_tool) {
      pen_.Line("; box");
      for (const double inset_mm : plan_.box_insets_mm) pen_.DrawBox(inset_mm);
      pen_.Line("; code");
      for (const CodeCell& cell : plan_.code) {
        if (cell.dark) pen_.DrawLeg(CodeLeg(plan_, cell));
      }
    }
    for (const Structure& structure : plan_.structures) {
      for (std::size_t comb = 0; comb < 2; ++comb) {
        if (structure.combs[comb].tool != tool || structure.combs[comb].pick_up != turn.pick_up) {
          continue;
        }
        pen_.Line(fmt::format("; structure {}, comb {}", structure.name, comb));
        for (int finger = 0; finger < settings_.teeth; ++finger) {
          for (const Leg& leg : FingerLegs(plan_, structure, comb, finger)) pen_.DrawLeg(leg);
        }
      }
    }
  }

  void WriteEnd(std::size_t last) {
    const std::size_t reference = ReferencePlace(settings_);
    pen_.Line("; done");
    PutBack(last, false);
    for (const int tool : settings_.tools) {
      pen_.Line(gcode::ToolTemperatureCommand(dialect_, tool, 0));
    }
    if (last != reference) {
      ChangeTool(reference, last);
      pen_.Park();
    }
    if (paper_ == PaperComes::kBefore) {
      pen_.Line("M140 S0");
      pen_.ParkForPaper();
    }
    pen_.Line(gcode::WaitForMovesCommand());
    if (const auto acceleration = settings_.printer.restore_acceleration_mm_s2) {
      pen_.Line(gcode::LimitCommand(dialect_, *acceleration, std::nullopt));
    }
    pen_.Line("M82 ; absolute E, as slicers expect it");
    pen_.Lines(gcode::RestoreStateCommands(dialect_));
    if (paper_ == PaperComes::kBefore) return;
    pen_.Line("; end G-code");
    pen_.Block(Expand(settings_.printer.end_gcode, SheetPlaceholders(plan_)));
  }

  const SheetPlan& plan_;
  const SheetSettings& settings_;
  gcode::Dialect dialect_;
  PaperComes paper_;
  SheetPen pen_;
};

std::string Parked(const SheetPlan& plan, void (SheetPen::*park)()) {
  SheetPen pen(plan);
  pen.Line("G90");
  (pen.*park)();
  pen.Line(gcode::WaitForMovesCommand());
  return pen.Take();
}

}  // namespace

std::string HomeAndPickUpGcode(const SheetPlan& plan) {
  return Writer(plan, PaperComes::kBefore).WritePickUp();
}

std::string ParkForPaperGcode(const SheetPlan& plan) {
  return Parked(plan, &SheetPen::ParkForPaper);
}

std::string ParkAsideGcode(const SheetPlan& plan) { return Parked(plan, &SheetPen::Park); }

std::string DescribeAfterwards(const SheetSettings& settings) {
  return gcode::DescribeAfterwards(
      settings.printer.dialect,
      {{"acceleration", settings.acceleration_mm_s2, settings.printer.restore_acceleration_mm_s2,
        "restore_acceleration"}});
}

SheetGcode WriteSheetGcode(const SheetPlan& plan, PaperComes paper) {
  return Writer(plan, paper).Write();
}

}  // namespace trammel::tool_offset
