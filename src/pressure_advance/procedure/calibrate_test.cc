#include "pressure_advance/procedure/calibrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/checks.h"
#include "session/fake_printer.h"
#include "session/print_needs.h"
#include "session/session.h"
#include "support/temporary_folder.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kLimit_s = 10;

// The fake's nozzle is at 205 °C and never cools: whatever waits for it fails.
TEST(CoolForScan, ZeroSwitchesOffAndWaitsForNothing) {
  testing::FakePrinter printer;
  const auto cooled = CoolForScan({printer, {}, {}}, printer.state, 0, kLimit_s);
  EXPECT_TRUE(cooled) << cooled.error().message;
  EXPECT_THAT(printer.scripts, ElementsAre("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=0"));
}

TEST(CoolForScan, AnyOtherTemperatureIsWaitedFor) {
  testing::FakePrinter printer;
  EXPECT_FALSE(CoolForScan({printer, {}, {}}, printer.state, 150, kLimit_s));
  EXPECT_THAT(printer.scripts, ElementsAre("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=150"));
  printer.state.heaters["extruder"] = {152, 150};
  EXPECT_TRUE(CoolForScan({printer, {}, {}}, printer.state, 150, kLimit_s));
}

using ::testing::AllOf;
using ::testing::HasSubstr;

// Printer whose answers stop with the user's stop, like those of real ones.
class StoppablePrinter : public testing::FakePrinter {
 public:
  Result<machine::PrinterState> State(const machine::WaitLimit& limit) override {
    if (limit.stop.stop_requested()) return Fail("stopped while asking", ErrorKind::kInterrupted);
    return FakePrinter::State(limit);
  }
  Result<nlohmann::json> Query(const std::vector<machine::ObjectFields>& objects,
                               const machine::WaitLimit& limit) override {
    if (limit.stop.stop_requested()) return Fail("stopped while asking", ErrorKind::kInterrupted);
    return FakePrinter::Query(objects, limit);
  }
};

class StoppedCalibration : public ::testing::Test {
 protected:
  // The user asks for the end as soon as that is said; never, where it is empty.
  CalibrationOutcome StopAt(machine::Printer& printer, const std::string& said) {
    const Session session{printer, stop_.get_token(), [&](const Progress& progress) {
                            if (progress.text == said) stop_.request_stop();
                          }};
    CalibrationRequest request;
    request.print = false;
    request.identity.run = "run-1";
    request.folder = folder_.path();
    request.identity.state_folder = folder_.path();
    return Calibrate(session, request);
  }

  std::stop_source stop_;
  test::TemporaryFolder folder_;
};

TEST_F(StoppedCalibration, WhileThePrinterIsCheckedIsNoFaultOfThePrinter) {
  StoppablePrinter printer;
  const auto outcome = StopAt(printer, "checking the printer");
  ASSERT_FALSE(outcome.done);
  EXPECT_EQ(outcome.done.error().kind, ErrorKind::kInterrupted) << outcome.done.error().message;
}

TEST_F(StoppedCalibration, IsToldBeforeACameraThatIsNotThere) {
  testing::FakePrinter printer;
  const auto outcome = StopAt(printer, "looking at the camera");
  ASSERT_FALSE(outcome.done);
  EXPECT_EQ(outcome.done.error().kind, ErrorKind::kInterrupted);
  EXPECT_THAT(outcome.done.error().message,
              AllOf(HasSubstr("stopped by the user"), HasSubstr("lists no camera")));
  EXPECT_THAT(outcome.unrestored, IsEmpty());
}

TEST(NameStopReason, ChecksThatAStopKeptFromBeingMadeAreNoRefusal) {
  StoppablePrinter printer;
  std::stop_source stop;
  stop.request_stop();
  const auto facts = ReadFacts({printer, stop.get_token(), {}});
  ASSERT_FALSE(facts);
  const auto failed = FirstFailure({NotMade("printer.cfg", facts.error())}, ErrorKind::kSafety);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().kind, ErrorKind::kInterrupted);
}

}  // namespace
}  // namespace trammel::procedure
