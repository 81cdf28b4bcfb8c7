#include "tool_offset/procedure/sheet_print.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>

#include "files/new_file.h"
#include "gcode/bead.h"
#include "gcode/dialect.h"
#include "session/checks.h"
#include "session/print.h"
#include "session/print_needs.h"
#include "session/printer_settings.h"
#include "settings/material.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_settings.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::procedure {
namespace {

using machine::PrinterState;
using tool_offset::SheetPlan;
using Clock = std::chrono::steady_clock;

constexpr double kAsk_s = 10;
constexpr double kMove_s = 600;  // homing, levelling and a tool change; a park
constexpr double kCool_s = 3600;
constexpr const char* kBed = "heater_bed";

Check CheckReach(const machine::PrinterFacts& facts, const SheetPlan& plan) {
  const auto sheet = SheetBounds(plan.settings, plan.width_mm, plan.height_mm);
  const auto aside = settings::ParkPositionOf(plan.settings.printer);
  const auto park = PaperParkOf(plan.settings);
  const machine::Reach& reach = facts.reach;
  if (!reach.Contains(sheet) || !reach.Contains(aside.x_mm, aside.y_mm) ||
      !reach.Contains(park.x_mm, park.y_mm)) {
    return Unsafe(
        "bed",
        fmt::format("sheet and parking places cover X {:.1f} ... {:.1f}, Y {:.1f} ... {:.1f} mm, "
                    "the nozzle reaches {}: set bed_size_x, bed_size_y, bed_origin_x, bed_origin_y "
                    "and bed_shape of [printer]",
                    std::min({sheet.min_x_mm, aside.x_mm, park.x_mm}),
                    std::max({sheet.max_x_mm, aside.x_mm, park.x_mm}),
                    std::min({sheet.min_y_mm, aside.y_mm, park.y_mm}),
                    std::max({sheet.max_y_mm, aside.y_mm, park.y_mm}), reach.Describe()));
  }
  if (park.z_mm > reach.maximum_mm[2]) {
    return Unsafe("bed",
                  fmt::format("paper_clearance: the head is to wait {:.1f} mm above the bed, and "
                              "its Z axis ends at {:.1f} mm",
                              park.z_mm, reach.maximum_mm[2]));
  }
  return Pass("bed", "the sheet lies within the nozzle's reach");
}

/// Checks the tool's heater. The sheet heats T1 as extruder1; a tool with another heater would
/// remain cold, or heat another.
Check CheckHeaterOf(const PrinterTool& tool) {
  const std::string expected = gcode::KlipperExtruder(tool.number);
  const std::string name = fmt::format("tool {}", tool.number);
  if (tool.extruder == expected) return Pass(name, expected);
  return Miss(name, fmt::format("its extruder is {}, and M104 T{} of a sheet heats {}: name the "
                                "tool's [{}] so",
                                tool.extruder.empty() ? "not told" : tool.extruder, tool.number,
                                expected, expected));
}

/// Checks that the printer has T1 if the sheet changes tools by it: unknown, Klipper would run on.
Check CheckToolChange(const Session& session, const std::string& gcode, int tool) {
  constexpr const char* kName = "[tool_offset_pattern] tool_change_gcode";
  if (!gcode.starts_with("T{tool}")) return CheckCommands(session, kName, gcode);
  const std::string command = fmt::format("T{}", tool);
  const auto known = session.printer.HasCommand(command, session.Within(kAsk_s));
  if (!known) return NotMade(kName, known.error());
  if (*known) return Pass(kName, command);
  return Miss(kName, fmt::format("the printer has no command {}: say with --tool-change, or with "
                                 "tool_change_gcode, how it picks up tool {}",
                                 command, tool));
}

settings::FilamentSettings FilamentOf(const SheetPlan& plan, std::size_t place) {
  settings::FilamentSettings filament = OnPaper(plan.settings);
  filament.nozzle_temperature_c = ToolTemperature_c(plan.settings, place);
  filament.idle_nozzle_temperature_c = ToolIdleTemperature_c(plan.settings, place);
  return filament;
}

/// Checks the sheet's assumptions about the printer for one of the tools.
std::vector<Check> CheckTool(const machine::PrinterFacts& facts, const SheetPlan& plan,
                             std::size_t place) {
  const tool_offset::SheetSettings& settings = plan.settings;
  PrintNeeds needs;
  needs.motions = {{0, settings.acceleration_mm_s2}};  // slower legs are drawn as well
  needs.motion_settings = "acceleration of [tool_offset_pattern]";
  needs.filament_diameter_mm = settings.filament.filament_diameter_mm;
  needs.bead_mm2 = gcode::BeadArea_mm2(settings.line_width_mm, settings.layer_height_mm);
  needs.pushed_alone_mm = std::max(settings.printer.retract_length_mm, settings.prime_length_mm);
  needs.rectangular_bed = settings.printer.bed_shape == settings::BedShape::kRectangle;
  std::vector<Check> checks = CompareFacts(facts, needs);
  if (facts.nozzle_diameter_mm) {
    settings::PrinterSettings with = settings.printer;
    with.nozzle_diameter_mm = *facts.nozzle_diameter_mm;
    const auto problem = FindBeadProblem(with, tool_offset::kSheetSection, settings.layer_height_mm,
                                         settings.line_width_mm);
    if (problem) {
      checks.push_back(
          Unsafe("nozzle", fmt::format("[{}] in printer.cfg: [{}] {}: {}", facts.extruder,
                                       problem->section, problem->key, problem->message)));
    }
  }
  checks.push_back(CompareTemperatures(facts, FilamentOf(plan, place)));
  return checks;
}

/// Watches that hands may come near: nobody else uses the printer, it is where it was homed,
/// nothing is on, and all is cold.
class ColdWatch {
 public:
  explicit ColdWatch(const Session& session) : session_(session) {}

  /// Checks the printer's own reports; queries it only occasionally.
  Result<void> Look() {
    TRY(CheckStillHomed(session_));
    const PrinterState now = session_.printer.LastState();
    if (const std::string job = OthersJob(now, session_.own_file); !job.empty()) {
      return Fail(fmt::format("somebody else's job has the printer now ({}): take your hands off, "
                              "and begin again when that has ended",
                              job),
                  ErrorKind::kMachine);
    }
    if (const std::string on = HeatersOn(now); !on.empty()) {
      return Fail(fmt::format("somebody switched a heater on ({}), and the paper comes onto a cold "
                              "bed: begin again when nobody works with the printer",
                              on),
                  ErrorKind::kMachine);
    }
    constexpr std::chrono::seconds kEvery{60};
    if (Clock::now() - told_ < kEvery) return {};
    told_ = Clock::now();
    return KeepAlive(session_);
  }

  /// Names whatever is too warm to touch, with its temperature; empty: all is cold.
  [[nodiscard]] std::string Warm() const {
    std::string text;
    for (const auto& [name, heater] : session_.printer.LastState().heaters) {
      const bool nozzle = name.starts_with("extruder");
      if (!nozzle && name != kBed) continue;  // a chamber warms no hands
      const double limit_c =
          nozzle ? tool_offset::kTouchableNozzle_c : tool_offset::kTouchableBed_c;
      if (heater.temperature_c <= limit_c) continue;
      text += fmt::format("{}{} {:.0f} degC", text.empty() ? "" : ", ", name, heater.temperature_c);
    }
    return text;
  }

 private:
  const Session& session_;
  Clock::time_point told_ = Clock::now();
};

Result<void> HeatersOff(const Session& session) {
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  for (const auto& [name, heater] : state.heaters) {
    if (heater.target_c <= 0) continue;
    TRY(CheckStillFree(session));
    TRY(session.printer.Run(TargetLine(name, 0), session.Within(kAsk_s)));
  }
  return {};
}

Result<void> Stopped() { return Fail("stopped while the printer cooled", ErrorKind::kInterrupted); }

Result<void> WaitUntilCold(const Session& session, ColdWatch& watch) {
  constexpr double kStep_s = 0.5;
  constexpr double kReportEvery_s = 15;
  double said_s = -kReportEvery_s;
  for (double waited_s = 0; waited_s < kCool_s; waited_s += kStep_s) {
    TRY(watch.Look());
    const std::string warm = watch.Warm();
    if (warm.empty()) return {};
    if (waited_s - said_s >= kReportEvery_s) {
      said_s = waited_s;
      session.Report(
          {.text = "letting it cool for hands: " + warm, .remaining_s = {}, .phase = "cooling"});
    }
    if (!Pause(kStep_s, session.stop)) return Stopped();
  }
  return Fail(
      fmt::format("waited {:.0f} s for bed and nozzles to be cold: {}", kCool_s, watch.Warm()),
      ErrorKind::kMachine);
}

Result<void> Move(const Session& session, const std::string& gcode, const char* what,
                  const char* phase) {
  TRY(CheckStillFree(session));
  session.Report({.text = what, .remaining_s = {}, .phase = phase});
  auto moved = RunNoted(session, gcode, kMove_s);
  if (moved) moved = session.printer.FinishMoves(session.Within(kMove_s));
  return moved ? CheckStillReady(session) : moved;
}

/// Checks the active tool, as reported by its extruder.
Result<void> CheckMounted(const Session& session, const SheetPrint& print) {
  const int reference = print.plan.settings.reference_tool;
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  const std::string expected = gcode::KlipperExtruder(reference);
  if (state.active_extruder == expected) return {};
  return Fail(fmt::format("T{} was to be picked up, and {} is active rather than {}: look at "
                          "tool_change_gcode and at the printer's console",
                          reference, state.active_extruder, expected),
              ErrorKind::kMachine);
}

std::string ToolList(const SheetPlan& plan) {
  std::string text;
  for (const int tool : plan.settings.tools) {
    text += fmt::format("{}T{}", text.empty() ? "" : ", ", tool);
  }
  return text;
}

std::string MoveText(const Session& session, const SheetPrint& print) {
  const std::string on = HeatersOn(session.printer.LastState());
  return fmt::format(
      "home the printer, pick up T{} and park it high above the back of the bed{}",
      print.plan.settings.reference_tool,
      on.empty() ? "" : fmt::format("; what is on now goes off and stays off ({})", on));
}

std::string PaperText(const SheetPrint& print) {
  const auto paper = PaperAround(print.plan);
  const std::string place =
      paper ? fmt::format(
                  "{} paper, its middle at X {:.0f}, Y {:.0f} mm, its edges along the "
                  "bed's",
                  paper->name, (paper->bounds.min_x_mm + paper->bounds.max_x_mm) / 2,
                  (paper->bounds.min_y_mm + paper->bounds.max_y_mm) / 2)
            : std::string("the paper as the drawing shows it");
  return fmt::format(
      "bed and nozzles are cold. Now tape {}, flat, along all edges ({} shows it).\n"
      "Is the paper taped down, are your hands out, and shall it heat ({}) and print with {}",
      place, (print.folder / "pattern.png").string(), DescribeTemperatures(print.plan.settings),
      ToolList(print.plan));
}

Result<void> No(const char* what) {
  return Fail(fmt::format("{}, as you answered", what), ErrorKind::kInterrupted);
}

Result<void> PrepareForPaper(const Session& session, const SheetPrint& print, Operator& person,
                             PrinterStateGuard& guard, ColdWatch& watch) {
  // Paper on the bed gets no colder than the bed: nothing starts over a warm one.
  if (person.AnsweredBefore(kPaperQuestion) && !watch.Warm().empty()) {
    return Fail(fmt::format("paper that is taped down beforehand (--yes {}) wants a cold printer: "
                            "{}; let it cool, and begin again",
                            kPaperQuestion, watch.Warm()),
                ErrorKind::kSafety);
  }
  // With any tool mounted: the modes are restored, offsets are each tool's own.
  TRY(guard.Begin(session));
  TRY(HeatersOff(session));
  auto moved =
      Move(session, HomeAndPickUpGcode(print.plan), "homing, and picking up the tool", "homing");
  if (moved) moved = CheckMounted(session, print);
  if (moved) moved = Move(session, ParkForPaperGcode(print.plan), "parking", "homing");
  if (moved) moved = HeatersOff(session);  // heaters on from levelling
  if (moved)
    moved = session.printer
                .WaitUntil([](const PrinterState& now) { return HeatersOn(now).empty(); },
                           "the heaters to be off", session.Within(kAsk_s))
                .map([](const PrinterState&) {});
  if (!moved) return moved;
  return WaitUntilCold(session, watch);
}

/// Heats beside the sheet and waits here, where it can be stopped; all is warm when the file
/// starts.
Result<void> HeatBeside(const Session& session, const SheetPrint& print) {
  TRY(Move(session, ParkAsideGcode(print.plan), "moving beside the sheet", "heating"));
  const tool_offset::SheetSettings& settings = print.plan.settings;
  const double limit_s = print.settings->heat_time_limit_s;
  session.Report("to be heated to " + DescribeTemperatures(settings));
  const double bed_c = settings::TemperaturesOf(OnPaper(settings)).bed_c;
  if (bed_c > 0) {
    TRY(HeatAndWait(session, kBed, bed_c, limit_s));
  }
  for (std::size_t place = 0; place < settings.tools.size(); ++place) {
    const double idle_c = ToolIdleTemperature_c(settings, place);
    if (idle_c <= 0) continue;
    TRY(HeatAndWait(session, gcode::KlipperExtruder(settings.tools[place]), idle_c, limit_s));
  }
  return {};
}

Result<void> NotePrinted(const Session& session, SheetPrint& print) {
  print.record.stage = files::StartStage::kPrinted;
  print.record.printed_s = static_cast<std::int64_t>(std::time(nullptr));
  const auto noted = files::WriteStart(print.folder, print.record);
  // The sheet is printed in any case.
  if (!noted) session.Report("not noted that the sheet is printed: " + noted.error().message);
  return {};
}

Result<void> RunSteps(const Session& session, SheetPrint& print, Operator& person,
                      PrinterStateGuard& guard) {
  const auto free = [&session] { return CheckStillFree(session); };
  const auto may_move = TRY(person.Confirm({kMoveQuestion, MoveText(session, print)}, free));
  if (!may_move) return No("nothing was moved or heated");
  ColdWatch watch(session);
  TRY(PrepareForPaper(session, print, person, guard, watch));
  const auto taped =
      TRY(person.Confirm({kPaperQuestion, PaperText(print)}, [&watch] { return watch.Look(); }));
  if (!taped) return No("nothing was heated or printed");
  TRY(watch.Look());
  TRY(WaitUntilCold(session, watch));
  const auto gcode = WriteSheetGcode(print.plan, tool_offset::PaperComes::kBefore);
  TRY(HeatBeside(session, print));
  // Not earlier: after a stop while heating, the previous sheet must remain the last one.
  print.record.stage = files::StartStage::kPrinting;
  TRY(files::WriteStart(print.folder, print.record));
  PrintOptions options;
  options.heat_time_limit_s =
      print.settings->heat_time_limit_s * static_cast<double>(print.plan.settings.tools.size());
  options.print_time_s = gcode.time_s;
  TRY(Print(session, gcode.text, options));
  return NotePrinted(session, print);
}

}  // namespace

Result<void> CheckSheetPrint(const Session& session, const SheetPrint& print) {
  const SheetPlan& plan = print.plan;
  std::vector<Check> checks = CheckReady(session);
  TRY(FirstFailure(checks, ErrorKind::kMachine));
  checks.clear();
  for (const int tool : plan.settings.tools) {
    const PrinterTool* const known = print.tools.Find(tool);
    if (known == nullptr) {
      return Fail(fmt::format("the printer has no tool {}: its tools are {}", tool, [&print] {
        std::string list;
        for (const PrinterTool& each : print.tools.tools) {
          list += fmt::format("{}T{}", list.empty() ? "" : ", ", each.number);
        }
        return list;
      }()));
    }
    checks.push_back(CheckHeaterOf(*known));
  }
  checks.push_back(
      CheckCommands(session, "[tool_offset_pattern] start_gcode", plan.settings.start_gcode));
  for (const int tool : plan.settings.tools) {
    checks.push_back(CheckToolChange(session, plan.settings.tool_change_gcode, tool));
  }
  TRY(FirstFailure(checks, ErrorKind::kMachine));
  checks = {CheckCarriages(print.tools, plan.settings.tool_change_gcode)};
  for (std::size_t place = 0; place < plan.settings.tools.size(); ++place) {
    const auto facts = TRY(ReadFacts(session, gcode::KlipperExtruder(plan.settings.tools[place])));
    for (Check& check : CheckTool(facts, plan, place)) checks.push_back(std::move(check));
    if (place == 0) checks.push_back(CheckReach(facts, plan));
  }
  TRY(FirstFailure(checks, ErrorKind::kSafety));
  constexpr double kScanAndReport = 3e8;
  return FirstFailure({CheckDisk(print.folder, kScanAndReport)}, ErrorKind::kInput);
}

GuardedOutcome PrintSheet(Session& session, SheetPrint& print, Operator& person) {
  const auto park = PaperParkOf(print.plan.settings);
  const settings::PrinterSettings& printer = print.plan.settings.printer;
  GuardedSteps run;
  run.settings = print.settings;
  run.identity.run = print.record.run;
  run.identity.started = print.record.started;
  run.identity.state_folder = print.state_folder;
  run.identity.without_laser = true;
  run.identity.heaters_end_off = true;
  run.identity.changes_tools = true;
  run.park = {park.z_mm, park.x_mm, park.y_mm, printer.z_speed_mm_s, printer.travel_speed_mm_s};
  run.check = [&](const Session& taken) -> Result<void> {
    for (const char* question : {kMoveQuestion, kPaperQuestion}) {
      TRY(person.CheckCanAnswer(question));
    }
    return CheckSheetPrint(taken, print);
  };
  run.steps = [&](const Session& taken, PrinterStateGuard& guard) {
    return RunSteps(taken, print, person, guard);
  };
  return RunGuarded(session, run);
}

}  // namespace trammel::procedure
