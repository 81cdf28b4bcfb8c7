#include "tool_offset/analyse.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/statistics.h"
#include "tool_offset/comb_fit.h"
#include "tool_offset/offset_estimate.h"
#include "tool_offset/parallel.h"
#include "tool_offset/structure_reader.h"

namespace trammel::tool_offset {
namespace {

/// What is known of each tool before its combs are read.
struct KnownTool {
  bool usable = false;
  std::string why_not;
  InkColour ink;
  SheetPoint shift;
};
using KnownTools = std::map<int, KnownTool>;

InkColour ReferenceInk(const PageView& page, const SheetPlan& plan, const PageMap& map) {
  std::vector<Leg> legs;
  for (const CodeCell& cell : plan.code) {
    if (cell.dark) legs.push_back(CodeLeg(plan, cell));
  }
  return SampleInk(page, map, plan.settings, legs);
}

std::vector<ToolReading> ReadMarks(const PageView& page, const SheetPlan& plan,
                                   const PageMap& map) {
  std::vector<ToolReading> tools(plan.coarse_marks.size());
  ParallelFor(static_cast<int>(tools.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const CoarseMark& mark = plan.coarse_marks[k];
    tools[k].tool = mark.tool;
    tools[k].mark = ReadCoarseMark(page, map, plan, mark);
    const SheetPoint& shift = tools[k].mark.shift;
    tools[k].coarse_place =
        map.ToPage({mark.middle.u_mm + shift.u_mm, mark.middle.v_mm + shift.v_mm});
  });
  return tools;
}

KnownTools KnowTools(const SheetPlan& plan, const InkColour& reference,
                     const std::vector<ToolReading>& marks) {
  KnownTools known;
  known[plan.settings.reference_tool] = {true, {}, reference, {}};
  const double reach_mm = FineReach_mm(plan.settings);
  for (const ToolReading& tool : marks) {
    KnownTool& entry = known[tool.tool];
    entry.ink = tool.mark.ink;
    entry.shift = tool.mark.shift;
    const double far_mm = std::max(std::abs(entry.shift.u_mm), std::abs(entry.shift.v_mm));
    if (!tool.mark.found) {
      entry.why_not = fmt::format("T{}'s coarse mark was not found", tool.tool);
    } else if (far_mm > reach_mm) {
      entry.why_not =
          fmt::format("T{} is {:.2f} mm off: beyond {:.2f} mm its teeth come too near those of T{}",
                      tool.tool, far_mm, reach_mm, plan.settings.reference_tool);
    } else {
      entry.usable = true;
    }
  }
  return known;
}

StructureReading ReadOne(const PageView& page, const SheetPlan& plan, const PageMap& map,
                         const KnownTools& known, std::size_t index) {
  const Structure& structure = plan.structures[index];
  StructureReading reading;
  reading.structure = index;
  reading.name = structure.name;
  std::array<const KnownTool*, 2> tools{};
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    const auto found = known.find(structure.combs[comb].tool);
    if (found == known.end() || !found->second.usable) {
      reading.offset_mm = Measured::Refused(
          found == known.end() ? fmt::format("T{} has no coarse mark", structure.combs[comb].tool)
                               : found->second.why_not);
      return reading;
    }
    tools[comb] = &found->second;
  }
  const ChannelChoice choice = ChooseChannels(tools[0]->ink, tools[1]->ink);
  std::array<CombExpectation, 2> expected;
  for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
    expected[comb] = {choice.mix[comb], tools[comb]->shift,
                      fmt::format("T{}", structure.combs[comb].tool)};
    reading.channel[comb] = InkChannelName(choice.channel[comb], page.channels);
    reading.mix[comb] = choice.mix[comb];
    reading.shift_mm[comb] = tools[comb]->shift;
  }
  auto fingers = ReadStructure(page, map, plan, structure, expected);
  if (!fingers) {
    reading.offset_mm = Measured::Refused(fingers.error().message);
    return reading;
  }
  reading.fingers = std::move(*fingers);
  FitCombs(plan.settings, reading);
  return reading;
}

void CompareResolution(const AnalyseOptions& options, SheetResult& result) {
  constexpr double kWrong = 0.02;
  const PageMap& map = result.sheet.map;
  result.page_dpi_x = 25.4 * std::hypot(map.u_px_mm.x_px, map.v_px_mm.x_px);
  result.page_dpi_y = 25.4 * std::hypot(map.u_px_mm.y_px, map.v_px_mm.y_px);
  const auto differs = [](const std::optional<double>& stated, double found) {
    return stated && !(std::abs(*stated / found - 1) < kWrong);
  };
  if (!differs(options.dpi_x, result.page_dpi_x) && !differs(options.dpi_y, result.page_dpi_y)) {
    return;
  }
  result.notices.push_back(fmt::format(
      "the scan is said to have {:.0f} x {:.0f} dpi, but its box has {:.0f} x {:.0f} dpi; the box "
      "counts",
      options.dpi_x.value_or(result.page_dpi_x), options.dpi_y.value_or(result.page_dpi_y),
      result.page_dpi_x, result.page_dpi_y));
}

}  // namespace

Result<SheetResult> AnalyseSheet(const PageView& page, const SheetPlan& plan,
                                 const AnalyseOptions& options) {
  auto sheet = FindSheet(page, plan);
  if (!sheet) return tl::unexpected(sheet.error());
  SheetResult result;
  result.sheet = std::move(*sheet);
  const PageMap& map = result.sheet.map;
  const InkColour reference = ReferenceInk(page, plan, map);
  if (!IsReadable(reference)) {
    return Fail(
        fmt::format("the ink of T{}, the reference tool, differs from the paper by only "
                    "{:.0f} of 255 levels: print with a colour that stands out",
                    plan.settings.reference_tool, std::abs(reference.contrast[reference.best()])),
        ErrorKind::kMeasurement);
  }
  result.tools = ReadMarks(page, plan, map);
  const KnownTools known = KnowTools(plan, reference, result.tools);
  result.structures.resize(plan.structures.size());
  ParallelFor(static_cast<int>(plan.structures.size()), [&](int i) {
    const auto index = static_cast<std::size_t>(i);
    result.structures[index] = ReadOne(page, plan, map, known, index);
  });
  EstimateOffsets(plan, result);
  CompareResolution(options, result);
  return result;
}

}  // namespace trammel::tool_offset
