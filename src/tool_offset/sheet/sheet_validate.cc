#include "tool_offset/sheet/sheet_validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <set>

#include "base/check.h"
#include "gcode/dialect.h"
#include "settings/material.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_layout.h"
#include "tool_offset/sheet/sheet_plan.h"
#include "tool_offset/sheet/sheet_settings.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::tool_offset {
namespace {

constexpr std::array<double, 6> kPeriods_mm{2, 0.8, 0.64, 0.4, 0.32, 0.2};

/// Gain of one motor: its travel per mm along the measured direction, and the measured point's
/// travel per mm of the motor.
struct Motor {
  double travel = 0;
  double share = 0;
};

std::array<Motor, 4> Motors(double tilt_deg) {
  const double tilt_rad = std::abs(tilt_deg) * std::numbers::pi / 180;
  const double x = std::cos(tilt_rad);
  const double y = std::sin(tilt_rad);
  // CoreXY: each belt moves by x ± y, and half of its error affects either axis.
  return {{{x, x}, {y, y}, {x + y, (x + y) / 2}, {std::abs(x - y), std::abs(x - y) / 2}}};
}

/// Computes the difference between the means of both combs by a motor's error, per amplitude.
double CombDifference(double step_cycles, int teeth) {
  using std::numbers::pi;
  std::complex<double> sum = 0;
  for (int tooth = 0; tooth < teeth; ++tooth) sum += std::polar(1.0, 2 * pi * tooth * step_cycles);
  return std::abs(sum) / teeth * std::abs(1.0 - std::polar(1.0, pi * step_cycles));
}

}  // namespace

double MotorErrorShare(double pitch_mm, int teeth, double tilt_deg) {
  TRAMMEL_CHECK(teeth > 0, "teeth = {}", teeth);
  double worst = 0;
  for (const Motor& motor : Motors(tilt_deg)) {
    for (const double period_mm : kPeriods_mm) {
      worst =
          std::max(worst, motor.share * CombDifference(pitch_mm * motor.travel / period_mm, teeth));
    }
  }
  return worst;
}

double NearestGoodPitch_mm(double pitch_mm, int teeth, double tilt_deg) {
  constexpr int kSteps = 100;
  const long long nearest = std::llround(pitch_mm * 100);
  double best_mm = pitch_mm;
  double best_share = MotorErrorShare(pitch_mm, teeth, tilt_deg);
  for (int step = 0; step <= kSteps && best_share >= kGoodMotorErrorShare; ++step) {
    for (const int sign : {1, -1}) {
      const double candidate_mm = static_cast<double>(nearest + sign * step) / 100;
      if (candidate_mm < 2) continue;
      const double share = MotorErrorShare(candidate_mm, teeth, tilt_deg);
      if (share >= best_share) continue;
      best_share = share;
      best_mm = candidate_mm;
    }
  }
  return best_mm;
}

namespace {

using Problem = std::optional<settings::SettingProblem>;

/// Backlash of an axis that is taken up before a leg begins: twice that of worn belts.
constexpr double kMaxBacklash_mm = 0.2;
/// Minimum white between a finger and the next for a reader: 6 px at 300 dpi.
constexpr double kMinGap_mm = 0.5;

Problem InSheet(const char* key, std::string message) {
  return settings::SettingProblem{std::string(kSheetSection), key, std::move(message)};
}

Problem CheckFields(const SheetSettings& settings) {
  if (Problem problem = settings::FindFieldProblems(settings.printer, settings::PrinterFields())) {
    return problem;
  }
  if (Problem problem =
          settings::FindFieldProblems(settings.filament, settings::FilamentFields())) {
    return problem;
  }
  if (Problem problem = settings::FindMaterialProblem(settings.filament)) return problem;
  return settings::FindFieldProblems(settings, SheetFields());
}

Problem CheckFirmware(const SheetSettings& settings) {
  const gcode::FirmwareWords& words = gcode::WordsOf(settings.printer.dialect);
  if (words.writes_tool_offsets) return std::nullopt;
  return settings::SettingProblem{
      "printer", "dialect",
      fmt::format("{}: sheets of several tools are not written for {}; its tool changes need its "
                  "slicer's own G-code",
                  words.name, words.title)};
}

Problem CheckTools(const SheetSettings& settings) {
  constexpr std::size_t kMaxTools = 8;
  const std::vector<int>& tools = settings.tools;
  if (settings.self_test && tools.size() != 1) {
    return InSheet("tools", fmt::format("{} tools; a self-test has one", tools.size()));
  }
  if (!settings.self_test && (tools.size() < 2 || tools.size() > kMaxTools)) {
    return InSheet("tools", fmt::format("{} tool(s); a sheet has 2 ... {}, the reference among "
                                        "them (one alone: self_test = true)",
                                        tools.size(), kMaxTools));
  }
  std::set<int> seen;
  for (const int tool : tools) {
    if (!seen.insert(tool).second) {
      return InSheet("tools", fmt::format("{} stands twice; name each tool once", tool));
    }
  }
  if (!seen.contains(settings.reference_tool)) {
    return InSheet("reference_tool",
                   fmt::format("{} is not among tools = [{}]; add it or choose one of them",
                               settings.reference_tool, fmt::join(tools, ", ")));
  }
  if (settings.self_test && settings.pick_ups > 0) {
    return InSheet("pick_ups", fmt::format("{} in a self-test: one tool is never put back; "
                                           "leave one of the two out",
                                           settings.pick_ups));
  }
  const auto check_list = [&](const char* key, const std::vector<double>& list) -> Problem {
    if (list.empty() || list.size() == tools.size()) return std::nullopt;
    return InSheet(key, fmt::format("{} value(s) for {} tool(s); give one for each, or none",
                                    list.size(), tools.size()));
  };
  if (auto problem = check_list("nozzle_temperatures", settings.nozzle_temperatures_c)) {
    return problem;
  }
  if (auto problem = check_list("retract_lengths", settings.retract_lengths_mm)) return problem;
  return check_list("flows", settings.flows);
}

double UpToHundredths(double value) { return std::ceil(value * 100 - 1e-6) / 100; }

Problem CheckCombs(const SheetSettings& settings) {
  constexpr double kMinAlone_mm = 1;  // leg length with only its own comb
  constexpr double kLargestSelfTest_mm = 0.5;
  constexpr double kMinTilt_deg = 5;
  if (settings.controls % 2 != 0) {
    return InSheet("controls", fmt::format("{} cannot be halved between both directions; take {}",
                                           settings.controls, settings.controls + 1));
  }
  if (std::abs(settings.tilt_deg) < kMinTilt_deg) {
    return InSheet("tilt", fmt::format("{}° is less than {}° either way: legs would run along one "
                                       "axis and leave the other's belt slack",
                                       settings.tilt_deg, kMinTilt_deg));
  }
  if (settings.overlap_mm > settings.leg_length_mm - kMinAlone_mm) {
    return InSheet("overlap",
                   fmt::format("{} mm is above {} mm: of leg_length = {} mm at least {} "
                               "mm have to stand alone",
                               settings.overlap_mm, settings.leg_length_mm - kMinAlone_mm,
                               settings.leg_length_mm, kMinAlone_mm));
  }
  if (settings.leg_spacing_mm < settings.line_width_mm) {
    return InSheet(
        "leg_spacing",
        fmt::format("{} mm is below line_width = {} mm: the legs of a finger would merge",
                    settings.leg_spacing_mm, settings.line_width_mm));
  }
  const double gap_mm = settings.pitch_mm / 2 - settings.leg_spacing_mm - settings.line_width_mm;
  const double min_mm = kMinGap_mm + (settings.self_test ? kLargestSelfTest_mm / 2 : 0);
  constexpr double kRounding_mm = 1e-9;
  if (gap_mm < min_mm - kRounding_mm) {
    return InSheet("pitch",
                   fmt::format("{} mm leaves {:.3f} mm between fingers of both combs, at least {} "
                               "mm; take {:.4g} mm or more, or narrower fingers",
                               settings.pitch_mm, gap_mm, min_mm,
                               UpToHundredths(settings.pitch_mm + 2 * (min_mm - gap_mm))));
  }
  const double run_in_mm =
      kMaxBacklash_mm / std::sin(std::abs(settings.tilt_deg) * std::numbers::pi / 180);
  if (settings.run_in_mm < run_in_mm) {
    return InSheet("run_in", fmt::format("{} mm is below {:.4g} mm: turned by {}°, less does not "
                                         "take up {} mm of play in both axes",
                                         settings.run_in_mm, UpToHundredths(run_in_mm),
                                         settings.tilt_deg, kMaxBacklash_mm));
  }
  return std::nullopt;
}

Problem CheckPrinter(const SheetSettings& settings) {
  constexpr double kMinHop_mm = 0.2;
  if (Problem problem = settings::FindBeadProblem(
          settings.printer, kSheetSection, settings.layer_height_mm, settings.line_width_mm)) {
    return problem;
  }
  if (settings.printer.z_hop_mm < kMinHop_mm) {
    return settings::SettingProblem{
        "printer", "z_hop",
        fmt::format("{} mm is below {} mm: the nozzle would drag through lines and paper",
                    settings.printer.z_hop_mm, kMinHop_mm)};
  }
  return settings::FindParkProblem(settings.printer);
}

Problem CheckPaper(const SheetSettings& settings) {
  if (settings.paper == "any" || FindPaper(settings.paper)) return std::nullopt;
  std::string known;
  for (const PaperSize& paper : PaperSizes()) known += std::string(paper.name) + ", ";
  return InSheet("paper", fmt::format("there is no \"{}\"; it must be one of {}or any",
                                      settings.paper.substr(0, 40), known));
}

bool Fits(const SheetSettings& settings) {
  constexpr double kRounding = 1e-9;
  const SheetPlan plan = PlanSheet(settings);
  return FitsItsPaper(plan) && SheetReach(settings, plan.width_mm, plan.height_mm) <= 1 + kRounding;
}

/// Returns the smallest paper that fits the sheet unchanged.
std::optional<PaperSize> LargerPaper(SheetSettings settings) {
  for (const PaperSize& paper : PaperSizes()) {
    settings.paper = paper.name;
    if (Fits(settings)) return paper;
  }
  return std::nullopt;
}

/// Describes the maximum number of tools whose sheet would fit; empty if two do not.
std::string FewerTools(SheetSettings settings) {
  while (settings.tools.size() > 2) {
    const bool last_is_reference = settings.tools.back() == settings.reference_tool;
    settings.tools.erase(settings.tools.end() - (last_is_reference ? 2 : 1));
    if (!Fits(settings)) continue;
    return fmt::format("{} tools would fit: print several sheets, each with the reference",
                       settings.tools.size());
  }
  return {};
}

/// Reports a sheet that does not fit its paper with any number of teeth.
Problem CheckFitsPaper(const SheetSettings& settings) {
  const SheetPlan plan = PlanSheet(settings);
  if (FitsItsPaper(plan)) return std::nullopt;
  const PaperSize paper = *FindPaper(settings.paper);
  const BedBounds bounds = SheetBounds(settings, plan.width_mm, plan.height_mm);
  const auto larger = LargerPaper(settings);
  std::string remedy = larger ? fmt::format("paper = {} would take it", larger->name) : "";
  if (const std::string fewer = FewerTools(settings); !fewer.empty()) {
    remedy += (remedy.empty() ? "" : ", or ") + fewer;
  }
  if (remedy.empty()) remedy = "take fewer teeth, a smaller pitch or fewer controls";
  return InSheet(
      "paper",
      fmt::format("the sheet for {} tool(s) with {} teeth takes {:.0f} x {:.0f} mm of the bed, but "
                  "{} less {} mm on each side is {:.0f} x {:.0f} mm; {}",
                  settings.tools.size(), plan.settings.teeth, bounds.max_x_mm - bounds.min_x_mm,
                  bounds.max_y_mm - bounds.min_y_mm, paper.name, kPaperMargin_mm,
                  paper.short_mm - 2 * kPaperMargin_mm, paper.long_mm - 2 * kPaperMargin_mm,
                  remedy));
}

/// Suggests what to reduce so that the sheet fits the bed.
std::string Remedy(SheetSettings settings) {
  if (settings.position_x_mm || settings.position_y_mm) {
    settings.position_x_mm.reset();
    settings.position_y_mm.reset();
    if (Fits(settings)) return "it fits without position_x and position_y, centred";
  }
  for (SheetSettings fewer = settings; fewer.teeth > kFewestTeethToFit;) {
    --fewer.teeth;
    if (Fits(fewer)) return fmt::format("teeth = {} would fit", fewer.teeth);
  }
  if (std::string fewer = FewerTools(settings); !fewer.empty()) return fewer;
  return "take fewer teeth, a smaller pitch or fewer controls";
}

Problem CheckFit(const SheetSettings& settings) {
  const SheetPlan plan = PlanSheet(settings);
  if (Fits(settings)) return std::nullopt;
  const BedBounds bounds = SheetBounds(settings, plan.width_mm, plan.height_mm);
  const settings::PrinterSettings& printer = settings.printer;
  const char* key = settings.position_x_mm   ? "position_x"
                    : settings.position_y_mm ? "position_y"
                                             : "tools";
  return InSheet(
      key, fmt::format("the sheet for {} tool(s), {:.1f} x {:.1f} mm turned by {}°, reaches x = "
                       "{:.1f} ... {:.1f} mm, y = {:.1f} ... {:.1f} mm, but the {} bed less "
                       "bed_margin = {} mm is {} ... {} mm, {} ... {} mm; {}",
                       settings.tools.size(), plan.width_mm, plan.height_mm, settings.tilt_deg,
                       bounds.min_x_mm, bounds.max_x_mm, bounds.min_y_mm, bounds.max_y_mm,
                       ToString(printer.bed_shape), printer.bed_margin_mm,
                       printer.bed_origin_x_mm + printer.bed_margin_mm,
                       printer.bed_origin_x_mm + printer.bed_size_x_mm - printer.bed_margin_mm,
                       printer.bed_origin_y_mm + printer.bed_margin_mm,
                       printer.bed_origin_y_mm + printer.bed_size_y_mm - printer.bed_margin_mm,
                       Remedy(settings)));
}

Problem CheckUserGcode(const SheetSettings& settings) {
  const SheetPlan plan = PlanSheet(settings);
  const std::vector<gcode::Placeholder> known = SheetPlaceholders(plan);
  if (const auto expanded = gcode::ExpandPlaceholders(settings.printer.end_gcode, known);
      !expanded) {
    return settings::SettingProblem{"printer", "end_gcode", expanded.error().message};
  }
  if (const auto expanded = gcode::ExpandPlaceholders(settings.start_gcode, known); !expanded) {
    return InSheet("start_gcode", expanded.error().message);
  }
  const std::vector<gcode::Placeholder> of_tool = ToolPlaceholders(plan, 0, 0);
  for (const auto& [key, text] : {std::pair{"tool_change_gcode", &settings.tool_change_gcode},
                                  std::pair{"prime_gcode", &settings.prime_gcode},
                                  std::pair{"wipe_gcode", &settings.wipe_gcode},
                                  std::pair{"pause_gcode", &settings.pause_gcode}}) {
    if (const auto expanded = gcode::ExpandPlaceholders(*text, of_tool); !expanded) {
      return InSheet(key, expanded.error().message);
    }
  }
  const std::string& change = settings.tool_change_gcode;
  if (settings.tools.size() > 1 && change.find("{tool}") == std::string::npos &&
      change.find("{extruder}") == std::string::npos) {
    return InSheet("tool_change_gcode",
                   fmt::format("\"{}\" names neither {{tool}} nor {{extruder}}: every tool would "
                               "be the same",
                               change.substr(0, 40)));
  }
  return std::nullopt;
}

}  // namespace

std::optional<settings::SettingProblem> FindProblem(const SheetSettings& settings) {
  // Ranges first: later checks divide and multiply.
  for (auto check : {CheckFields, CheckFirmware, CheckTools, CheckCombs, CheckPrinter, CheckPaper,
                     CheckFitsPaper, CheckFit, CheckUserGcode}) {
    if (Problem problem = check(settings)) return problem;
  }
  return std::nullopt;
}

Result<void> Validate(const SheetSettings& settings) {
  if (const Problem problem = FindProblem(settings)) {
    return Fail(fmt::format("[{}] {}: {}", problem->section, problem->key, problem->message));
  }
  return {};
}

std::vector<std::string> FindWarnings(const SheetSettings& settings) {
  std::vector<std::string> warnings;
  const double share = MotorErrorShare(settings.pitch_mm, settings.teeth, settings.tilt_deg);
  if (share >= kGoodMotorErrorShare) {
    const double better_mm =
        NearestGoodPitch_mm(settings.pitch_mm, settings.teeth, settings.tilt_deg);
    warnings.push_back(fmt::format(
        "pitch = {} mm locks to a motor cycle: with {} teeth at {}° it leaves {:.0f} % of a "
        "periodic error of the motors; {:.2f} mm leaves {:.0f} %",
        settings.pitch_mm, settings.teeth, settings.tilt_deg, 100 * share, better_mm,
        100 * MotorErrorShare(better_mm, settings.teeth, settings.tilt_deg)));
  }
  return warnings;
}

}  // namespace trammel::tool_offset
