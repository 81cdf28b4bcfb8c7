#include "tool_offset/procedure/printer_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

#include "gcode/tool_commands.h"
#include "tool_offset/procedure/tool_offsets.h"

namespace trammel::procedure {
namespace {

constexpr double kAsk_s = 10;
constexpr int kMostTool = 31;  // as sheets have them

/// The names of the sections of printer.cfg.
Result<std::set<std::string>> Sections(const Session& session) {
  const auto status = session.printer.Query({{"configfile", {"settings"}}}, session.Within(kAsk_s));
  if (!status) return tl::unexpected(status.error());
  std::set<std::string> names;
  const auto file = status->find("configfile");
  if (file == status->end() || !file->is_object()) return names;
  const auto settings = file->find("settings");
  if (settings == file->end() || !settings->is_object()) return names;
  for (const auto& [name, section] : settings->items()) {
    std::string lower = name;
    for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    names.insert(std::move(lower));
  }
  return names;
}

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

ToolKeeper KeeperOf(const std::set<std::string>& sections) {
  if (sections.contains("dual_carriage")) return ToolKeeper::kDualCarriage;
  const bool macros = sections.contains("gcode_macro t0") && sections.contains("gcode_macro t1");
  return macros ? ToolKeeper::kMacros : ToolKeeper::kExtruders;
}

/// What klipper-toolchanger tells of its tools; none where there is no such thing.
Result<std::vector<PrinterTool>> OfToolchanger(const Session& session) {
  const auto numbers = ToolNumbers(session);
  if (!numbers) return tl::unexpected(numbers.error());
  std::vector<PrinterTool> tools;
  for (const int number : std::set<int>(numbers->begin(), numbers->end())) {
    if (number < 0 || number > kMostTool) continue;
    auto tool = ReadTool(session, number);
    if (!tool) return tl::unexpected(tool.error());
    tools.push_back({number, tool->extruder, tool->kept});
  }
  return tools;
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

Result<std::string> UsualToolChange(const Session& session, ToolKeeper keeper) {
  const std::string activate = "ACTIVATE_EXTRUDER EXTRUDER={extruder}";
  if (keeper == ToolKeeper::kDualCarriage || keeper == ToolKeeper::kToolchanger ||
      keeper == ToolKeeper::kMacros) {
    const auto has = session.printer.HasCommand("T0", session.Within(kAsk_s));
    if (!has) return tl::unexpected(has.error());
    if (*has) return std::string("T{tool}");
  }
  if (keeper == ToolKeeper::kToolchanger) return std::string("SELECT_TOOL T={tool}");
  if (keeper == ToolKeeper::kDualCarriage) {
    return "SET_DUAL_CARRIAGE CARRIAGE={tool}\n" + activate;
  }
  return activate;
}

Result<PrinterTools> ReadTools(const Session& session) {
  const auto sections = Sections(session);
  if (!sections) return tl::unexpected(sections.error());
  PrinterTools found;
  auto tools = OfToolchanger(session);
  if (!tools) return tl::unexpected(tools.error());
  found.tools = std::move(*tools);
  if (found.tools.empty()) {
    found.keeper = KeeperOf(*sections);
    found.tools = ByExtruders(*sections);
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
  if (HasPrefix(*sections, "tool_probe")) {
    found.notices.emplace_back(
        "each tool has a probe of its own ([tool_probe]): its Z offset stays as it is, X and Y "
        "alone are measured");
  }
  if (!sections->contains("heater_bed")) {
    found.notices.emplace_back("the printer has no [heater_bed]: the bed is taken for cold");
  }
  return found;
}

}  // namespace trammel::procedure
