#include "tool_offset/procedure/printer_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "gcode/tool_commands.h"
#include "session/print_needs.h"
#include "tool_offset/procedure/tool_offsets.h"

namespace trammel::procedure {
namespace {

constexpr double kAsk_s = 10;
constexpr int kMostTool = 31;  // as sheets have them

bool HasPrefix(const std::set<std::string>& names, const std::string& prefix) {
  const auto at = names.lower_bound(prefix);
  return at != names.end() && at->starts_with(prefix);
}

/// Tools by their extruders: T0's is "extruder", T1's "extruder1".
std::vector<PrinterTool> ByExtruders(const std::set<std::string>& sections) {
  std::vector<PrinterTool> tools;
  for (int number = 0; number <= kMostTool; ++number) {
    const std::string extruder = gcode::KlipperExtruder(number);
    if (sections.contains(extruder)) tools.push_back({number, extruder});
  }
  return tools;
}

ToolKeeper KeeperOf(const machine::PrinterFacts& facts) {
  const std::set<std::string>& sections = facts.sections;
  if (!facts.dual_carriages.empty()) return ToolKeeper::kDualCarriage;
  const bool macros = sections.contains("gcode_macro t0") && sections.contains("gcode_macro t1");
  return macros ? ToolKeeper::kMacros : ToolKeeper::kExtruders;
}

/// What klipper-toolchanger tells of its tools; none where there is no such thing.
Result<std::vector<PrinterTool>> OfToolchanger(const Session& session) {
  const auto numbers = TRY(ToolNumbers(session));
  std::vector<PrinterTool> tools;
  for (const int number : std::set<int>(numbers.begin(), numbers.end())) {
    if (number < 0 || number > kMostTool) continue;
    auto tool = TRY(ReadTool(session, number));
    tools.push_back({number, tool.extruder, tool.kept});
  }
  return tools;
}

bool AreNamed(const std::vector<machine::DualCarriage>& carriages) {
  return std::any_of(carriages.begin(), carriages.end(),
                     [](const machine::DualCarriage& each) { return !each.name.empty(); });
}

/// The macros that pick up carriages by their names.
std::string MacrosFor(const std::vector<machine::DualCarriage>& carriages) {
  std::string first, second;
  for (const machine::DualCarriage& each : carriages) {
    first += "SET_DUAL_CARRIAGE CARRIAGE=" + each.primary + ", ";
    second += "SET_DUAL_CARRIAGE CARRIAGE=" + each.name + ", ";
  }
  return fmt::format(
      "write [gcode_macro T0] ({}ACTIVATE_EXTRUDER EXTRUDER=extruder) and "
      "[gcode_macro T1] ({}ACTIVATE_EXTRUDER EXTRUDER=extruder1) in printer.cfg",
      first, second);
}

}  // namespace

const PrinterTool* PrinterTools::Find(int number) const {
  const auto at = std::find_if(tools.begin(), tools.end(),
                               [&](const PrinterTool& tool) { return tool.number == number; });
  return at == tools.end() ? nullptr : &*at;
}

std::string WhyNotSet(ToolKeeper keeper) {
  const char* const by_hand =
      "so nothing can be read or set here; the sheet is printed and measured all the same, and "
      "trammel offset apply --for klipper-gcode-offset --now TOOL:X,Y shows the lines for your "
      "macros";
  switch (keeper) {
    case ToolKeeper::kToolchanger:
      return "";
    case ToolKeeper::kDualCarriage:
      return fmt::format(
          "the printer has a [dual_carriage] (IDEX): Klipper keeps no offset of its carriages, "
          "they stand as SET_GCODE_OFFSET in your own T macros, {}",
          by_hand);
    case ToolKeeper::kMacros:
      return fmt::format(
          "the printer changes tools by macros of its own ([gcode_macro T0], [gcode_macro T1]): "
          "their offsets stand in them as SET_GCODE_OFFSET, {}",
          by_hand);
    case ToolKeeper::kExtruders:
      return fmt::format(
          "the printer has several extruders and no klipper-toolchanger, and Klipper keeps no "
          "offset of an extruder, {}",
          by_hand);
  }
  return "";
}

Result<std::string> UsualToolChange(const Session& session, const PrinterTools& tools) {
  const ToolKeeper keeper = tools.keeper;
  const std::string activate = "ACTIVATE_EXTRUDER EXTRUDER={extruder}";
  if (keeper != ToolKeeper::kExtruders) {
    const auto has = TRY(session.printer.HasCommand("T0", session.Within(kAsk_s)));
    if (has) return std::string("T{tool}");
  }
  if (keeper == ToolKeeper::kToolchanger) return std::string("SELECT_TOOL T={tool}");
  if (keeper != ToolKeeper::kDualCarriage) return activate;
  std::string gcode = "SET_DUAL_CARRIAGE CARRIAGE={tool}\n" + activate;
  const Check moved = CheckCarriages(tools, gcode);
  if (moved.passed) return gcode;
  return Fail(moved.detail, ErrorKind::kSafety);
}

Check CheckCarriages(const PrinterTools& tools, const std::string& gcode) {
  constexpr const char* kName = "[tool_offset_pattern] tool_change_gcode";
  if (tools.keeper != ToolKeeper::kDualCarriage) return Pass(kName, "one carriage");
  const bool named = AreNamed(tools.carriages);
  const std::string remedy =
      named ? MacrosFor(tools.carriages) + ", and leave tool_change_gcode out"
            : std::string(
                  "set tool_change_gcode to SET_DUAL_CARRIAGE CARRIAGE={tool} and "
                  "ACTIVATE_EXTRUDER EXTRUDER={extruder} (--tool-change idex)");
  if (named && gcode.find("CARRIAGE={tool}") != std::string::npos) {
    return Unsafe(kName, fmt::format("the printer's carriages have names ({}), and "
                                     "SET_DUAL_CARRIAGE CARRIAGE=0 and 1 are for others: {}",
                                     tools.carriages.front().name, remedy));
  }
  for (std::size_t at = 0; at < gcode.size();) {
    const std::size_t end = std::min(gcode.find('\n', at), gcode.size());
    const std::string line = gcode.substr(at, end - at);
    at = end + 1;
    const bool idle =
        line.empty() || line.starts_with(";") || line.starts_with("ACTIVATE_EXTRUDER");
    if (!idle) return Pass(kName, "picks up a carriage");
  }
  return Unsafe(
      kName, "picks up an extruder and no carriage, so that the other tool would draw: " + remedy);
}

Result<PrinterTools> ReadTools(const Session& session) {
  const auto facts = TRY(ReadFacts(session));
  const std::set<std::string>& sections = facts.sections;
  PrinterTools found;
  auto tools = TRY(OfToolchanger(session));
  found.tools = std::move(tools);
  if (found.tools.empty()) {
    found.keeper = KeeperOf(facts);
    found.carriages = facts.dual_carriages;
    found.tools = ByExtruders(sections);
  }
  if (found.tools.size() < 2) {
    return Fail(
        found.tools.empty()
            ? std::string("the printer tells of no tool: there is no [extruder], and no "
                          "klipper-toolchanger")
            : fmt::format("the printer has one tool, T{} ({}), and an offset is between two: "
                          "several tools need klipper-toolchanger, [dual_carriage] or [extruder1]",
                          found.tools.front().number, found.tools.front().extruder),
        ErrorKind::kMachine);
  }
  if (const std::string why = WhyNotSet(found.keeper); !why.empty()) found.notices.push_back(why);
  if (HasPrefix(sections, "tool_probe")) {
    found.notices.emplace_back(
        "each tool has a probe of its own ([tool_probe]): its Z offset stays as it is, X and Y "
        "alone are measured");
  }
  if (!sections.contains("heater_bed")) {
    found.notices.emplace_back("the printer has no [heater_bed]: the bed is taken for cold");
  }
  return found;
}

}  // namespace trammel::procedure
