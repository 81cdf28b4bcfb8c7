#include "tool_offset/sheet/sheet_gcode.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "base/check.h"
#include "gcode/bead.h"
#include "gcode/dialect.h"
#include "gcode/number.h"
#include "gcode/placeholders.h"
#include "gcode/tool_commands.h"
#include "settings/material.h"
#include "tool_offset/sheet/sheet_comments.h"
#include "tool_offset/sheet/sheet_pen.h"
#include "tool_offset/sheet/sheet_placeholders.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::tool_offset {
namespace {

/// What one tool draws between being picked up and being put back.
struct Turn {
  std::size_t place = 0;  ///< in `tools`
  int pick_up = 0;
};

/// Every tool once per pick-up, the reference tool first. A tool's next turn never follows its own:
/// in between it is put back.
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

  /// Modes that the user's own G-code may have left in any state. Marlin's G90 makes E absolute
  /// too, hence the order.
  void WriteModes() {
    pen_.Line("G90 ; absolute positions");
    pen_.Line("M83 ; relative E");
  }

  /// Off, and cool enough for hands.
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
    pen_.Line(gcode::DisplayCommand("Heating"));
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
    // Firmwares keep offsets with the state: it has to be kept and brought back with one tool.
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
    // Hot before it is taken from its dock: there it oozes onto no paper.
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

}  // namespace

namespace {

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
