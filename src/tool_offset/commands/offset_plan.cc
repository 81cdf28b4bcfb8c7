#include "tool_offset/commands/offset_plan.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string_view>
#include <vector>

#include "files/whole_file.h"
#include "tool_offset/original/original_gcode.h"
#include "tool_offset/original/original_script.h"
#include "tool_offset/sheet/sheet_comments.h"

namespace trammel::app {
namespace {

using tool_offset::OriginalSheet;
using tool_offset::SheetPlan;

std::string Listed(const std::vector<int>& tools) {
  std::string text;
  for (const int tool : tools) text += fmt::format("{}{}", text.empty() ? "" : ",", tool);
  return text;
}

/// The print that was chosen, or the only one.
Result<OriginalSheet> ChoosePrint(const std::vector<OriginalSheet>& sheets, int print) {
  const auto count = static_cast<int>(sheets.size());
  if (print > count || (print == 0 && count > 1)) {
    std::string prints;
    for (int i = 0; i < count; ++i) {
      const OriginalSheet& sheet = sheets[static_cast<std::size_t>(i)];
      prints += fmt::format("{}{}: tools {} against T{}", i == 0 ? "" : "; ", i + 1,
                            Listed(sheet.tools), sheet.reference_tool);
    }
    return Fail(fmt::format("prints {} sheets ({}): say with --print which of them was scanned",
                            count, prints));
  }
  return sheets[static_cast<std::size_t>(print == 0 ? 0 : print - 1)];
}

Result<SheetPlan> PlanOfText(const std::string& text, int print) {
  if (tool_offset::IsOriginalGcode(text)) {
    const auto sheet = tool_offset::ReadOriginalGcode(text);
    if (!sheet) return tl::unexpected(sheet.error());
    return PlanOriginal(*sheet);
  }
  if (tool_offset::IsOriginalScript(text)) {
    const auto sheets = tool_offset::ReadOriginalScript(text);
    if (!sheets) return tl::unexpected(sheets.error());
    const auto sheet = ChoosePrint(*sheets, print);
    if (!sheet) return tl::unexpected(sheet.error());
    return PlanOriginal(*sheet);
  }
  const auto settings = tool_offset::ReadSheetFile(text);
  if (!settings) return tl::unexpected(settings.error());
  return tool_offset::PlanSheet(*settings);
}

}  // namespace

std::optional<std::vector<int>> ParseToolList(std::string_view text) {
  constexpr std::size_t kMost = 100;
  std::vector<int> tools;
  for (;;) {
    int tool = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), tool);
    if (error != std::errc{} || tools.size() >= kMost) return std::nullopt;
    tools.push_back(tool);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (text.empty()) return tools;
    if (text.front() != ',') return std::nullopt;
    text.remove_prefix(1);
  }
}

Result<SheetPlan> PlanOf(const SheetChoice& choice) {
  if (choice.pattern.empty() == choice.original.empty()) {
    return Fail(
        "give --pattern with the file that was printed, or for a sheet of the original generator "
        "whose file is lost --original with its list of tools");
  }
  if (!choice.original.empty()) {
    const auto tools = ParseToolList(choice.original);
    if (!tools) return Fail("--original is to be a list of tools, for example 1,2,3,4,5");
    if (choice.reference_tool < 0) {
      return Fail("--original needs --reference-tool: the tool that drew the box");
    }
    OriginalSheet sheet;
    sheet.tools = *tools;
    sheet.reference_tool = choice.reference_tool;
    sheet.rotation_deg = choice.rotation_deg;
    sheet.moved.assign(sheet.tools.size(), {});
    if (const auto valid = Validate(sheet); !valid) {
      return Fail(fmt::format("--original {}: {}", Listed(sheet.tools), valid.error().message));
    }
    return PlanOriginal(sheet);
  }
  constexpr std::size_t kMostBytes = std::size_t{256} << 20U;
  const auto text = files::ReadWholeFile(choice.pattern, kMostBytes);
  if (!text) return tl::unexpected(text.error());
  auto plan = PlanOfText(*text, choice.print);
  if (plan) return plan;
  return tl::unexpected(Error{
      plan.error().kind, fmt::format("--pattern {}: {}", choice.pattern, plan.error().message)});
}

}  // namespace trammel::app
