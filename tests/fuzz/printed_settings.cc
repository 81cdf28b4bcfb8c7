// From trammel.toml to what is printed with it: whatever is found to be good can be laid out,
// written as G-code and read back.
#include <string>

#include "app/config/config_file.h"
#include "fuzz.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern.h"
#include "settings/material.h"
#include "sim/print/plan_file.h"
#include "tool_offset/sheet/sheet_comments.h"
#include "tool_offset/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace {

using namespace trammel;

void PrintPattern(const files::Config& config, std::string_view text) {
  if (!fuzz::Good(files::ValidateConfig(config, text, "trammel.toml"))) return;
  if (settings::FindTemperatureProblem(config.pattern)) return;
  const auto layout = pressure_advance::LayOut(config.pattern);
  (void)pressure_advance::Summarise(layout, config.pattern);
  fuzz::Require(!pressure_advance::WriteGcode(layout, config.pattern).empty(), "a file is written");
  const auto plan = pressure_advance::MakePlan(layout, config.pattern, "pattern.gcode");
  const std::string written = files::FormatPlan(plan);
  fuzz::Require(fuzz::Good(files::ParsePlan(written, "plan.json")), "a plan of ours can be read");
  fuzz::Require(fuzz::Good(sim::ParsePlan(written)), "by the virtual print shop, too");
}

void PrintSheet(const tool_offset::SheetSettings& settings) {
  if (tool_offset::FindProblem(settings) || tool_offset::FindTemperatureProblem(settings)) return;
  (void)tool_offset::FindWarnings(settings);
  const auto gcode = tool_offset::WriteSheetGcode(tool_offset::PlanSheet(settings));
  fuzz::Require(fuzz::Good(tool_offset::ReadSheetFile(gcode.text)), "a sheet of ours can be read");
}

}  // namespace

TRAMMEL_FUZZ_TARGET(printed_settings)(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::Text(data, size);
  const auto config = files::ParseConfig(text, "trammel.toml");
  if (!fuzz::Good(config)) return 0;
  PrintPattern(*config, text);
  PrintSheet(files::SheetOf(*config));
  return 0;
}
