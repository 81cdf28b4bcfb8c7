#include "session/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "session/fake_printer.h"
#include "session/print.h"
#include "session/uploads.h"
#include "support/matchers.h"

namespace trammel::procedure {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Somebody presses "print" when a certain command has been run.
class SharedPrinter : public testing::FakePrinter {
 public:
  std::string when;

  Result<void> Run(std::string_view script, const machine::WaitLimit& limit) override {
    auto done = FakePrinter::Run(script, limit);
    if (scripts.back() == when) {
      state.print_state = "printing";
      state.print_file = "vase.gcode";
    }
    return done;
  }
};

TEST(Session, NothingIsHeatedInAnothersJob) {
  testing::FakePrinter printer;
  printer.state.print_state = "paused";
  printer.state.print_file = "vase.gcode";
  const Session session{printer, {}, {}};
  EXPECT_FALSE(HeatAndWait(session, "extruder", 240, 10));
  EXPECT_FALSE(CoolAndWait(session, "extruder", 60, 10));
  EXPECT_FALSE(SetTarget(session, "heater_bed", 60));
  EXPECT_THAT(printer.scripts, IsEmpty());
}

TEST(Session, NothingIsPrintedIntoAnothersJob) {
  SharedPrinter printer;
  printer.when = "SET_HEATER_TEMPERATURE HEATER=heater_bed TARGET=60";
  Session session{printer, {}, {}};
  session.own_file = "trammel_run-1.gcode";
  PrintOptions options;
  options.bed_temperature_c = 60;
  options.nozzle_temperature_c = 205;
  EXPECT_FALSE(Print(session, "G28", options));
  EXPECT_THAT(printer.scripts, Not(Contains(HasSubstr("extruder"))));
  EXPECT_EQ(printer.state.print_file, "vase.gcode");
}

TEST(Session, AFinishedJobIsNoJobAndAPauseWithoutOneIs) {
  testing::FakePrinter printer;
  printer.state.print_file = "vase.gcode";
  for (const char* ended : {"complete", "cancelled", "error", "standby", ""}) {
    printer.state.print_state = ended;
    EXPECT_EQ(OthersJob(printer.state, ""), "") << ended;
  }
  printer.state.paused = true;
  EXPECT_NE(OthersJob(printer.state, ""), "");
}

TEST(Session, AnEmergencyStopIsSeenAfterAWaitWithoutAskingAnything) {
  testing::FakePrinter printer;
  const Session session{printer, {}, {}};
  EXPECT_TRUE(CheckStillHomed(session));
  printer.state.readiness = machine::PrinterReadiness::kShutdown;
  printer.state.message = "Shutdown due to webhooks request";
  EXPECT_THAT(CheckStillHomed(session), FailsWith(ErrorKind::kMachine, "webhooks request"));
  EXPECT_FALSE(CheckStillReady(session));
}

TEST(Session, LostHomingIsSeenAfterAWait) {
  testing::FakePrinter printer;
  printer.state.homed_axes = "xy";
  const Session session{printer, {}, {}};
  EXPECT_THAT(CheckStillHomed(session), FailsWith(ErrorKind::kMachine, "z axis"));
}

using testing::FakePrinter;
using ::testing::Field;

TEST(Uploads, TheFoldersOwnFilesComeByTheirTime) {
  FakePrinter printer;
  printer.server = [](const std::string&, const nlohmann::json&) -> Result<nlohmann::json> {
    return nlohmann::json::parse(R"([
      {"path": "printer.cfg", "modified": 9}, {"path": "trammel/b.png", "modified": 7.5},
      {"path": "trammel/old/c.png", "modified": 8}, {"path": "trammel/a.png", "modified": 3},
      {"path": "trammel/untold.png", "modified": null}, {"path": 7}, 3,
      {"path": "trammel/notes.txt", "modified": 8}])");
  };
  const auto uploads = ListUploads({printer, {}, {}},
                                   [](const std::string& name) { return name.ends_with(".png"); });
  ASSERT_TRUE(uploads);
  EXPECT_THAT(*uploads, ElementsAre(Field(&UploadedFile::name, "untold.png"),
                                    Field(&UploadedFile::name, "a.png"),
                                    Field(&UploadedFile::name, "b.png")));
}

TEST(Uploads, ALargerFileThanIsWantedIsRefused) {
  FakePrinter printer;
  printer.config_files["trammel/a.png"] = "12345";
  EXPECT_EQ(DownloadUpload({printer, {}, {}}, "a.png", 5).value_or(""), "12345");
  EXPECT_FALSE(DownloadUpload({printer, {}, {}}, "a.png", 4));
}

}  // namespace
}  // namespace trammel::procedure
