// Where each leg of the sheet runs, and which way.
#include <cmath>

#include "base/check.h"
#include "tool_offset/sheet/sheet_layout.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {
namespace {

/// Which way along its own line a leg runs so that the bed axis that it measures moves by
/// `direction`. With a positive tilt +v moves the bed's x down and +u moves its y up.
bool TowardsHigherCoordinate(Axis axis, int direction, double tilt_deg) {
  const int sign = tilt_deg > 0 ? direction : -direction;
  return axis == Axis::kX ? sign < 0 : sign > 0;
}

/// A leg across `axis` at `position_mm`, from `low_mm` to `high_mm` or back.
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
  const double middle_mm =
      structure.axis == Axis::kX ? structure.middle.u_mm : structure.middle.v_mm;
  const double from_middle = finger - (settings.teeth - 1) / 2.0 + (comb == 0 ? -0.25 : 0.25);
  return middle_mm + from_middle * settings.pitch_mm;
}

std::array<Leg, 2> FingerLegs(const SheetPlan& plan, const Structure& structure, std::size_t comb,
                              int finger) {
  const SheetSettings& settings = plan.settings;
  const double position_mm = FingerPosition_mm(plan, structure, comb, finger);
  const double across_mm =
      structure.axis == Axis::kX ? structure.middle.v_mm : structure.middle.u_mm;
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
    // From the spine into the overlap, and back: the first leg is the lower one of a comb that is
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
  const bool is_x = structure.axis == Axis::kX;
  const bool from_low = structure.FromLowSide(comb);
  const double half_mm = settings.leg_spacing_mm / 2;
  const double across_mm = is_x ? structure.middle.v_mm : structure.middle.u_mm;
  const double reach_mm = settings.overlap_mm / 2 + half_mm;
  const double spine_mm = settings.leg_length_mm - settings.overlap_mm / 2 + half_mm;
  const auto join = [&](double from_mm, double to_mm, double at_mm) {
    const Leg leg =
        is_x ? Leg{{from_mm, at_mm}, {to_mm, at_mm}} : Leg{{at_mm, from_mm}, {at_mm, to_mm}};
    joins.push_back(Shifted(leg, structure.combs[comb].programmed));
  };
  const int step = structure.combs[comb].direction;
  for (int finger = 0; finger < settings.teeth; ++finger) {
    const double at_mm = FingerPosition_mm(plan, structure, comb, finger);
    join(at_mm - half_mm, at_mm + half_mm, across_mm + (from_low ? reach_mm : -reach_mm));
    // On to the next finger; behind the last one it ends in a hook.
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
