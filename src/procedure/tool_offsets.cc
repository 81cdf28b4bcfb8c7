#include "procedure/tool_offsets.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

namespace trammel::procedure {
namespace {

using tool_offset::KeptOffset;
using tool_offset::OffsetKeeper;

constexpr double kAsk_s = 10;

// The object of the tool; klipper-toolchanger's users name them T0, T1, …
std::string ObjectOf(int tool) { return fmt::format("tool T{}", tool); }

Result<double> NumberIn(const nlohmann::json& object, const char* key, int tool) {
  const auto value = object.find(key);
  if (value != object.end() && value->is_number()) return value->get<double>();
  return Fail(fmt::format("the printer tells no {} of tool {}: its [tool T{}] must be one of "
                          "klipper-toolchanger's; give its offset by hand with --now {}:X,Y",
                          key, tool, tool, tool),
              ErrorKind::kMachine);
}

}  // namespace

Result<KeptOffset> ReadToolOffset(const Session& session, int tool) {
  const std::string name = ObjectOf(tool);
  const auto status =
      session.printer.Query({{name, {"gcode_x_offset", "gcode_y_offset"}}}, session.Within(kAsk_s));
  if (!status) return tl::unexpected(status.error());
  const auto found = status->find(name);
  const nlohmann::json object =
      found != status->end() && found->is_object() ? *found : nlohmann::json::object();
  const auto x = NumberIn(object, "gcode_x_offset", tool);
  if (!x) return tl::unexpected(x.error());
  const auto y = NumberIn(object, "gcode_y_offset", tool);
  if (!y) return tl::unexpected(y.error());
  return KeptOffset{*x, *y};
}

Result<void> SetToolOffset(const Session& session, int tool, const KeptOffset& offset, bool save) {
  const auto state = session.printer.State(session.Within(kAsk_s));
  if (!state) return tl::unexpected(state.error());
  if (state->print_state == "printing" || state->print_state == "paused") {
    return Fail("the printer is printing; apply the offset when it has ended", ErrorKind::kMachine);
  }
  const auto run = [&session](const std::vector<std::string>& lines) -> Result<void> {
    for (const std::string& line : lines) {
      if (auto done = session.printer.Run(line, session.Within(kAsk_s)); !done) return done;
    }
    return {};
  };
  if (auto set = run(SetCommands(OffsetKeeper::kKlipperTool, tool, offset)); !set) return set;
  const auto now = ReadToolOffset(session, tool);
  if (!now) return tl::unexpected(now.error());
  constexpr double kRounding_mm = 0.00051;  // commands carry micrometres
  if (std::abs(now->x_mm - offset.x_mm) > kRounding_mm ||
      std::abs(now->y_mm - offset.y_mm) > kRounding_mm) {
    return Fail(fmt::format("the printer was told an offset of {:.3f}, {:.3f} mm for tool {} and "
                            "reports {:.3f}, {:.3f} mm",
                            offset.x_mm, offset.y_mm, tool, now->x_mm, now->y_mm),
                ErrorKind::kMachine);
  }
  return save ? run(SaveCommands(OffsetKeeper::kKlipperTool, tool)) : Result<void>{};
}

}  // namespace trammel::procedure
