// What the owner of an original sheet has of it: the generator's G-code, or its settings.
#include <string>

#include "fuzz.h"
#include "tool_offset/original/original_gcode.h"
#include "tool_offset/original/original_script.h"

namespace {

void CheckSheet(const trammel::tool_offset::OriginalSheet& sheet) {
  using namespace trammel;
  fuzz::Require(fuzz::Good(Validate(sheet)), "a sheet that was read is valid");
  const tool_offset::SheetPlan plan = PlanOriginal(sheet);
  fuzz::Require(plan.structures.size() == 4 * sheet.tools.size(), "each pair has four structures");
  fuzz::Require(!plan.notices.empty(), "it is always said that the identity is not checked");
}

}  // namespace

TRAMMEL_FUZZ_TARGET(original_sheet)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto text = fuzz::Text(data, size);
  const auto sheet = tool_offset::ReadOriginalGcode(text);
  if (fuzz::Good(sheet)) CheckSheet(*sheet);
  const auto sheets = tool_offset::ReadOriginalScript(text);
  if (!fuzz::Good(sheets)) return 0;
  fuzz::Require(!sheets->empty(), "settings without a print are refused");
  for (const auto& one : *sheets) CheckSheet(one);
  return 0;
}
