#include "tool_offset/sheet/sheet_structures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace trammel::tool_offset {
namespace {

/// Programmed on a self-test, along the axis that each structure measures: no two alike, both signs
/// and all sizes up to where teeth nearly touch.
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

/// Controls in turn + and -, the two backlash structures a third and two thirds of the way along.
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
      // The roles are swapped with the direction: what the method itself is biased by changes sign.
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
    const SheetPoint moved =
        axis == Axis::kX ? SheetPoint{offsets_mm[i], 0} : SheetPoint{0, offsets_mm[i]};
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

}  // namespace

std::vector<Structure> ListStructures(const SheetSettings& settings, Axis axis) {
  std::vector<Structure> list =
      settings.self_test ? SelfTestStructures(settings, axis) : ToolStructures(settings, axis);
  const std::vector<Structure> pick_ups = PickUpStructures(settings, axis);
  list.insert(list.end(), pick_ups.begin(), pick_ups.end());
  return Spread(std::move(list), ReferenceStructures(settings, axis));
}

}  // namespace trammel::tool_offset
