#include "tool_offset/procedure/tool_offsets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "session/idle.h"

namespace trammel::procedure {
namespace {

using tool_offset::KeptOffset;
using tool_offset::OffsetFirmware;

constexpr double kAsk_s = 10;

/// The toolchanger's tools: numbers, and in the same order Klipper's names of their [tool]s.
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

/// Klipper's name of the [tool] with this number.
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
  constexpr double kRounding_mm = 0.00051;  // commands carry micrometres
  if (std::abs(now.x_mm - offset.x_mm) <= kRounding_mm &&
      std::abs(now.y_mm - offset.y_mm) <= kRounding_mm) {
    return {};
  }
  return Fail(fmt::format("the printer was told an offset of {:.3f}, {:.3f} mm for tool {} and "
                          "reports {:.3f}, {:.3f} mm",
                          offset.x_mm, offset.y_mm, tool, now.x_mm, now.y_mm),
              ErrorKind::kMachine);
}

/// Whether SAVE_CONFIG has something left to do.
Result<bool> IsPending(const Session& session) {
  const auto status =
      TRY(session.printer.Query({{"configfile", {"save_config_pending"}}}, session.Within(kAsk_s)));
  const auto object = status.find("configfile");
  if (object == status.end() || !object->is_object()) return false;
  const auto pending = object->find("save_config_pending");
  return pending != object->end() && pending->is_boolean() && pending->get<bool>();
}

/// The restart may cut the command's own answer off, and questions behind it: what counts is that
/// nothing is left pending once Klipper is there again.
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

}  // namespace trammel::procedure
