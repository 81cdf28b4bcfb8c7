#include "app/guide.h"

#include <fmt/format.h>

#include <string_view>

namespace trammel::app {
namespace {

struct Way {
  std::string_view command;  ///< of the first level, that it needs
  std::string_view have;
  std::string_view begin;
};

constexpr Way kWays[] = {
    {"pa", "a phone, any printer", "trammel pa pattern --material pla --photo --out pattern.gcode"},
    {"pa", "  … then print it, photograph it", "trammel pa analyze PHOTO --plan pattern.plan.json"},
    {"pa", "a phone, a Klipper printer", "trammel pa print --photo --material pla --printer HOST"},
    {"pa", "a camera and a line laser (Klipper)", "trammel doctor --printer HOST"},
    {"pa", "  … then", "trammel pa calibrate --material pla --printer HOST"},
    {"tap", "a load cell (Klipper)", "trammel tap watch --printer HOST"},
    {"offset", "several tools; a scanner or a phone", "trammel offset start --printer HOST"},
    {"align", "a mill, a camera in its spindle", "trammel align init"},
    {"sim", "none of these yet", "trammel sim printer"},
};

}  // namespace

std::string Guide(const std::function<bool(std::string_view)>& has) {
  std::string text =
      "trammel measures what a machine has made, and calibrates it.\n\n"
      "What do you have?                     Begin with\n";
  for (const Way& way : kWays) {
    if (has(way.command)) text += fmt::format("  {:<36}{}\n", way.have, way.begin);
  }
  return text +
         "\nHOST is the address of the printer's Moonraker, such as mainsail.local. Nothing heats "
         "or\n"
         "moves before a material is named, and nothing is applied unasked.\n"
         "All commands: trammel --help. Settings: trammel config init. Manual: docs/README.md\n";
}

}  // namespace trammel::app
