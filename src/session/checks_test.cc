#include "session/checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/fake_printer.h"

namespace trammel::procedure {
namespace {

using settings::FilamentSettings;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Configured : public testing::FakePrinter {
 public:
  nlohmann::json sections = {{"extruder", {{"min_extrude_temp", 180.0}, {"max_temp", 260.0}}},
                             {"heater_bed", {{"max_temp", 90.0}}}};

  Result<nlohmann::json> Query(const std::vector<machine::ObjectFields>&,
                               const machine::WaitLimit&) override {
    return nlohmann::json{{"configfile", {{"settings", sections}}}};
  }
};

Check Asked(machine::Printer& printer, double nozzle_c, double bed_c) {
  FilamentSettings pattern;
  pattern.nozzle_temperature_c = nozzle_c;
  pattern.bed_temperature_c = bed_c;
  return CheckTemperatures({printer, {}, {}}, pattern);
}

TEST(CheckTemperatures, ANozzleTooColdToExtrudeIsRefusedBeforeItIsHeated) {
  Configured printer;
  const Check cold = Asked(printer, 175, 60);
  EXPECT_FALSE(cold.passed);
  EXPECT_FALSE(cold.advice);
  EXPECT_THAT(cold.detail, AllOf(HasSubstr("nozzle_temperature = 175"), HasSubstr("below"),
                                 HasSubstr("min_extrude_temp = 180")));
  EXPECT_TRUE(Asked(printer, 180, 60).passed);
}

TEST(CheckTemperatures, NozzleAndBedAboveWhatThePrinterMayHaveAreRefused) {
  Configured printer;
  EXPECT_THAT(Asked(printer, 275, 60).detail,
              AllOf(HasSubstr("nozzle_temperature = 275"), HasSubstr("above"),
                    HasSubstr("max_temp of the extruder = 260")));
  const Check bed = Asked(printer, 255, 110);
  EXPECT_FALSE(bed.passed);
  EXPECT_THAT(bed.detail,
              AllOf(HasSubstr("bed_temperature = 110"), HasSubstr("max_temp of the bed = 90")));
  EXPECT_TRUE(Asked(printer, 260, 90).passed);
  EXPECT_TRUE(Asked(printer, 260, 0).passed);
}

TEST(CheckTemperatures, TheActiveExtrudersOwnLimitsCount) {
  Configured printer;
  printer.state.active_extruder = "extruder1";
  printer.sections["extruder1"] = {{"min_extrude_temp", 100.0}, {"max_temp", 200.0}};
  EXPECT_TRUE(Asked(printer, 175, 60).passed);
  EXPECT_FALSE(Asked(printer, 205, 60).passed);
}

TEST(CheckTemperatures, APrinterThatTellsNoLimitsIsTakenAsItIs) {
  testing::FakePrinter printer;
  EXPECT_TRUE(Asked(printer, 255, 110).passed);
  Configured strange;
  strange.sections = {{"extruder", {{"min_extrude_temp", "hot"}, {"max_temp", nullptr}}}};
  EXPECT_TRUE(Asked(strange, 255, 110).passed);
}

TEST(CheckTemperatures, WithoutAMaterialIsAdviceThatNamesBothWays) {
  Configured printer;
  const Check none = CheckTemperatures({printer, {}, {}}, FilamentSettings{});
  EXPECT_FALSE(none.passed);
  EXPECT_TRUE(none.advice);
  EXPECT_THAT(none.detail, HasSubstr("--material"));
}

}  // namespace
}  // namespace trammel::procedure
