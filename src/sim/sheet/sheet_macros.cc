#include "sim/sheet/sheet_macros.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>

#include "base/text.h"

namespace trammel::sim {
namespace {

// The name in "[gcode_macro NAME]"; nothing for other lines.
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

}  // namespace trammel::sim
