#include "tool_offset/sheet/sheet_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_layout.h"

namespace trammel::tool_offset {
namespace {

/// Programmed offsets of a self-test, along the axis that each structure measures: no two alike,
/// both signs and all sizes up to where teeth nearly touch.
constexpr std::array<std::array<double, 8>, 2> kSelfTestOffsets_mm{{
    {0.05, -0.12, 0.2, -0.28, 0.35, -0.43, 0.5, -0.47},
    {-0.08, 0.16, -0.24, 0.31, -0.39, 0.46, -0.5, 0.03},
}};

char Letter(Axis axis) { return axis == Axis::kX ? 'X' : 'Y'; }
char Sign(int direction) { return direction > 0 ? '+' : '-'; }

/// "control X+", and "control X+ 2" for the second of the kind.
std::string ControlName(Axis axis, int direction, int number) {
  const std::string name = fmt::format("control {}{}", Letter(axis), Sign(direction));
  return number == 0 ? name : fmt::format("{} {}", name, number + 1);
}

/// Returns controls alternating + and -, the two backlash structures a third and two thirds of the
/// way along.
std::vector<Structure> ReferenceStructures(const SheetSettings& settings, Axis axis) {
  const int tool = settings.reference_tool;
  std::vector<Structure> list;
  for (int i = 0; i < settings.controls; ++i) {
    const int direction = i % 2 == 0 ? 1 : -1;
    const Comb comb{tool, direction, 0, {}};
    list.push_back(
        {ControlName(axis, direction, i / 2), Purpose::kControl, axis, {}, {comb, comb}});
  }
  const std::array<std::size_t, 2> places{list.size() / 3 + 1, list.size() - list.size() / 3};
  for (int i = 0; i < 2; ++i) {
    const int direction = i == 0 ? 1 : -1;
    const Structure backlash{fmt::format("backlash {} {}", Letter(axis), i + 1),
                             Purpose::kBacklash,
                             axis,
                             {},
                             {Comb{tool, direction, 0, {}}, Comb{tool, -direction, 0, {}}}};
    list.insert(list.begin() + static_cast<std::ptrdiff_t>(places[static_cast<std::size_t>(i)]),
                backlash);
  }
  return list;
}

std::vector<Structure> ToolStructures(const SheetSettings& settings, Axis axis) {
  std::vector<Structure> list;
  for (const int direction : {1, -1}) {
    for (const int tool : settings.tools) {
      if (tool == settings.reference_tool) continue;
      // The roles are swapped with the direction: the method's own bias changes sign.
      const Comb reference{settings.reference_tool, direction, 0, {}};
      const Comb tested{tool, direction, 0, {}};
      list.push_back({fmt::format("T{} {}{}", tool, Letter(axis), Sign(direction)),
                      Purpose::kTool,
                      axis,
                      {},
                      {direction > 0 ? reference : tested, direction > 0 ? tested : reference}});
    }
  }
  return list;
}

std::vector<Structure> PickUpStructures(const SheetSettings& settings, Axis axis) {
  std::vector<Structure> list;
  for (int pick_up = 1; pick_up <= settings.pick_ups; ++pick_up) {
    for (const int tool : settings.tools) {
      list.push_back({fmt::format("T{} {} pick-up {}", tool, Letter(axis), pick_up),
                      Purpose::kPickUp,
                      axis,
                      {},
                      {Comb{tool, 1, 0, {}}, Comb{tool, 1, pick_up, {}}}});
    }
  }
  return list;
}

std::vector<Structure> SelfTestStructures(const SheetSettings& settings, Axis axis) {
  std::vector<Structure> list;
  const int tool = settings.reference_tool;
  const auto& offsets_mm = kSelfTestOffsets_mm[axis == Axis::kX ? 0 : 1];
  for (std::size_t i = 0; i < offsets_mm.size(); ++i) {
    const int direction = i % 2 == 0 ? 1 : -1;
    const SheetPoint moved = PointAt(axis, offsets_mm[i], 0);
    const Comb still{tool, direction, 0, {}};
    const Comb programmed{tool, direction, 0, moved};
    list.push_back({fmt::format("self-test {} {}", Letter(axis), i + 1),
                    Purpose::kSelfTest,
                    axis,
                    {},
                    {direction > 0 ? still : programmed, direction > 0 ? programmed : still}});
  }
  return list;
}

/// `some` evenly among `others`.
std::vector<Structure> Spread(std::vector<Structure> others, const std::vector<Structure>& some) {
  const std::size_t total = others.size() + some.size();
  for (std::size_t i = 0; i < some.size(); ++i) {
    const std::size_t place = (2 * i + 1) * total / (2 * some.size());
    others.insert(others.begin() + static_cast<std::ptrdiff_t>(std::min(place, others.size())),
                  some[i]);
  }
  return others;
}

/// Returns all structures that measure along `axis`, not yet placed. The + structures of all tools
/// precede their - structures, with controls and backlash evenly among them: placed in this order,
/// related structures are never in one corner of the paper.
std::vector<Structure> ListStructures(const SheetSettings& settings, Axis axis) {
  std::vector<Structure> list =
      settings.self_test ? SelfTestStructures(settings, axis) : ToolStructures(settings, axis);
  const std::vector<Structure> pick_ups = PickUpStructures(settings, axis);
  list.insert(list.end(), pick_ups.begin(), pick_ups.end());
  return Spread(std::move(list), ReferenceStructures(settings, axis));
}

/// CRC-16 (polynomial 0x1021, start 0xffff) of whole numbers.
class CheckSum {
 public:
  void Add(long long number) {
    for (int byte = 0; byte < 8; ++byte) {
      sum_ ^= static_cast<std::uint32_t>(number >> (8 * byte) & 0xff) << 8;
      for (int bit = 0; bit < 8; ++bit) {
        sum_ = (sum_ << 1) ^ ((sum_ & 0x8000u) != 0 ? 0x11021u : 0u);
      }
    }
  }
  /// Adds a length in µm: coarser than any rounding, finer than any reading.
  void AddLength(double length_mm) { Add(std::llround(length_mm * 1000)); }
  void Add(const Leg& leg) {
    for (const SheetPoint& point : {leg.start, leg.end}) {
      AddLength(point.u_mm);
      AddLength(point.v_mm);
    }
  }
  [[nodiscard]] std::uint16_t value() const { return static_cast<std::uint16_t>(sum_); }

 private:
  std::uint32_t sum_ = 0xffff;
};

std::uint16_t SheetId(const SheetPlan& plan) {
  constexpr int kArrangement = 2;  // another one draws other sheets of the same settings
  CheckSum sum;
  sum.Add(kArrangement);
  sum.Add(plan.settings.reference_tool);
  sum.AddLength(plan.settings.tilt_deg);
  sum.AddLength(plan.width_mm);
  sum.AddLength(plan.height_mm);
  for (const Structure& structure : plan.structures) {
    for (std::size_t comb = 0; comb < 2; ++comb) {
      sum.Add(structure.combs[comb].tool);
      sum.Add(structure.combs[comb].pick_up);
      for (const int finger : {0, plan.settings.teeth - 1}) {
        for (const Leg& leg : FingerLegs(plan, structure, comb, finger)) sum.Add(leg);
      }
    }
  }
  return sum.value();
}

/// Rounds to a micron, so that no sum of sizes is on the edge between two values of the check sum.
SheetPoint Rounded(const SheetPoint& point) {
  return {std::round(point.u_mm * 1000) / 1000, std::round(point.v_mm * 1000) / 1000};
}

}  // namespace

/// Returns the prime lines: each tool has its own stretch below the box, each pick-up its own row.
std::vector<PrimeLine> PrimeLines(const SheetPlan& plan) {
  const SheetSettings& settings = plan.settings;
  const double stretch_mm = plan.width_mm / static_cast<double>(settings.tools.size());
  const double length_mm = std::min(kPrimeLength_mm, 0.8 * stretch_mm);
  std::vector<PrimeLine> lines;
  for (int pick_up = 0; pick_up <= settings.pick_ups; ++pick_up) {
    const double v_mm = -plan.height_mm / 2 - kPrimeGap_mm - pick_up * kPrimeRow_mm;
    for (std::size_t i = 0; i < settings.tools.size(); ++i) {
      const double u_mm =
          -plan.width_mm / 2 + static_cast<double>(i) * stretch_mm + (stretch_mm - length_mm) / 2;
      lines.push_back({settings.tools[i], pick_up, {{u_mm, v_mm}, {u_mm + length_mm, v_mm}}});
    }
  }
  return lines;
}

namespace {

/// Converts from the layout's lower left corner to the sheet's middle.
SheetPoint OnSheet(SheetPoint in_layout, double width_mm, double height_mm) {
  return {in_layout.u_mm - width_mm / 2, in_layout.v_mm - height_mm / 2};
}

/// Sets the box's size and places all structures in it.
/// @returns the middle of the code.
SheetPoint Place(const std::vector<Structure>& x, const std::vector<Structure>& y, double border_mm,
                 SheetPlan& plan) {
  const Layout layout = plan.settings.for_photo
                            ? ArrangeForPhoto(plan.settings, x, y, border_mm)
                            : ArrangeSheet(plan.settings, x.size(), y.size(), border_mm);
  plan.width_mm = Rounded({layout.width_mm + 2 * border_mm, 0}).u_mm;
  plan.height_mm = Rounded({layout.height_mm + 2 * border_mm, 0}).u_mm;
  const auto add = [&](const std::vector<Structure>& structures,
                       const std::vector<SheetPoint>& middles) {
    for (std::size_t i = 0; i < structures.size(); ++i) {
      plan.structures.push_back(structures[i]);
      plan.structures.back().middle =
          Rounded(OnSheet(middles[i], layout.width_mm, layout.height_mm));
    }
  };
  add(x, layout.x_structures);
  add(y, layout.y_structures);
  return OnSheet(layout.code, layout.width_mm, layout.height_mm);
}

/// Returns the sheet with exactly this number of teeth, for any paper.
SheetPlan PlanWithTeeth(const SheetSettings& settings) {
  SheetPlan plan;
  plan.settings = settings;
  for (int line = 0; line < kBoxLines; ++line) {
    plan.box_insets_mm.push_back(line * settings.leg_spacing_mm);
  }
  const std::vector<Structure> x = ListStructures(settings, Axis::kX);
  const std::vector<Structure> y = ListStructures(settings, Axis::kY);
  // Cells include half of the gap.
  const double border_mm = plan.box_insets_mm.back() + settings.structure_gap_mm / 2;
  const SheetPoint code_middle = Place(x, y, border_mm, plan);
  plan.sheet_id = SheetId(plan);
  const CodeCells cells = EncodeSheetId(plan.sheet_id);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double along = static_cast<double>(i) - (static_cast<double>(cells.size()) - 1) / 2;
    plan.code.push_back(
        {Rounded({code_middle.u_mm + along * kCodeCell_mm, code_middle.v_mm}), cells[i]});
  }
  plan.prime_lines = PrimeLines(plan);
  return plan;
}

}  // namespace

bool FitsItsPaper(const SheetPlan& plan) {
  const auto paper = FindPaper(plan.settings.paper);
  if (!paper) return true;
  const BedBounds bounds = SheetBounds(plan.settings, plan.width_mm, plan.height_mm);
  return FitsPaper(*paper, bounds.max_x_mm - bounds.min_x_mm, bounds.max_y_mm - bounds.min_y_mm);
}

SheetPlan PlanSheet(const SheetSettings& settings) {
  SheetPlan plan = PlanWithTeeth(settings);
  for (SheetSettings fewer = settings; fewer.teeth > kFewestTeethToFit;) {
    if (FitsItsPaper(plan)) return plan;
    --fewer.teeth;
    plan = PlanWithTeeth(fewer);
  }
  return plan;
}

namespace {

/// True if a leg runs upwards on its own line so that the bed axis that it measures moves by
/// `direction`. With a positive tilt +v moves the bed's x down and +u moves its y up.
bool TowardsHigherCoordinate(Axis axis, int direction, double tilt_deg) {
  const int sign = tilt_deg > 0 ? direction : -direction;
  return axis == Axis::kX ? sign < 0 : sign > 0;
}

/// Returns a leg across `axis` at `position_mm`, from `low_mm` to `high_mm` or back.
Leg AcrossLeg(Axis axis, double position_mm, double low_mm, double high_mm, bool upwards) {
  const double start_mm = upwards ? low_mm : high_mm;
  const double end_mm = upwards ? high_mm : low_mm;
  if (axis == Axis::kX) return {{position_mm, start_mm}, {position_mm, end_mm}};
  return {{start_mm, position_mm}, {end_mm, position_mm}};
}

}  // namespace

Leg Shifted(const Leg& leg, const SheetPoint& by) {
  return {{leg.start.u_mm + by.u_mm, leg.start.v_mm + by.v_mm},
          {leg.end.u_mm + by.u_mm, leg.end.v_mm + by.v_mm}};
}

std::vector<Leg> LegsOfTool(const SheetPlan& plan, int tool) {
  std::vector<Leg> legs;
  for (const Structure& structure : plan.structures) {
    for (std::size_t comb = 0; comb < 2; ++comb) {
      if (structure.combs[comb].tool != tool) continue;
      for (int finger = 0; finger < plan.settings.teeth; ++finger) {
        for (const Leg& leg : FingerLegs(plan, structure, comb, finger)) legs.push_back(leg);
      }
      const std::vector<Leg> joins = JoinsOfComb(plan, structure, comb);
      legs.insert(legs.end(), joins.begin(), joins.end());
    }
  }
  for (const PrimeLine& line : plan.prime_lines) {
    if (line.tool == tool) legs.push_back(line.leg);
  }
  return legs;
}

double FingerPosition_mm(const SheetPlan& plan, const Structure& structure, std::size_t comb,
                         int finger) {
  const SheetSettings& settings = plan.settings;
  TRAMMEL_CHECK(comb < 2 && finger >= 0 && finger < settings.teeth, "comb {}, finger {} of {}",
                comb, finger, settings.teeth);
  const double from_middle = finger - (settings.teeth - 1) / 2.0 + (comb == 0 ? -0.25 : 0.25);
  return Along(structure.axis, structure.middle) + from_middle * settings.pitch_mm;
}

std::array<Leg, 2> FingerLegs(const SheetPlan& plan, const Structure& structure, std::size_t comb,
                              int finger) {
  const SheetSettings& settings = plan.settings;
  const double position_mm = FingerPosition_mm(plan, structure, comb, finger);
  const double across_mm = Across(structure.axis, structure.middle);
  const double inner_mm = settings.overlap_mm / 2;
  const double outer_mm = settings.leg_length_mm - inner_mm;
  const bool from_low = structure.FromLowSide(comb);
  const double low_mm = across_mm - (from_low ? outer_mm : inner_mm);
  const double high_mm = across_mm + (from_low ? inner_mm : outer_mm);
  const Comb& drawn = structure.combs[comb];
  const double half_mm = settings.leg_spacing_mm / 2;
  const auto leg = [&](double aside_mm, bool upwards) {
    return Shifted(AcrossLeg(structure.axis, position_mm + aside_mm, low_mm, high_mm, upwards),
                   drawn.programmed);
  };
  if (plan.original) {
    // Draws from the spine into the overlap, and back: the first leg is the lower one of a comb
    // stepped up.
    const bool lower_upwards = from_low == (drawn.direction > 0);
    return {leg(-half_mm, lower_upwards), leg(half_mm, !lower_upwards)};
  }
  const bool upwards = TowardsHigherCoordinate(structure.axis, drawn.direction, settings.tilt_deg);
  return {leg(-half_mm, upwards), leg(half_mm, upwards)};
}

std::vector<Leg> JoinsOfComb(const SheetPlan& plan, const Structure& structure, std::size_t comb) {
  std::vector<Leg> joins;
  if (!plan.original) return joins;
  const SheetSettings& settings = plan.settings;
  const bool from_low = structure.FromLowSide(comb);
  const double half_mm = settings.leg_spacing_mm / 2;
  const double across_mm = Across(structure.axis, structure.middle);
  const double reach_mm = settings.overlap_mm / 2 + half_mm;
  const double spine_mm = settings.leg_length_mm - settings.overlap_mm / 2 + half_mm;
  const auto join = [&](double from_mm, double to_mm, double at_mm) {
    const Leg leg{PointAt(structure.axis, from_mm, at_mm), PointAt(structure.axis, to_mm, at_mm)};
    joins.push_back(Shifted(leg, structure.combs[comb].programmed));
  };
  const int step = structure.combs[comb].direction;
  for (int finger = 0; finger < settings.teeth; ++finger) {
    const double at_mm = FingerPosition_mm(plan, structure, comb, finger);
    join(at_mm - half_mm, at_mm + half_mm, across_mm + (from_low ? reach_mm : -reach_mm));
    // Joins to the next finger; after the last one there is a hook.
    join(at_mm + step * half_mm, at_mm + step * (settings.pitch_mm - half_mm),
         across_mm + (from_low ? -spine_mm : spine_mm));
  }
  return joins;
}

Leg CodeLeg(const SheetPlan& plan, const CodeCell& cell) {
  return AcrossLeg(Axis::kX, cell.middle.u_mm, cell.middle.v_mm - kCodeLeg_mm / 2,
                   cell.middle.v_mm + kCodeLeg_mm / 2,
                   TowardsHigherCoordinate(Axis::kX, 1, plan.settings.tilt_deg));
}

}  // namespace trammel::tool_offset
