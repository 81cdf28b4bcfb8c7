#include "pressure_advance/procedure/apply_pressure_advance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <string>

#include "session/fake_printer.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

class Obedient : public testing::FakePrinter {
 public:
  Result<void> Run(std::string_view script, const machine::WaitLimit& limit) override {
    auto done = FakePrinter::Run(script, limit);
    double value = 0;
    const std::string line(script);
    if (std::sscanf(line.c_str(), "SET_PRESSURE_ADVANCE ADVANCE=%lf", &value) == 1) {
      state.pressure_advance["extruder"].advance_s = value;
    }
    for (auto& [section, motor] : state.pressure_advance) {
      const std::string named =
          "SET_PRESSURE_ADVANCE EXTRUDER=" + machine::NameInGcode(section) + " ADVANCE=%lf";
      if (std::sscanf(line.c_str(), named.c_str(), &value) == 1) motor.advance_s = value;
    }
    return done;
  }
};

TEST(ApplyPressureAdvance, SetsReadsBackAndTellsOldAndNew) {
  Obedient printer;
  const auto change = ApplyPressureAdvance({printer, {}, {}}, 0.0421, {});
  ASSERT_TRUE(change) << change.error().message;
  EXPECT_EQ(change->before_s, 0.031);
  EXPECT_EQ(change->after_s, 0.0421);
  EXPECT_THAT(printer.scripts, ElementsAre("SET_PRESSURE_ADVANCE ADVANCE=0.0421", "M400"));
}

TEST(ApplyPressureAdvance, SetsEveryMotorOnTheFilamentAndReadsEachBack) {
  Obedient printer;
  printer.state.pressure_advance["extruder_stepper belted"] = {0.0, 0.04, "extruder"};
  printer.state.pressure_advance["extruder_stepper spare"] = {0.01, 0.04, ""};
  const auto change = ApplyPressureAdvance({printer, {}, {}}, 0.0421, {});
  ASSERT_TRUE(change) << change.error().message;
  EXPECT_THAT(printer.scripts,
              ElementsAre("SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.0421",
                          "SET_PRESSURE_ADVANCE EXTRUDER=belted ADVANCE=0.0421", "M400"));
  ASSERT_EQ(change->motors.size(), 2U);
  EXPECT_EQ(change->motors[1].section, "extruder_stepper belted");
  EXPECT_EQ(change->motors[1].before_s, 0.0);
  EXPECT_EQ(printer.state.pressure_advance.at("extruder_stepper spare").advance_s, 0.01);
}

TEST(ApplyPressureAdvance, AMotorGetsTheValueThatIsAskedForItAlone) {
  Obedient printer;
  printer.state.pressure_advance["extruder_stepper belted"] = {0.042, 0.04, "extruder"};
  ApplyOptions options;
  options.own_s = {{"extruder_stepper belted", 0.01}};
  std::map<std::string, double> before;
  options.before_setting = [&](const PressureAdvanceChange& change) -> Result<void> {
    before = BeforeEach(change);
    return {};
  };
  const auto change = ApplyPressureAdvance({printer, {}, {}}, 0.02, options);
  ASSERT_TRUE(change) << change.error().message;
  EXPECT_EQ(printer.state.pressure_advance.at("extruder").advance_s, 0.02);
  EXPECT_EQ(printer.state.pressure_advance.at("extruder_stepper belted").advance_s, 0.01);
  EXPECT_THAT(before, ElementsAre(Pair("extruder", 0.031), Pair("extruder_stepper belted", 0.042)));
  options.own_s = {{"extruder_stepper belted", 9}};
  EXPECT_THAT(ApplyPressureAdvance({printer, {}, {}}, 0.02, options).error().message,
              HasSubstr("9.0000 s is above 0.2 s"));
}

TEST(ApplyPressureAdvance, SetsAllMotorsOrNone) {
  Obedient printer;
  printer.state.pressure_advance["extruder_stepper belted"] = {0.0, 0.04, "extruder"};
  printer.refused["SET_PRESSURE_ADVANCE EXTRUDER=belted ADVANCE=0.0421"] = "not now";
  const auto change = ApplyPressureAdvance({printer, {}, {}}, 0.0421, {});
  ASSERT_FALSE(change);
  EXPECT_EQ(printer.state.pressure_advance.at("extruder").advance_s, 0.031);
}

TEST(ApplyPressureAdvance, ChangesNothingWhereThereIsNoneInSeconds) {
  Obedient kalico;
  kalico.state.pressure_advance.clear();
  kalico.told = {
      {"configfile", {{"settings", {{"extruder", {{"pressure_advance_model", "tanh"}}}}}}}};
  const auto model = ApplyPressureAdvance({kalico, {}, {}}, 0.0421, {});
  ASSERT_FALSE(model);
  EXPECT_EQ(model.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(model.error().message, HasSubstr("is tanh"));
  EXPECT_THAT(kalico.scripts, IsEmpty());
  Obedient without;
  without.state.pressure_advance.clear();
  const auto stepper = ApplyPressureAdvance({without, {}, {}}, 0.0421, {});
  ASSERT_FALSE(stepper);
  EXPECT_THAT(stepper.error().message, HasSubstr("has no stepper of its own"));
  EXPECT_THAT(without.scripts, IsEmpty());
}

TEST(ApplyPressureAdvance, LeavesAPrintAndAPausedPrintAloneAndSendsNothing) {
  for (const char* print_state : {"printing", "paused"}) {
    Obedient printer;
    printer.state.print_state = print_state;
    printer.state.print_file = "vase.gcode";
    ApplyOptions forced;
    forced.force = true;
    const auto refused = ApplyPressureAdvance({printer, {}, {}}, 0.04, forced);
    ASSERT_FALSE(refused) << print_state;
    EXPECT_EQ(refused.error().kind, ErrorKind::kMachine);
    EXPECT_THAT(refused.error().message, HasSubstr("vase.gcode"));
    EXPECT_THAT(printer.scripts, IsEmpty());
  }
}

TEST(ApplyPressureAdvance, SetsNothingThatCannotBeNotedBefore) {
  Obedient printer;
  ApplyOptions options;
  std::optional<double> before_s;
  options.before_setting = [&](const PressureAdvanceChange& change) -> Result<void> {
    before_s = change.before_s;
    return Fail("the disk is full");
  };
  EXPECT_THAT(ApplyPressureAdvance({printer, {}, {}}, 0.04, options).error().message,
              HasSubstr("disk is full"));
  EXPECT_EQ(before_s, 0.031);
  EXPECT_THAT(printer.scripts, IsEmpty());
}

TEST(ApplyPressureAdvance, NineSecondsAreNotTakenUnasked) {
  Obedient printer;
  const auto refused = ApplyPressureAdvance({printer, {}, {}}, 9, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(refused.error().message, HasSubstr("above 0.2 s"));
  EXPECT_THAT(refused.error().message, HasSubstr("Bowden"));
  EXPECT_THAT(refused.error().message, HasSubstr("--force"));
  EXPECT_THAT(printer.scripts, IsEmpty());
  ApplyOptions forced;
  forced.force = true;
  EXPECT_TRUE(ApplyPressureAdvance({printer, {}, {}}, 9, forced));
}

TEST(ApplyPressureAdvance, NothingForcesWhatIsNoPressureAdvance) {
  Obedient printer;
  ApplyOptions forced;
  forced.force = true;
  for (const double value_s : {-0.01, 10.5, std::nan(""), HUGE_VAL}) {
    const auto refused = ApplyPressureAdvance({printer, {}, {}}, value_s, forced);
    ASSERT_FALSE(refused) << value_s;
    EXPECT_EQ(refused.error().kind, ErrorKind::kInput);
  }
  EXPECT_THAT(printer.scripts, IsEmpty());
}

TEST(ApplyPressureAdvance, ADryRunLooksAtEverythingAndSetsNothing) {
  Obedient printer;
  ApplyOptions dry;
  dry.dry_run = true;
  const auto change = ApplyPressureAdvance({printer, {}, {}}, 0.05, dry);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->before_s, 0.031);
  EXPECT_THAT(printer.scripts, IsEmpty());
  printer.state.print_state = "printing";
  EXPECT_FALSE(ApplyPressureAdvance({printer, {}, {}}, 0.05, dry));
}

TEST(ApplyPressureAdvance, AValueThatDoesNotComeBackIsAnError) {
  testing::FakePrinter deaf;
  const auto set = ApplyPressureAdvance({deaf, {}, {}}, 0.0421, {});
  ASSERT_FALSE(set);
  EXPECT_THAT(set.error().message, HasSubstr("reports 0.0310 s"));
}

TEST(ApplyPressureAdvance, APatternForABowdenTubeRaisesTheLimitToItsOwnRange) {
  pressure_advance::PatternConfig settings;
  EXPECT_EQ(ApplyLimit_s(settings), 0.2);
  settings.pressure_advance_end_s = 1;
  EXPECT_EQ(ApplyLimit_s(settings), 1);
  settings.pressure_advances_s = {0, 0.3, 0.6};
  EXPECT_EQ(ApplyLimit_s(settings), 0.6);
  settings.pressure_advance_limit_s = 1.5;
  EXPECT_EQ(ApplyLimit_s(settings), 1.5);
}

}  // namespace
}  // namespace trammel::procedure
