#include "tool_offset/procedure/tool_offsets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "gcode/dialect.h"
#include "session/print_needs.h"
#include "session/session.h"

namespace trammel::procedure {
namespace {

using tool_offset::KeptOffset;
using tool_offset::OffsetFirmware;

constexpr double kAsk_s = 10;

/// Tools of the toolchanger: numbers, and in the same order Klipper's names of their [tool]s.
struct Changer {
  nlohmann::json numbers = nlohmann::json::array();
  nlohmann::json names = nlohmann::json::array();
};

Result<Changer> ReadChanger(const Session& session) {
  const auto status = TRY(session.printer.Query({{"toolchanger", {"tool_numbers", "tool_names"}}},
                                                session.Within(kAsk_s)));
  Changer changer;
  const auto object = status.find("toolchanger");
  if (object == status.end() || !object->is_object()) return changer;
  for (const auto& [key, list] :
       {std::pair{"tool_numbers", &changer.numbers}, std::pair{"tool_names", &changer.names}}) {
    const auto found = object->find(key);
    if (found != object->end() && found->is_array()) *list = *found;
  }
  return changer;
}

/// Returns Klipper's name of the [tool] with this number.
Result<std::string> ObjectOf(const Session& session, int tool) {
  const auto changer = TRY(ReadChanger(session));
  const nlohmann::json& numbers = changer.numbers;
  const nlohmann::json& names = changer.names;
  for (std::size_t i = 0; i < std::min(numbers.size(), names.size()); ++i) {
    if (numbers[i] == tool && names[i].is_string()) return names[i].get<std::string>();
  }
  constexpr std::size_t kShown = 32;
  const auto shown = static_cast<std::ptrdiff_t>(std::min(numbers.size(), kShown));
  const nlohmann::json first(std::vector<nlohmann::json>(numbers.begin(), numbers.begin() + shown));
  return Fail(
      numbers.empty()
          ? fmt::format("the printer has no tools of klipper-toolchanger; give the offset of tool "
                        "{0} by hand with --now {0}:X,Y",
                        tool)
          : fmt::format("the printer has no tool {}: its toolchanger has {}", tool,
                        first.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)),
      ErrorKind::kMachine);
}

Result<double> NumberIn(const nlohmann::json& object, const char* key, int tool) {
  constexpr double kFarthest_mm = 1000;  // no head carries two tools so far from each other
  const auto value = object.find(key);
  if (value != object.end() && value->is_number()) {
    const double offset_mm = value->get<double>();
    if (std::abs(offset_mm) <= kFarthest_mm) return offset_mm;
    return Fail(
        fmt::format("the printer says that {} of tool {} is {:g} mm, which no tool has; see "
                    "its configuration, or give its offset by hand with --now {}:X,Y",
                    key, tool, offset_mm, tool),
        ErrorKind::kMachine);
  }
  return Fail(fmt::format("the printer tells no {} of tool {}; give its offset by hand with --now "
                          "{}:X,Y",
                          key, tool, tool),
              ErrorKind::kMachine);
}

Result<void> RunAll(const Session& session, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    TRY(session.printer.Run(line, session.Within(kAsk_s)));
  }
  return {};
}

Result<void> Compare(const Session& session, int tool, const KeptOffset& offset) {
  const auto now = TRY(ReadToolOffset(session, tool));
  if (SameOffset(now, offset)) return {};
  return Fail(fmt::format("the printer was told an offset of {:.3f}, {:.3f} mm for tool {} and "
                          "reports {:.3f}, {:.3f} mm",
                          offset.x_mm, offset.y_mm, tool, now.x_mm, now.y_mm),
              ErrorKind::kMachine);
}

/// True if SAVE_CONFIG is pending.
Result<bool> IsPending(const Session& session) {
  const auto status =
      TRY(session.printer.Query({{"configfile", {"save_config_pending"}}}, session.Within(kAsk_s)));
  const auto object = status.find("configfile");
  if (object == status.end() || !object->is_object()) return false;
  const auto pending = object->find("save_config_pending");
  return pending != object->end() && pending->is_boolean() && pending->get<bool>();
}

/// Saves the configuration. The restart may interrupt the command's own reply, and questions after
/// it. The criterion is that nothing is pending once Klipper has returned.
Result<void> SaveConfig(const Session& session) {
  constexpr double kRestart_s = 120;
  constexpr double kStep_s = 0.2;
  constexpr double kBegins_s = 2;  // a restart that was promised
  const auto ran = session.printer.Run("SAVE_CONFIG", session.Within(kAsk_s));
  for (double waited_s = 0; waited_s < (ran ? kRestart_s : kBegins_s); waited_s += kStep_s) {
    if (!Pause(kStep_s, session.stop)) {
      return Fail("stopped while Klipper restarts: look whether the offsets were kept",
                  ErrorKind::kInterrupted);
    }
    TRY(session.printer.WaitUntilReady(session.Within(kRestart_s)));
    const auto pending = IsPending(session);
    if (pending && !*pending) return {};
  }
  return Fail(fmt::format("the offsets are set, but SAVE_CONFIG did not keep them beyond a restart"
                          "{}; write them into the [tool] sections yourself, where an included "
                          "file has them",
                          ran ? "" : ": " + ran.error().message),
              ErrorKind::kMachine);
}

}  // namespace

bool SameOffset(const KeptOffset& a, const KeptOffset& b) {
  constexpr double kSame_mm = 0.00051;  // firmwares are told micrometres
  return std::abs(a.x_mm - b.x_mm) <= kSame_mm && std::abs(a.y_mm - b.y_mm) <= kSame_mm;
}

Result<std::vector<int>> ToolNumbers(const Session& session) {
  const auto changer = TRY(ReadChanger(session));
  std::vector<int> numbers;
  for (const nlohmann::json& number : changer.numbers) {
    if (number.is_number_integer()) numbers.push_back(number.get<int>());
  }
  return numbers;
}

Result<KeptOffset> ReadToolOffset(const Session& session, int tool) {
  const auto read = TRY(ReadTool(session, tool));
  return read.kept;
}

Result<KlipperTool> ReadTool(const Session& session, int tool) {
  const auto name = TRY(ObjectOf(session, tool));
  const auto status = TRY(session.printer.Query(
      {{name, {"extruder", "gcode_x_offset", "gcode_y_offset"}}}, session.Within(kAsk_s)));
  const auto found = status.find(name);
  const nlohmann::json object =
      found != status.end() && found->is_object() ? *found : nlohmann::json::object();
  const auto x = TRY(NumberIn(object, "gcode_x_offset", tool));
  const auto y = TRY(NumberIn(object, "gcode_y_offset", tool));
  const auto extruder = object.find("extruder");
  const bool named = extruder != object.end() && extruder->is_string();
  constexpr std::size_t kLongestName = 60;
  return KlipperTool{named ? extruder->get<std::string>().substr(0, kLongestName) : std::string(),
                     {x, y}};
}

Result<void> SetToolOffset(const Session& session, int tool, const KeptOffset& offset) {
  TRY(RefuseWhilePrinting(session, "the offset"));
  TRY(RunAll(session, SetCommands(OffsetFirmware::kKlipperTool, tool, offset)));
  return Compare(session, tool, offset);
}

Result<void> KeepToolOffsets(const Session& session, const std::map<int, KeptOffset>& offsets) {
  TRY(RefuseWhilePrinting(session, "the offset"));
  for (const auto& [tool, offset] : offsets) {
    TRY(RunAll(session, SaveCommands(OffsetFirmware::kKlipperTool, tool)));
  }
  TRY(SaveConfig(session));
  for (const auto& [tool, offset] : offsets) {
    TRY(Compare(session, tool, offset));
  }
  return {};
}

namespace {

constexpr int kMaxTool = 31;  // limit of the sheets

bool HasPrefix(const std::set<std::string>& names, const std::string& prefix) {
  const auto at = names.lower_bound(prefix);
  return at != names.end() && at->starts_with(prefix);
}

/// Returns tools by their extruders: T0's is "extruder", T1's "extruder1".
std::vector<PrinterTool> ByExtruders(const std::set<std::string>& sections) {
  std::vector<PrinterTool> tools;
  for (int number = 0; number <= kMaxTool; ++number) {
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

/// Reads the tools that klipper-toolchanger reports; none without it.
Result<std::vector<PrinterTool>> OfToolchanger(const Session& session) {
  const auto numbers = TRY(ToolNumbers(session));
  std::vector<PrinterTool> tools;
  for (const int number : std::set<int>(numbers.begin(), numbers.end())) {
    if (number < 0 || number > kMaxTool) continue;
    auto tool = TRY(ReadTool(session, number));
    tools.push_back({number, tool.extruder, tool.kept});
  }
  return tools;
}

bool AreNamed(const std::vector<machine::DualCarriage>& carriages) {
  return std::any_of(carriages.begin(), carriages.end(),
                     [](const machine::DualCarriage& each) { return !each.name.empty(); });
}

/// Returns the macros that pick up carriages by their names.
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
