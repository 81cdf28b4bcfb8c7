// The settings of a sheet, read back from its G-code.
#include <string>

#include "fuzz.h"
#include "tool_offset/sheet/sheet_comments.h"

TRAMMEL_FUZZ_TARGET(sheet_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto settings = tool_offset::ReadSheetFile(fuzz::Text(data, size));
  if (!fuzz::Good(settings)) return 0;
  const std::string text = tool_offset::FormatSheetComments(tool_offset::PlanSheet(*settings));
  const auto again = tool_offset::ReadSheetFile(text);
  fuzz::Require(fuzz::Good(again), "a sheet that was written can be read");
  fuzz::Require(tool_offset::FormatSheetComments(tool_offset::PlanSheet(*again)) == text,
                "a sheet reads back as it was written");
  return 0;
}
