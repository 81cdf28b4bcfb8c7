#include "tool_offset/sheet/sheet_comments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tool_offset/sheet/sheet_gcode.h"

namespace trammel::tool_offset {
namespace {

using ::testing::HasSubstr;

SheetSettings Unusual() {
  SheetSettings settings;
  settings.tools = {4, 0, 7};
  settings.reference_tool = 7;
  settings.controls = 4;
  settings.pick_ups = 1;
  settings.pitch_mm = 4.19 + 1.0 / 3;
  settings.tilt_deg = -12.5;
  settings.nozzle_temperatures_c = {200.5, 250, 1e3 / 4};
  settings.tool_change_gcode = "; trammel sheet: end\nT{tool} ; \"quoted\" \\ back\tslash\r\n";
  settings.position_x_mm = 141.25;
  settings.printer.dialect = gcode::Dialect::kRepRapFirmware;
  settings.printer.bed_size_x_mm = 300;
  settings.printer.bed_size_y_mm = 300;
  settings.printer.start_gcode = "G28\nM140 S{bed_temperature_c}\n; µ\n";
  settings.filament.bed_temperature_c = 51.5;
  return settings;
}

TEST(SheetFile, SettingsReadBackAsTheyWere) {
  SheetSettings plain;
  plain.filament.material = "pla";
  for (const SheetSettings& settings : {plain, Unusual()}) {
    ASSERT_EQ(FindProblem(settings).has_value(), false);
    const SheetPlan plan = PlanSheet(settings);
    const Result<SheetSettings> read = ReadSheetFile(WriteSheetGcode(plan).text);
    ASSERT_TRUE(read) << read.error().message;
    // Both write the same text, bit for bit, and have the same plan.
    EXPECT_EQ(FormatSheetComments(PlanSheet(*read)), FormatSheetComments(plan));
    EXPECT_EQ(read->pitch_mm, settings.pitch_mm);
    EXPECT_EQ(read->tools, settings.tools);
    EXPECT_EQ(read->tool_change_gcode, settings.tool_change_gcode);
    EXPECT_EQ(read->position_x_mm, settings.position_x_mm);
    EXPECT_EQ(read->position_y_mm, settings.position_y_mm);
    EXPECT_EQ(read->printer.dialect, settings.printer.dialect);
    EXPECT_EQ(read->printer.start_gcode, settings.printer.start_gcode);
    EXPECT_EQ(read->start_gcode, settings.start_gcode);
    EXPECT_EQ(read->filament.material, settings.filament.material);
    EXPECT_EQ(WriteSheetGcode(PlanSheet(*read)).text, WriteSheetGcode(plan).text);
  }
}

TEST(SheetFile, LineEndsOfWindowsAndLinesInFrontDoNoHarm) {
  std::string text = "; uploaded by somebody\n" + FormatSheetComments(PlanSheet({}));
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) {
    text.replace(at, 1, "\r\n");
  }
  EXPECT_TRUE(ReadSheetFile(text));
}

std::string Changed(const std::string& from, const std::string& to) {
  std::string text = FormatSheetComments(PlanSheet({}));
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string Fault(const std::string& text) {
  const Result<SheetSettings> read = ReadSheetFile(text);
  return read ? "no error" : read.error().message;
}

TEST(SheetFile, EachFaultIsNamedWithItsLine) {
  for (const std::string& text :
       {std::string(), std::string("G28\nG1 X5\n"), std::string(100000, '\0')}) {
    EXPECT_THAT(Fault(text), HasSubstr("not a pattern"));
  }
  const std::string pitch = "tool_offset_pattern.pitch = 4.19";
  const struct {
    std::string from;
    std::string to;
    const char* says;
  } faults[] = {{"format = 3", "format = 2", "line 1: format 2"},
                {"pitch = 4.19", "pitch = nan", "pitch: nan mm"},
                {"pitch = 4.19", "pitch = 4.19 ", "must be a number"},
                {"pitch = 4.19", "pitch = 1e999", "must be a number"},
                {"pitch = 4.19", "pich = 4.19", "no setting tool_offset_pattern.pich"},
                {pitch, pitch + "\n; trammel sheet: " + pitch, "pitch stands twice"},
                {"; trammel sheet: " + pitch + "\n", "", "no tool_offset_pattern.pitch"},
                {"tools = [0, 1]", "tools = [0, 0]", "0 stands twice"},
                {"tools = [0, 1]", "tools = [0, 2]", "the file was changed"},
                {"tools = [0, 1]", "tools = 0, 1", "list in brackets"},
                {"tools = [0, 1]", "tools = [0, 99999999999]", "whole number"},
                {"\"T{tool}\"", "\"T{tool}", "text in quotes"},
                {"\"T{tool}\"", "\"T{tool}\\q\"", "backslash"},
                {"pause = true", "pause = yes", "true or false"},
                {"= klipper", "= clipper", "there is no clipper"}};
  for (const auto& fault : faults) {
    EXPECT_THAT(Fault(Changed(fault.from, fault.to)), HasSubstr(fault.says));
  }
  const std::string whole = FormatSheetComments(PlanSheet({}));
  EXPECT_THAT(Fault(whole.substr(0, whole.size() / 2)), HasSubstr("line"));
  EXPECT_THAT(Fault("; trammel sheet: pitch = 4\n"), HasSubstr("the first key is pitch"));
}

}  // namespace
}  // namespace trammel::tool_offset
