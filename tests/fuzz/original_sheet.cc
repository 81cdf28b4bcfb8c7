// The G-code of the original generator's sheet.
#include "fuzz.h"
#include "tool_offset/original/original_gcode.h"

TRAMMEL_FUZZ_TARGET(original_sheet)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto sheet = tool_offset::ReadOriginalGcode(fuzz::Text(data, size));
  if (!fuzz::Good(sheet)) return 0;
  fuzz::Require(fuzz::Good(Validate(*sheet)), "a sheet that was read is valid");
  const tool_offset::SheetPlan plan = PlanOriginal(*sheet);
  fuzz::Require(plan.structures.size() == 4 * sheet->tools.size(), "each pair has four structures");
  fuzz::Require(!plan.notices.empty(), "a notice names that the identity is not checked");
  return 0;
}
