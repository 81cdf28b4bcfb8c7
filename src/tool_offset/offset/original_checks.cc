#include "tool_offset/offset/original_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "tool_offset/offset/sheet_model.h"

namespace trammel::tool_offset {
namespace {

/// The largest bias of the published method is 30 µm.
constexpr double kMostBias_mm = 0.03;
constexpr double kSigmas = 4;

/// What a pair's two structures of an axis say together: the tested comb against the reference
/// comb, without what favours a comb's place in the order.
struct PairReading {
  int tool = 0;
  Axis axis = Axis::kX;
  double offset_mm = 0;      ///< beyond what the file moves it
  double programmed_mm = 0;  ///< by the file
  double uncertainty_mm = 0;
};

std::vector<PairReading> ReadPairs(const SheetPlan& plan, const SheetResult& result) {
  std::vector<PairReading> pairs;
  for (std::size_t i = 0; i + 1 < plan.structures.size(); i += 2) {
    const Structure& plus = plan.structures[i];
    const Measured& first = result.structures[i].offset_mm;
    const Measured& second = result.structures[i + 1].offset_mm;
    if (!first.good() || !second.good()) continue;
    PairReading pair;
    pair.tool = plus.combs[0].tool;
    pair.axis = plus.axis;
    // The tested comb is comb 0 of "+" and comb 1 of "-".
    pair.programmed_mm = -Programmed_mm(plus);
    pair.offset_mm = (second.quantity().value - first.quantity().value) / 2 - pair.programmed_mm;
    pair.uncertainty_mm =
        std::hypot(first.quantity().standard_uncertainty, second.quantity().standard_uncertainty) /
        2;
    pairs.push_back(pair);
  }
  return pairs;
}

char Letter(Axis axis) { return axis == Axis::kX ? 'u' : 'v'; }

/// The first pair of the reference tool that the sheet does not have as the file says.
std::optional<std::string> Contradiction(const SheetPlan& plan,
                                         const std::vector<PairReading>& pairs) {
  for (const PairReading& pair : pairs) {
    if (pair.tool != plan.settings.reference_tool) continue;
    if (std::abs(pair.offset_mm) < kMostBias_mm + kSigmas * pair.uncertainty_mm) continue;
    return fmt::format(
        "T{} against itself is moved by {:+.3f} mm along {} on the sheet, by {:+.3f} mm in the "
        "file: the sheet was not printed from this file, so that its other offsets do not count "
        "either. Give the G-code that was printed",
        pair.tool, pair.offset_mm + pair.programmed_mm, Letter(pair.axis), pair.programmed_mm);
  }
  return std::nullopt;
}

/// Why a tool that is listed several times has no single offset.
std::optional<std::string> Disagreement(const std::vector<PairReading>& pairs, int tool) {
  std::map<Axis, PairReading> first;
  for (const PairReading& pair : pairs) {
    if (pair.tool != tool) continue;
    const auto [known, added] = first.emplace(pair.axis, pair);
    const double apart_mm = pair.offset_mm - known->second.offset_mm;
    if (added || std::abs(apart_mm) <
                     kMostBias_mm +
                         kSigmas * std::hypot(pair.uncertainty_mm, known->second.uncertainty_mm)) {
      continue;
    }
    return fmt::format(
        "T{}: two of its pairs differ by {:+.3f} mm along {} beyond what the file moves them: the "
        "sheet was not printed from this file, or the tool was put back otherwise",
        tool, apart_mm, Letter(pair.axis));
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> CheckAgainstFile(const SheetPlan& plan, SheetResult& result) {
  const std::vector<PairReading> pairs = ReadPairs(plan, result);
  if (auto contradiction = Contradiction(plan, pairs)) return contradiction;
  for (ToolReading& tool : result.tools) {
    const auto why = Disagreement(pairs, tool.tool);
    if (why && tool.dx_mm.good()) tool.dx_mm = tool.dy_mm = Measured::Refused(*why);
  }
  return std::nullopt;
}

}  // namespace trammel::tool_offset
