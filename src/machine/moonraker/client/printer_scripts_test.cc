// Scripts on a printer behind Moonraker, restarts and lost links, over real sockets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "machine/moonraker/moonraker_test_support.h"
#include "support/matchers.h"

namespace trammel::machine {
namespace {

using nlohmann::json;
using test::GcodeResponse;
using test::Notification;
using test::ResultFor;
using test::StatusUpdate;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(MoonrakerPrinterTest, AComplaintFailsTheScriptThoughTheAnswerIsOk) {
  Connect();
  struct Case {
    std::string said, script;
    std::vector<std::string> words;
  };
  for (const Case& one :
       {Case{"// Unknown command:\"FOO_BAR\"",
             "G28\nFOO_BAR X=1\nM400",
             {"does not know 'FOO_BAR'", "line 2, 'FOO_BAR X=1'"}},
        Case{"// Unknown command:\"SET_LAZER\"", "laser_on", {"SET_LAZER", "macro"}},
        Case{"!! laser interlock open", "LASER_ON", {"laser interlock open"}}}) {
    ScriptAnswers({GcodeResponse(one.said)});
    const std::string error = RunError(one.script);
    for (const std::string& word : one.words) EXPECT_THAT(error, HasSubstr(word));
    EXPECT_THAT(error, Not(HasSubstr("messages"))) << "the conversation is quoted on request alone";
  }
}

TEST_F(MoonrakerPrinterTest, AnotherClientsUnknownCommandDoesNotCount) {
  Connect();
  ScriptAnswers({GcodeResponse("// Unknown command:\"TYPO\"")});
  const Result<void> ran = printer_->Run("G28 X\nM400", kPatience);
  EXPECT_TRUE(ran) << ran.error().message;
}

TEST_F(MoonrakerPrinterTest, AComplaintThatTheAnswerOvertookIsStillHeard) {
  Connect();
  server_.Handle("server.info", [](const json& request) {
    return std::vector{GcodeResponse("// Unknown command:\"FOO\""),
                       ResultFor(request, json::object())};
  });
  EXPECT_THAT(RunError("FOO"), HasSubstr("does not know 'FOO'"));
}

TEST_F(MoonrakerPrinterTest, AnErrorNamesTheScriptTheReasonAndARemedy) {
  Connect({.quote_messages = true});
  server_.Handle("printer.gcode.script", [](const json& request) {
    const std::string words = "Move out of range: 999.000 50.000 0.300 [1.200]";
    return std::vector{GcodeResponse("!! " + words), test::ErrorFor(request, 400, words)};
  });
  EXPECT_THAT(
      RunError("G90\nG1 X10 Y50 Z0.3 F6000\nG1 X999\nM400"),
      Containing("from 'G90' to 'M400'", "Move out of range", "bed's size", "the last messages"));
}

TEST_F(MoonrakerPrinterTest, AScriptThatOutlastsItsTimeIsNamedAndCounted) {
  Connect();
  ScriptAnswers({}, /*answered=*/false);
  EXPECT_THAT(RunError("G4 P20000", kShort), Containing("did not finish 'G4 P20000' within 0.1 s",
                                                        "still running on the printer"));
  EXPECT_EQ(printer_->LastState().abandoned_scripts, 1);
  server_.Push(ResultFor(server_.WaitForRequest("printer.gcode.script"), "ok"));
  Settle();
  EXPECT_EQ(printer_->LastState().abandoned_scripts, 0);
}

TEST_F(MoonrakerPrinterTest, StopEndsAScriptsWaitAtOnceAndSaysThatItRuns) {
  Connect();
  ScriptAnswers({}, /*answered=*/false);
  std::stop_source source;
  auto running = std::async(std::launch::async, [&] {
    return printer_->Run("G4 P20000", {.time_limit_s = 60, .stop = source.get_token()});
  });
  EXPECT_FALSE(server_.WaitForRequest("printer.gcode.script").is_null());
  source.request_stop();
  EXPECT_THAT(running.get(), FailsWith(ErrorKind::kInterrupted, "it runs to its end",
                                       Not(HasSubstr("emergency stop"))));
}

TEST_F(MoonrakerPrinterTest, AShutdownCutsARunningScriptOffThoughItsAnswerIsOk) {
  Connect();
  ScriptAnswers({}, /*answered=*/false);
  auto running = std::async(std::launch::async, [&] { return printer_->Run("G28", kPatience); });
  const json request = server_.WaitForRequest("printer.gcode.script");
  server_.Push(StatusUpdate(
      {{"webhooks", {{"state", "shutdown"}, {"state_message", "Lost communication with MCU"}}}},
      3119.8));
  server_.Push(Notification("notify_klippy_shutdown"));
  server_.Push(ResultFor(request, "ok"));
  EXPECT_THAT(running.get(),
              FailsWith("'shutdown'", "Lost communication with MCU", "FIRMWARE_RESTART"));
  EXPECT_EQ(printer_->LastState().readiness, PrinterReadiness::kShutdown);
}

TEST_F(MoonrakerPrinterTest, ALostLinkFailsTheScriptAndIsTakenUpAgain) {
  Connect();
  ScriptAnswers({}, /*answered=*/false);
  auto running = std::async(std::launch::async, [&] { return printer_->Run("G28", kPatience); });
  EXPECT_FALSE(server_.WaitForRequest("printer.gcode.script").is_null());
  server_.BreakConnections();
  EXPECT_THAT(running.get(), FailsWith("lost the connection", "goes on running"));
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.subscribe", 2).is_null());
  ASSERT_TRUE(printer_->WaitUntilReady(kPatience));
  ScriptAnswers({});
  EXPECT_TRUE(printer_->Run("M400", kPatience));
}

TEST_F(MoonrakerPrinterTest, SubscribesAgainAfterARestart) {
  Connect();
  server_.Push(Notification("notify_klippy_disconnected"));
  server_.Push(Notification("notify_klippy_ready"));
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.subscribe", 2).is_null());
  ASSERT_TRUE(printer_->WaitUntilReady(kPatience));
  EXPECT_EQ(server_.CountRequests("printer.objects.subscribe"), 2);
  server_.Push(StatusUpdate({{"toolhead", {{"homed_axes", ""}}}}, 3126.6));
  EXPECT_TRUE(printer_->WaitUntil([](const PrinterState&) { return true; }, "anything", kPatience));
}

TEST_F(MoonrakerPrinterTest, AnEmergencyStopDoesNotQueueBehindAScript) {
  Connect();
  ScriptAnswers({}, /*answered=*/false);
  auto running = std::async(std::launch::async, [&] { return printer_->Run("G28", kPatience); });
  EXPECT_FALSE(server_.WaitForRequest("printer.gcode.script").is_null());
  server_.Handle("printer.emergency_stop", [](const json& request) {
    return std::vector{ResultFor(request, "ok"), Notification("notify_klippy_shutdown")};
  });
  const Result<void> stopped = printer_->EmergencyStop(kPatience);
  EXPECT_TRUE(stopped) << stopped.error().message;
  EXPECT_FALSE(running.get());
}

}  // namespace

}  // namespace trammel::machine
