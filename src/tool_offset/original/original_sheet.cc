#include "tool_offset/original/original_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace trammel::tool_offset {
namespace {

// Published; lengths along the print's axes.
constexpr double kAcross_mm = 8;  // of a structure: both spines
constexpr double kGap_mm = 3;     // between structures
constexpr double kStep_mm = kAcross_mm + kGap_mm;
constexpr double kPlaced_mm = 70;    // the length of a structure as places are computed
constexpr double kDrawn_mm = 68;     // and of whole periods, as the box is
constexpr double kBoxGap_mm = 5;     // around everything
constexpr double kBoxLine_mm = 0.4;  // from one line to the next
constexpr double kPitch_mm = 4;
constexpr int kTeeth = 17;
constexpr double kSpacing_mm = 0.75;
constexpr double kOverlap_mm = 4;
constexpr double kReferenceStart_mm = 2;  // of the reference comb's first leg along the structure
constexpr double kLineWidth_mm = 0.44;    // 0.4 mm nozzle, 1.1 times the filament

/// Beside its turns a leg is not where it was commanded until the slower axis has taken up its
/// play: 0.23 mm for 60 µm at 15 degrees.
constexpr double kBesideTurn_mm = 0.5;

/// @param count  how many structures before this one would have the same name.
std::string Name(int tool, Purpose purpose, Axis axis, bool plus, int count) {
  const std::string of = purpose == Purpose::kTool      ? fmt::format("T{}", tool)
                         : purpose == Purpose::kControl ? "control"
                                                        : "self-test";
  const std::string name =
      fmt::format("{} {}{}", of, axis == Axis::kX ? 'X' : 'Y', plus ? '+' : '-');
  return count == 0 ? name : fmt::format("{} {}", name, count + 1);
}

/// @param start_mm   of the structure along its axis
/// @param across_mm  of its lower edge across
Structure OneStructure(const OriginalSheet& sheet, std::size_t pair, Axis axis, bool plus,
                       double start_mm, double across_mm) {
  Structure structure;
  structure.axis = axis;
  structure.swapped = !plus;
  const Comb reference{sheet.reference_tool, 1, 0, {}};
  const Comb tested{sheet.tools[pair], plus ? 1 : -1, 0, sheet.moved[pair]};
  structure.combs = {plus ? tested : reference, plus ? reference : tested};
  const bool moved = tested.programmed.u_mm != 0 || tested.programmed.v_mm != 0;
  structure.purpose = tested.tool != sheet.reference_tool ? Purpose::kTool
                      : moved                             ? Purpose::kSelfTest
                                                          : Purpose::kControl;
  // The very first leg of every comb is a travel.
  structure.incomplete = plus ? std::array{0, 0} : std::array{0, kTeeth - 1};
  // The reference comb's fingers are the same in both; of "-" they come first.
  const double first_mm = start_mm + kReferenceStart_mm + kSpacing_mm / 2;
  const double half_mm = (kTeeth - 1) / 2.0 * kPitch_mm;
  const double along_mm = first_mm + half_mm + (plus ? -kPitch_mm : kPitch_mm) / 4;
  const double middle_mm = across_mm + kAcross_mm / 2;
  structure.middle =
      axis == Axis::kX ? SheetPoint{along_mm, middle_mm} : SheetPoint{middle_mm, along_mm};
  return structure;
}

/// What cannot be told from this sheet; goes with every result of it.
std::vector<std::string> NoticesOf(const OriginalSheet& sheet) {
  std::vector<std::string> notices{
      "identity not checked: an original sheet carries no number. Another sheet of as many tools, "
      "another order of the tools or another reference tool than were stated cannot be noticed"};
  const bool control =
      std::find(sheet.tools.begin(), sheet.tools.end(), sheet.reference_tool) != sheet.tools.end();
  if (!control) {
    notices.push_back(fmt::format(
        "no control: T{} is not in the list of tools, so that no structure of a known offset shows "
        "the method's own bias; the intervals hold the scatter of the lines alone",
        sheet.reference_tool));
  }
  const bool alone = std::all_of(sheet.tools.begin(), sheet.tools.end(),
                                 [&](int tool) { return tool == sheet.reference_tool; });
  if (alone) {
    notices.push_back(fmt::format("T{} alone has drawn this sheet: no tool has an offset on it",
                                  sheet.reference_tool));
  }
  std::string moved;
  for (std::size_t i = 0; i < sheet.tools.size(); ++i) {
    const SheetPoint& by = sheet.moved[i];
    if (sheet.tools[i] == sheet.reference_tool || (by.u_mm == 0 && by.v_mm == 0)) continue;
    moved += fmt::format("{}T{} by {:+.3f} / {:+.3f} mm", moved.empty() ? "" : ", ", sheet.tools[i],
                         by.u_mm, by.v_mm);
  }
  if (!moved.empty()) {
    notices.push_back(fmt::format(
        "the file moves combs on purpose along the print's axes ({}), which is taken off. Whether "
        "the sheet was printed with just these cannot be seen on a tool that is listed once",
        moved));
  }
  return notices;
}

}  // namespace

Result<void> Validate(const OriginalSheet& sheet) {
  if (sheet.tools.empty() || static_cast<int>(sheet.tools.size()) > kMostOriginalPairs) {
    return Fail(fmt::format("the list of tools has {} entries, an original sheet has 1 to {}",
                            sheet.tools.size(), kMostOriginalPairs));
  }
  if (std::min(sheet.reference_tool, *std::min_element(sheet.tools.begin(), sheet.tools.end())) <
      0) {
    return Fail("lines are drawn before any tool is named");
  }
  constexpr double kLeast_deg = 5;  // less, and one axis hardly moves along a leg
  constexpr double kMost_deg = 40;  // more, and the two axes' play cannot be told apart
  if (!(sheet.rotation_deg >= kLeast_deg && sheet.rotation_deg <= kMost_deg)) {
    return Fail(fmt::format("the print is turned by {:.4g} degrees on the bed; {} to {} are read",
                            sheet.rotation_deg, kLeast_deg, kMost_deg));
  }
  constexpr double kMost_mm = 0.5;  // legs of both combs still stand apart
  for (const SheetPoint& by : sheet.moved) {
    if (std::max(std::abs(by.u_mm), std::abs(by.v_mm)) <= kMost_mm) continue;
    return Fail(fmt::format("a pair is moved by {:.4g} / {:.4g} mm on purpose; up to {} are read",
                            by.u_mm, by.v_mm, kMost_mm));
  }
  return {};
}

SheetPlan PlanOriginal(const OriginalSheet& sheet) {
  SheetPlan plan;
  plan.original = true;
  plan.leg_end_mm = kBesideTurn_mm;
  plan.turn_mm = kSpacing_mm / 2 + kLineWidth_mm / 2;
  SheetSettings& settings = plan.settings;
  settings.tools.clear();
  for (const int tool : sheet.tools) {
    if (std::find(settings.tools.begin(), settings.tools.end(), tool) == settings.tools.end()) {
      settings.tools.push_back(tool);
    }
  }
  settings.reference_tool = sheet.reference_tool;
  if (std::find(settings.tools.begin(), settings.tools.end(), sheet.reference_tool) ==
      settings.tools.end()) {
    settings.tools.insert(settings.tools.begin(), sheet.reference_tool);
  }
  settings.pitch_mm = kPitch_mm;
  settings.teeth = kTeeth;
  settings.leg_spacing_mm = kSpacing_mm;
  settings.leg_length_mm = kOriginalLeg_mm;
  settings.overlap_mm = kOverlap_mm;
  settings.structure_gap_mm = kGap_mm;
  settings.tilt_deg = sheet.rotation_deg;
  settings.line_width_mm = kLineWidth_mm;
  settings.printer.dialect = gcode::Dialect::kRepRapFirmware;
  plan.box_insets_mm = {0, kBoxLine_mm, 2 * kBoxLine_mm};
  const auto pairs = static_cast<double>(sheet.tools.size());
  const double across_mm = 2 * kStep_mm * pairs - kGap_mm;  // of all structures of an axis
  plan.width_mm = across_mm + kGap_mm + kDrawn_mm + 2 * kBoxGap_mm;
  plan.height_mm = std::max(across_mm, kDrawn_mm) + 2 * kBoxGap_mm;
  const double placed_mm = across_mm + kGap_mm + kPlaced_mm;
  std::map<std::string, int> named;
  for (const Axis axis : {Axis::kX, Axis::kY}) {
    const bool is_x = axis == Axis::kX;
    for (std::size_t pair = 0; pair < sheet.tools.size(); ++pair) {
      for (const bool plus : {true, false}) {
        const double aside_mm = kStep_mm * (2 * static_cast<double>(pair) + (plus ? 0 : 1));
        Structure structure =
            is_x
                ? OneStructure(sheet, pair, axis, plus, placed_mm / 2 - kPlaced_mm,
                               -across_mm / 2 + aside_mm)
                : OneStructure(sheet, pair, axis, plus, -kPlaced_mm / 2, -placed_mm / 2 + aside_mm);
        const int tool = sheet.tools[pair];
        int& before = named[Name(tool, structure.purpose, axis, plus, 0)];
        structure.name = Name(tool, structure.purpose, axis, plus, before++);
        plan.structures.push_back(std::move(structure));
      }
    }
  }
  plan.notices = NoticesOf(sheet);
  return plan;
}

}  // namespace trammel::tool_offset
