#include "procedure/tool_offsets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "procedure/fake_printer.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using tool_offset::KeptOffset;

// Keeps the offset of T1 alone.
class ToolPrinter : public testing::FakePrinter {
 public:
  nlohmann::json tool = {{"gcode_x_offset", 0.25}, {"gcode_y_offset", -0.5}};
  bool deaf = false;  // takes commands and does nothing

  Result<void> Run(std::string_view script, const machine::WaitLimit& limit) override {
    const auto done = FakePrinter::Run(script, limit);
    char axis = 0;
    double value = 0;
    if (!deaf && std::sscanf(std::string(script).c_str(),
                             "SET_TOOL_PARAMETER T=1 PARAMETER=gcode_%c_offset VALUE=%lf", &axis,
                             &value) == 2) {
      tool[axis == 'x' ? "gcode_x_offset" : "gcode_y_offset"] = value;
    }
    return done;
  }
  Result<nlohmann::json> Query(const std::vector<machine::ObjectFields>& objects,
                               const machine::WaitLimit&) override {
    nlohmann::json status = nlohmann::json::object();
    for (const machine::ObjectFields& asked : objects) {
      status[asked.object] = asked.object == "tool T1" ? tool : nlohmann::json::object();
    }
    return status;
  }
};

TEST(ToolOffsets, AreReadSetReadBackAndKeptOnlyWhenAskedTo) {
  ToolPrinter printer;
  const Session session{printer, {}, {}};
  const auto before = ReadToolOffset(session, 1);
  ASSERT_TRUE(before) << before.error().message;
  EXPECT_EQ(before->x_mm, 0.25);
  EXPECT_EQ(before->y_mm, -0.5);
  ASSERT_TRUE(SetToolOffset(session, 1, {0.1, 0.2}, false));
  EXPECT_THAT(printer.scripts,
              ElementsAre("SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=0.100",
                          "SET_TOOL_PARAMETER T=1 PARAMETER=gcode_y_offset VALUE=0.200"));
  ASSERT_TRUE(SetToolOffset(session, 1, {0.1, 0.2}, true));
  EXPECT_EQ(printer.scripts.back(), "SAVE_TOOL_PARAMETER T=1 PARAMETER=gcode_y_offset");
}

TEST(ToolOffsets, AValueThatDoesNotComeBackIsAnError) {
  ToolPrinter printer;
  printer.deaf = true;
  const auto set = SetToolOffset({printer, {}, {}}, 1, {0.1, 0.2}, true);
  ASSERT_FALSE(set);
  EXPECT_THAT(set.error().message, HasSubstr("reports 0.250, -0.500 mm"));
  EXPECT_EQ(printer.scripts.size(), 2U);  // nothing is kept
}

TEST(ToolOffsets, APrintIsNotDisturbed) {
  ToolPrinter printer;
  printer.state.print_state = "printing";
  EXPECT_FALSE(SetToolOffset({printer, {}, {}}, 1, {0.1, 0.2}, false));
  EXPECT_TRUE(printer.scripts.empty());
}

TEST(ToolOffsets, AToolThatThePrinterHasNotIsNamed) {
  ToolPrinter printer;
  const auto none = ReadToolOffset({printer, {}, {}}, 2);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("tool 2"));
}

}  // namespace
}  // namespace trammel::procedure
