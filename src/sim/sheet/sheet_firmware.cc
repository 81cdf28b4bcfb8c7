// Which firmware a sheet's G-code is for.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "base/text.h"
#include "sim/sheet/sheet_interpreter.h"

namespace trammel::sim {
namespace {

constexpr std::array kFirmwares = {SheetFirmware::kKlipper, SheetFirmware::kMarlin,
                                   SheetFirmware::kRepRapFirmware};

struct Signs {
  std::array<bool, 3> named{};      // by a comment, in the order of kFirmwares
  std::array<bool, 3> commanded{};  // by a command that only it knows
};

void Look(std::string_view line, Signs& signs) {
  const std::size_t comment = std::min(line.size(), line.find(';'));
  const std::string words = UpperCase(line.substr(comment));
  const auto says = [&words](const char* name) { return words.find(name) != std::string::npos; };
  signs.named[0] |= says("KLIPPER");
  signs.named[1] |= says("MARLIN");
  signs.named[2] |= says("REPRAP") || says("RRF");
  const Command command = ParseCommand(line, 0);
  const std::string& name = command.name;
  signs.commanded[0] |= name.find('_') != std::string::npos;
  signs.commanded[1] |= name == "M218";
  signs.commanded[2] |= (name == "G10" && command.has("P")) || name == "M568" || name == "M563";
}

}  // namespace

std::string_view ToString(SheetFirmware firmware) {
  switch (firmware) {
    case SheetFirmware::kKlipper:
      return "klipper";
    case SheetFirmware::kMarlin:
      return "marlin";
    case SheetFirmware::kRepRapFirmware:
      return "reprapfirmware";
  }
  return "klipper";
}

Result<SheetFirmware> ParseSheetFirmware(std::string_view name) {
  for (const SheetFirmware firmware : kFirmwares) {
    if (ToString(firmware) == name) return firmware;
  }
  if (name == "rrf") return SheetFirmware::kRepRapFirmware;
  return Fail(fmt::format("there is no firmware \"{}\"; choose klipper, marlin or reprapfirmware",
                          name.substr(0, 40)));
}

SheetFirmware GuessSheetFirmware(std::string_view gcode) {
  Signs signs;
  while (!gcode.empty()) {
    const std::size_t end = std::min(gcode.size(), gcode.find('\n'));
    Look(gcode.substr(0, end), signs);
    gcode.remove_prefix(std::min(gcode.size(), end + 1));
  }
  for (const auto& found : {signs.named, signs.commanded}) {
    if (std::count(found.begin(), found.end(), true) != 1) continue;
    return kFirmwares[static_cast<std::size_t>(
        std::distance(found.begin(), std::find(found.begin(), found.end(), true)))];
  }
  return SheetFirmware::kKlipper;
}

}  // namespace trammel::sim
