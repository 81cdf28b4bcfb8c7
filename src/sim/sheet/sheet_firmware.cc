#include "sim/sheet/sheet_firmware.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>

#include "base/text.h"
#include "sim/sheet/sheet_interpreter.h"

namespace trammel::sim {

namespace {

// Returns the name in "[gcode_macro NAME]"; absent for other lines.
std::optional<std::string> MacroName(std::string_view line) {
  constexpr std::string_view kStart = "[gcode_macro ";
  if (line.substr(0, kStart.size()) != kStart || line.back() != ']') return std::nullopt;
  return UpperCase(Trimmed(line.substr(kStart.size(), line.size() - kStart.size() - 1)));
}

class Reader {
 public:
  Result<void> Line(std::string_view raw, int number);
  Result<SheetMacros> Take();

 private:
  Result<void> End();

  SheetMacros macros_;
  std::optional<std::string> name_;
  std::optional<std::string> gcode_;
};

Result<void> Reader::End() {
  if (name_ && !gcode_) {
    return Fail(fmt::format("macro {} has no gcode:", name_->substr(0, 40)));
  }
  if (name_) macros_[*name_] = *gcode_;
  name_.reset();
  gcode_.reset();
  return {};
}

Result<void> Reader::Line(std::string_view raw, int number) {
  const std::string_view line = Trimmed(raw.substr(0, std::min(raw.size(), raw.find('#'))));
  if (line.empty()) return {};
  if (line.front() == '[') {
    TRY(End());
    name_ = MacroName(line);
    if (name_ && macros_.count(*name_) > 0) {
      return Fail(fmt::format("line {}: macro {} is given twice", number, name_->substr(0, 40)));
    }
    return {};
  }
  if (!name_) return {};
  const bool indented = std::isspace(static_cast<unsigned char>(raw.front())) != 0;
  if (!indented) {
    if (line.substr(0, 6) == "gcode:") gcode_ = std::string(Trimmed(line.substr(6))) + "\n";
    return {};
  }
  if (!gcode_) return {};
  if (line.find('{') != std::string_view::npos) {
    return Fail(
        fmt::format("line {}: macro {} uses a template; the virtual machine reads plain G-code "
                    "only: write the values out",
                    number, name_->substr(0, 40)));
  }
  *gcode_ += std::string(line) + "\n";
  return {};
}

Result<SheetMacros> Reader::Take() {
  TRY(End());
  return std::move(macros_);
}

}  // namespace

Result<SheetMacros> ParseSheetMacros(std::string_view config) {
  Reader reader;
  int number = 0;
  while (!config.empty()) {
    const std::size_t end = std::min(config.size(), config.find('\n'));
    TRY(reader.Line(config.substr(0, end), ++number));
    config.remove_prefix(std::min(config.size(), end + 1));
  }
  return reader.Take();
}

namespace {

constexpr std::array kFirmwares = {SheetFirmware::kKlipper, SheetFirmware::kMarlin,
                                   SheetFirmware::kRepRapFirmware};

struct Signs {
  std::array<bool, 3> named{};      // from a comment, in the order of kFirmwares
  std::array<bool, 3> commanded{};  // from a command unique to it
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
