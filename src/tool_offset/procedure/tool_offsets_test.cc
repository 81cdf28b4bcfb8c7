#include "tool_offset/procedure/tool_offsets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "session/fake_printer.h"
#include "support/matchers.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Keeps the offset of tool 1 alone, which has a name of its own.
class ToolPrinter : public testing::FakePrinter {
 public:
  nlohmann::json tool = {{"gcode_x_offset", 0.25}, {"gcode_y_offset", -0.5}};
  bool deaf = false;      // takes commands and does nothing
  bool included = false;  // SAVE_CONFIG cannot write the section
  bool pending = false;
  bool changer = true;

  Result<void> Run(std::string_view script, const machine::WaitLimit& limit) override {
    const auto done = FakePrinter::Run(script, limit);
    char axis = 0;
    double value = 0;
    if (!deaf && std::sscanf(std::string(script).c_str(),
                             "SET_TOOL_PARAMETER T=1 PARAMETER=gcode_%c_offset VALUE=%lf", &axis,
                             &value) == 2) {
      tool[axis == 'x' ? "gcode_x_offset" : "gcode_y_offset"] = value;
    }
    if (script.starts_with("SAVE_TOOL_PARAMETER")) pending = true;
    if (script == "SAVE_CONFIG") {
      if (included) return Fail("conflicts with included value", ErrorKind::kMachine);
      pending = false;
    }
    return done;
  }
  Result<nlohmann::json> Query(const std::vector<machine::ObjectFields>& objects,
                               const machine::WaitLimit&) override {
    nlohmann::json status = nlohmann::json::object();
    for (const machine::ObjectFields& asked : objects) {
      status[asked.object] = nlohmann::json::object();
      if (asked.object == "tool left") status[asked.object] = tool;
      if (asked.object == "configfile") status[asked.object]["save_config_pending"] = pending;
      if (asked.object == "toolchanger" && changer) {
        status[asked.object] = {{"tool_numbers", {0, 1}}, {"tool_names", {"tool T0", "tool left"}}};
      }
    }
    return status;
  }
};

TEST(ToolOffsets, AnOffsetThatNoToolHasIsThePrintersFault) {
  ToolPrinter printer;
  printer.tool["gcode_y_offset"] = 1e308;
  EXPECT_THAT(ReadToolOffset({printer, {}, {}}, 1),
              FailsWith("gcode_y_offset of tool 1 is 1e+308 mm"));
}

TEST(ToolOffsets, AreReadSetAndReadBackUnderTheNameThatTheChangerTells) {
  ToolPrinter printer;
  const Session session{printer, {}, {}};
  const auto before = Must(ReadToolOffset(session, 1));
  EXPECT_EQ(before.x_mm, 0.25);
  EXPECT_EQ(before.y_mm, -0.5);
  ASSERT_TRUE(SetToolOffset(session, 1, {0.1, 0.2}));
  EXPECT_THAT(printer.scripts,
              ElementsAre("SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=0.100",
                          "SET_TOOL_PARAMETER T=1 PARAMETER=gcode_y_offset VALUE=0.200"));
}

TEST(ToolOffsets, AreKeptByOneSaveConfigBehindAllTools) {
  ToolPrinter printer;
  const Session session{printer, {}, {}};
  ASSERT_TRUE(SetToolOffset(session, 1, {0.1, 0.2}));
  printer.scripts.clear();
  Must(KeepToolOffsets(session, {{1, {0.1, 0.2}}}));
  EXPECT_THAT(printer.scripts,
              ElementsAre("SAVE_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset",
                          "SAVE_TOOL_PARAMETER T=1 PARAMETER=gcode_y_offset", "SAVE_CONFIG"));
}

TEST(ToolOffsets, AToolThatThePrinterHasNotIsNamedWithThoseThatItHas) {
  ToolPrinter printer;
  EXPECT_THAT(ReadToolOffset({printer, {}, {}}, 2),
              FailsWith("no tool 2: its toolchanger has [0,1]"));
  printer.changer = false;
  EXPECT_THAT(ReadToolOffset({printer, {}, {}}, 1), FailsWith("--now 1:X,Y"));
}

using ::testing::AllOf;
using ::testing::Contains;

using ::testing::IsEmpty;
using Json = nlohmann::json;

/// Makes the contents of printer.cfg, by the names of its sections.
Json Settings(const std::vector<std::string>& sections) {
  Json settings = Json::object();
  for (const std::string& section : sections) settings[section] = Json::object();
  return {{"settings", settings}};
}

TEST(PrinterTools, OfAToolchangerHaveTheirNumbersExtrudersAndOffsets) {
  testing::FakePrinter printer;
  printer.told["configfile"] = Settings({"extruder", "extruder1", "heater_bed", "toolchanger"});
  printer.told["toolchanger"] = {{"tool_numbers", {0, 1}}, {"tool_names", {"tool T0", "tool b"}}};
  printer.told["tool T0"] = {
      {"extruder", "extruder"}, {"gcode_x_offset", 0}, {"gcode_y_offset", 0}};
  printer.told["tool b"] = {
      {"extruder", "extruder1"}, {"gcode_x_offset", 0.25}, {"gcode_y_offset", -0.5}};
  const auto found = Must(ReadTools({printer, {}, {}}));
  EXPECT_TRUE(found.can_be_set());
  ASSERT_EQ(found.tools.size(), 2U);
  EXPECT_EQ(found.tools[1].number, 1);
  EXPECT_EQ(found.tools[1].extruder, "extruder1");
  ASSERT_TRUE(found.tools[1].kept);
  EXPECT_EQ(found.tools[1].kept->y_mm, -0.5);
  EXPECT_THAT(found.notices, IsEmpty());
  EXPECT_EQ(UsualToolChange({printer, {}, {}}, found).value(), "T{tool}");
  printer.unknown["T0"] = true;
  EXPECT_EQ(UsualToolChange({printer, {}, {}}, found).value(), "SELECT_TOOL T={tool}");
}

TEST(PrinterTools, OneToolAloneIsNamed) {
  testing::FakePrinter printer;
  printer.told["configfile"] = Settings({"extruder", "heater_bed"});
  EXPECT_THAT(ReadTools({printer, {}, {}}),
              FailsWith(ErrorKind::kMachine, "the printer has one tool, T0 (extruder)"));
  printer.told = Json::object();
  EXPECT_THAT(ReadTools({printer, {}, {}}).error().message, HasSubstr("tells of no tool"));
}

TEST(PrinterTools, WhereNobodyKeepsOffsetsItIsSaidWhoDoesAndWhatCanBeDone) {
  struct Case {
    std::vector<std::string> sections;
    ToolKeeper keeper;
    const char* words;
    const char* change;
  };
  for (const Case& c :
       {Case{{"extruder", "extruder1", "dual_carriage", "gcode_macro t0", "gcode_macro t1"},
             ToolKeeper::kDualCarriage,
             "[dual_carriage] (IDEX)",
             "T{tool}"},
        Case{{"extruder", "extruder1", "gcode_macro t0", "gcode_macro t1"},
             ToolKeeper::kMacros,
             "[gcode_macro T0]",
             "T{tool}"},
        Case{{"extruder", "extruder1"},
             ToolKeeper::kExtruders,
             "several extruders",
             "ACTIVATE_EXTRUDER EXTRUDER={extruder}"}}) {
    testing::FakePrinter printer;
    printer.told["configfile"] = Settings(c.sections);
    const auto found = Must(ReadTools({printer, {}, {}}));
    EXPECT_EQ(found.keeper, c.keeper);
    EXPECT_FALSE(found.can_be_set());
    EXPECT_EQ(found.tools.size(), 2U);
    EXPECT_FALSE(found.tools[1].kept);
    EXPECT_THAT(found.notices,
                Contains(AllOf(HasSubstr(c.words), HasSubstr("--for klipper-gcode-offset"))));
    EXPECT_EQ(UsualToolChange({printer, {}, {}}, found).value(), c.change);
  }
}

/// Makes two carriages as in generic_cartesian's configuration.
Json NamedCarriages() {
  Json told = Settings({"extruder", "extruder1", "heater_bed", "carriage x", "carriage y"});
  told["settings"]["dual_carriage carriage_u"] = {{"primary_carriage", "x"}};
  return told;
}

TEST(PrinterTools, CarriagesWithNamesArePickedUpByMacrosAlone) {
  testing::FakePrinter printer;
  printer.told["configfile"] = NamedCarriages();
  const auto found = Must(ReadTools({printer, {}, {}}));
  EXPECT_EQ(found.keeper, ToolKeeper::kDualCarriage);
  EXPECT_THAT(found.notices, Contains(HasSubstr("(IDEX)")));
  EXPECT_EQ(UsualToolChange({printer, {}, {}}, found).value(), "T{tool}");
  printer.unknown["T0"] = true;
  EXPECT_THAT(UsualToolChange({printer, {}, {}}, found),
              FailsWith(ErrorKind::kSafety, "[gcode_macro T0] (SET_DUAL_CARRIAGE CARRIAGE=x, ",
                        "[gcode_macro T1] (SET_DUAL_CARRIAGE CARRIAGE=carriage_u, "));
}

TEST(PrinterTools, AToolChangeThatLeavesTheCarriageBehindIsRefused) {
  testing::FakePrinter printer;
  printer.told["configfile"] = NamedCarriages();
  const auto named = ReadTools({printer, {}, {}});
  printer.told["configfile"] = Settings({"extruder", "extruder1", "dual_carriage"});
  const auto numbered = ReadTools({printer, {}, {}});
  ASSERT_TRUE(named && numbered);
  const std::string activate = "ACTIVATE_EXTRUDER EXTRUDER={extruder}";
  EXPECT_TRUE(CheckCarriages(*named, activate).unsafe);
  EXPECT_TRUE(CheckCarriages(*numbered, activate).unsafe);
  EXPECT_TRUE(CheckCarriages(*named, "SET_DUAL_CARRIAGE CARRIAGE={tool}\n" + activate).unsafe);
  EXPECT_TRUE(CheckCarriages(*numbered, "SET_DUAL_CARRIAGE CARRIAGE={tool}\n" + activate).passed);
  for (const auto& tools : {*named, *numbered}) {
    EXPECT_TRUE(CheckCarriages(tools, "T{tool}").passed);
    EXPECT_TRUE(CheckCarriages(tools, "; by hand\nPICK_UP TOOL={tool}\n").passed);
  }
}

TEST(PrinterTools, ProbesOfTheirOwnAreNamed) {
  testing::FakePrinter printer;
  printer.told["configfile"] = Settings({"extruder", "extruder1", "tool_probe t0"});
  EXPECT_THAT(ReadTools({printer, {}, {}}).value().notices,
              AllOf(Contains(HasSubstr("[tool_probe]")), Contains(HasSubstr("no [heater_bed]"))));
}

}  // namespace

}  // namespace trammel::procedure
