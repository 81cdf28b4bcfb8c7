// States, files, clocks and hostile messages of a printer behind Moonraker, over real
// sockets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "base/bug_note.h"
#include "base/check.h"
#include "machine/moonraker/moonraker_test_support.h"
#include "machine/net/host_clock.h"
#include "support/matchers.h"

namespace trammel::machine {
namespace {

using nlohmann::json;
using test::Notification;
using test::ResultFor;
using test::StatusUpdate;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(MoonrakerPrinterTest, AnAnswerDoesNotUndoTheUpdateThatCameRightAfterIt) {
  constexpr int kTimes = 50;  // the two were taken in the wrong order about every second time
  Connect();
  for (int i = 1; i <= kTimes; ++i) {
    const auto nozzle = [](double temperature_c) {
      return json{{"extruder", {{"temperature", temperature_c}}}};
    };
    server_.Handle("printer.objects.query", [=](const json& request) {
      return std::vector{ResultFor(request, {{"eventtime", 3050.0 + i}, {"status", nozzle(20)}}),
                         StatusUpdate(nozzle(200 + i), 3050.5 + i)};
    });
    ASSERT_TRUE(printer_->WaitUntil(
        [=](const PrinterState& now) {
          return now.heaters.at("extruder").temperature_c == 200 + i;
        },
        "the update", {.time_limit_s = 2}));
  }
}

TEST_F(MoonrakerPrinterTest, WaitsForAStateAndNamesItWhenItDoesNotCome) {
  Connect();
  const auto hot = [](const PrinterState& state) {
    return state.heaters.at("extruder").temperature_c > 200;
  };
  constexpr double kRest_s = 0.0999999812;  // remaining time of a limit, by a clock
  Result<PrinterState> state =
      printer_->WaitUntil(hot, "the nozzle to reach 200 °C", {.time_limit_s = kRest_s});
  ASSERT_THAT(state, FailsWith("0.1 s in vain for the nozzle to reach 200 °C"));
  auto waiting = std::async(std::launch::async, [&] {
    return printer_->WaitUntil(hot, "the nozzle to reach 200 °C", kPatience);
  });
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.query", 2).is_null());
  server_.Push(StatusUpdate({{"extruder", {{"temperature", 201.0}}}}, 3049.0));
  state = waiting.get();
  ASSERT_TRUE(state) << state.error().message;
  EXPECT_EQ(state->heaters.at("extruder").temperature_c, 201.0);
}

TEST_F(MoonrakerPrinterTest, WaitingEndsEarlyWithThePrinterAndNamesTheRemedy) {
  Connect();
  const auto wait = [&] {
    return std::async(std::launch::async, [&] {
      return printer_->WaitUntil([](const PrinterState&) { return false; }, "the moon", kPatience);
    });
  };
  auto waiting = wait();
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.query").is_null());
  server_.Push(Notification("notify_klippy_shutdown"));
  EXPECT_THAT(waiting.get(), FailsWith("'shutdown'", "the moon"));
  server_.Push(Notification("notify_klippy_ready"));
  ASSERT_TRUE(printer_->WaitUntilReady(kPatience));
  const int asked = server_.CountRequests("printer.objects.query");
  waiting = wait();
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.query", asked + 1).is_null());
  server_.BreakConnections();
  EXPECT_THAT(waiting.get(), FailsWith("'disconnected'", "when Moonraker and Klipper are back",
                                       Not(HasSubstr("FIRMWARE_RESTART"))));
}

TEST_F(MoonrakerPrinterTest, NonsenseDropsTheLinkWhichComesBack) {
  constexpr int kLevels = 1'000'000;
  const std::string deep = R"({"method":"notify_other","params":)" + std::string(kLevels, '[') +
                           std::string(kLevels, ']') + "}";
  for (const std::string& nonsense : {std::string(R"({"jsonrpc":)"), std::string("[1,2,3]"),
                                      std::string("null"), std::string("{}}"), deep}) {
    const int before = server_.CountRequests("server.connection.identify");
    Connect();
    server_.PushBytes(nonsense);
    EXPECT_FALSE(server_.WaitForRequest("server.connection.identify", before + 2).is_null())
        << nonsense.substr(0, 20);
    EXPECT_TRUE(printer_->WaitUntilReady(kPatience));
  }
}

TEST_F(MoonrakerPrinterTest, AFilesNameThatIsNoUtf8CostsItsBytesAlone) {
  Connect();
  std::promise<json> said;
  ASSERT_TRUE(printer_->RegisterRemoteMethod(
      "call", [&](const json& params) { said.set_value(params); }, kPatience));
  // Python's JSON: lone surrogates become U+FFFD; pairs, other escapes and other text stay.
  server_.PushBytes(R"({"jsonrpc":"2.0","method":"call","params":)"
                    R"(["// \udcff\udc80.jpg \ud83d\ude00 \\\\udcff \ud83d.\u00e4"]})");
  EXPECT_EQ(said.get_future().get(),
            json::array({"// \uFFFD\uFFFD.jpg \U0001F600 \\\\udcff \uFFFD.\u00e4"}));
}

TEST_F(MoonrakerPrinterTest, AbsurdFiguresAreAnErrorAndNoState) {
  Connect();
  server_.Handle("printer.objects.query", [](const json& request) {
    return std::vector{ResultFor(
        request,
        {{"eventtime", 3050.0},
         {"status", {{"toolhead", {{"max_accel", 1e308}, {"position", {0.0, 0.0, 5.0, 0.0}}}}}}})};
  });
  EXPECT_THAT(printer_->State(kPatience), FailsWith("toolhead.max_accel is 1e+308"));
  EXPECT_EQ(printer_->LastState().readiness, PrinterReadiness::kError);
  EXPECT_THAT(printer_->WaitUntil([](const PrinterState&) { return true; }, "anything", kPatience),
              FailsWith("toolhead.max_accel is 1e+308"));
  server_.Answer("printer.objects.query",
                 {{"eventtime", 3051.0}, {"status", {{"toolhead", {{"max_accel", 5000.0}}}}}});
  EXPECT_TRUE(printer_->State(kPatience)) << "a value that is right again is believed";
}

TEST_F(MoonrakerPrinterTest, MacrosCanCallUsAlsoAfterAReconnect) {
  Connect();
  std::promise<json> first;
  std::promise<json> second;
  int calls = 0;
  Must(printer_->RegisterRemoteMethod(
      "trammel_calibrate",
      [&](const json& params) { (calls++ == 0 ? first : second).set_value(params); }, kPatience));
  const json call = {{"jsonrpc", "2.0"},
                     {"method", "trammel_calibrate"},
                     {"params", {{"what", "start"}, {"t", 1.5}}}};
  server_.Push(call);
  EXPECT_EQ(first.get_future().get()["what"], "start");
  server_.BreakConnections();
  EXPECT_EQ(server_.WaitForRequest("connection.register_remote_method", 2)["params"],
            (json{{"method_name", "trammel_calibrate"}}));
  server_.Push(call);
  EXPECT_EQ(second.get_future().get()["t"], 1.5);
}

TEST_F(MoonrakerPrinterTest, ACallerThatWaitsForAnAnswerGetsOne) {
  Connect();
  int calls = 0;
  ASSERT_TRUE(printer_->RegisterRemoteMethod(
      "trammel_calibrate", [&](const json&) { ++calls; }, kPatience));
  const auto ask = [&](const json& id, const std::string& method) {
    server_.Push({{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", {{"a", 1}}}});
  };
  ask(7, "trammel_calibrate");
  EXPECT_EQ(server_.WaitForAnswer(7), (json{{"jsonrpc", "2.0"}, {"id", 7}, {"result", "ok"}}));
  EXPECT_EQ(calls, 1);
  ask("x8", "shut_everything_down");
  const json refused = server_.WaitForAnswer("x8");
  EXPECT_EQ(refused["error"]["code"], -32601);
  EXPECT_THAT(refused["error"]["message"].get<std::string>(), HasSubstr("shut_everything_down"));
  ask(nullptr, std::string(5000, 'x'));
  EXPECT_EQ(server_.WaitForAnswer(nullptr)["error"]["code"], -32601);
}

TEST_F(MoonrakerPrinterTest, ARequestOfAnotherClientGetsTheHandlersResultOrError) {
  Connect();
  printer_->OnRequest([](const std::string& method, const json& params) {
    if (method == "status") return RpcAnswer{.result = {{"asked", params}}};
    return RpcAnswer::UnknownMethod(method);
  });
  server_.Push({{"jsonrpc", "2.0"}, {"id", 1}, {"method", "status"}, {"params", {{"a", 1}}}});
  EXPECT_EQ(server_.WaitForAnswer(1)["result"], (json{{"asked", {{"a", 1}}}}));
  // Moonraker leaves empty arguments out.
  server_.Push({{"jsonrpc", "2.0"}, {"id", 2}, {"method", "status"}});
  EXPECT_EQ(server_.WaitForAnswer(2)["result"], (json{{"asked", json::object()}}));
  server_.Push({{"jsonrpc", "2.0"}, {"id", 3}, {"method", "a strange one"}});
  EXPECT_EQ(server_.WaitForAnswer(3)["error"]["code"], -32601);
  printer_->OnRequest({});
  server_.Push({{"jsonrpc", "2.0"}, {"id", 4}, {"method", "status"}});
  EXPECT_EQ(server_.WaitForAnswer(4)["error"]["code"], -32601);
}

TEST_F(MoonrakerPrinterTest, ARequestDoesNotPassForTheServersOwnNotification) {
  Connect();
  json sent = Notification("notify_klippy_shutdown");
  sent["id"] = 9;
  server_.Push(sent);
  EXPECT_EQ(server_.WaitForAnswer(9)["error"]["code"], -32601);
  EXPECT_EQ(printer_->LastState().readiness, PrinterReadiness::kReady);
}

TEST_F(MoonrakerPrinterTest, ABugOnTheConnectionsThreadEndsTheLinkAndNotTheProcess) {
  Connect();
  ASSERT_TRUE(printer_->RegisterRemoteMethod(
      "trammel_calibrate", [](const json&) { throw Bug("one is not two"); }, kPatience));
  server_.Handle("server.webcams.list", [](const json&) { return std::vector<json>(); });
  auto waiting = std::async(std::launch::async, [&] { return printer_->Webcams(kPatience); });
  EXPECT_FALSE(server_.WaitForRequest("server.webcams.list").is_null());
  server_.Push({{"jsonrpc", "2.0"}, {"method", "trammel_calibrate"}, {"params", json::object()}});
  EXPECT_THAT(waiting.get(), FailsWith("a bug in trammel", "one is not two"));
  EXPECT_TRUE(NotedBug());
  EXPECT_TRUE(printer_->WaitUntilReady(kPatience)) << "the link comes back";
}

TEST_F(MoonrakerPrinterTest, KnowsCommandsFromTheFirmwaresListOrFromItsHelp) {
  Connect();
  server_.Handle("printer.objects.query", [](const json& request) {
    return std::vector{ResultFor(
        request,
        {{"eventtime", 1.0}, {"status", {{"gcode", {{"commands", {{"G1", json::object()}}}}}}}})};
  });
  EXPECT_TRUE(printer_->HasCommand("g1", kPatience).value());
  EXPECT_FALSE(printer_->HasCommand("LASER_ON", kPatience).value());
  server_.Answer("printer.objects.query",
                 {{"eventtime", 1.0}, {"status", {{"gcode", json::object()}}}});
  server_.Answer("printer.gcode.help", {{"SET_PIN", "Set the value of an output pin"}});
  EXPECT_TRUE(printer_->HasCommand("LASER_ON", kPatience).value());
  EXPECT_TRUE(printer_->HasCommand("set_pin", kPatience).value());
  EXPECT_FALSE(printer_->HasCommand("LASER_OFF", kPatience).value());
}

TEST_F(MoonrakerPrinterTest, UploadsWithAChecksumAndStartsThePrint) {
  Connect({.api_key = "key"});
  test::HttpRequest seen;
  server_.HandleHttp([&](const test::HttpRequest& request) {
    seen = request;
    return test::HttpAnswer{201, R"({"item": {"path": "trammel/a.gcode"}})"};
  });
  Must(printer_->Upload("trammel/a.gcode", "G28\n", kPatience));
  EXPECT_EQ(seen.method, "POST");
  EXPECT_EQ(seen.target, "/server/files/upload");
  EXPECT_EQ(seen.api_key, "key");
  EXPECT_THAT(seen.content_type, HasSubstr("multipart/form-data; boundary="));
  // The last is the sha256sum of "G28\n".
  EXPECT_THAT(seen.body,
              Containing("name=\"root\"\r\n\r\ngcodes\r\n", "name=\"path\"\r\n\r\ntrammel\r\n",
                         "filename=\"a.gcode\"", "\r\n\r\nG28\n\r\n--",
                         "8080cd1d636d28b227689516fdadfd2aaed94e57b113db13523a38b51d0d09e9"));
  ASSERT_TRUE(printer_->UploadConfig("trammel/a.png", "png", kPatience));
  EXPECT_THAT(seen.body, Containing("name=\"root\"\r\n\r\nconfig\r\n",
                                    "name=\"path\"\r\n\r\ntrammel\r\n", "filename=\"a.png\""));
  server_.Answer("printer.print.start", "ok");
  EXPECT_TRUE(printer_->StartPrint("trammel/a.gcode", kPatience));
  EXPECT_EQ(server_.WaitForRequest("printer.print.start")["params"],
            (json{{"filename", "trammel/a.gcode"}}));
}

TEST_F(MoonrakerPrinterTest, RefusedUploadsSayWhy) {
  Connect();
  const auto error = [&](int status, const std::string& body) {
    server_.HandleHttp([=](const test::HttpRequest&) { return test::HttpAnswer{status, body}; });
    const Result<void> uploaded = printer_->Upload("a.gcode", "G28", kPatience);
    return uploaded ? "" : uploaded.error().message;
  };
  EXPECT_THAT(error(422, R"({"error": {"message": "File checksum mismatch"}})"),
              Containing("arrived damaged", "File checksum mismatch"));
  EXPECT_THAT(error(401, R"({"error": {"message": "Unauthorized"}})"), HasSubstr("an API key"));
  EXPECT_THAT(error(413, "<html>"), HasSubstr("too large"));
  EXPECT_THAT(error(500, R"({"error": {"message": "No space left"}})"), HasSubstr("No space left"));
  for (const char* name : {"", "/etc/x", "../x", "a\"b", "a\r\nb", "a/"}) {
    EXPECT_THAT(printer_->Upload(name, "G28", kPatience), FailsWith(ErrorKind::kInput)) << name;
  }
}

TEST_F(MoonrakerPrinterTest, RelatesTheClocksFromMessages) {
  Connect();
  const double host_s = HostNow();
  const auto toolhead = [host_s] {
    return json{{"toolhead", {{"estimated_print_time", 87.5 + HostNow() - host_s}}}};
  };
  const auto eventtime_s = [host_s] { return 3045.4 + HostNow() - host_s; };
  // The clocks are read when the answer is made, between question and answer as on a printer.
  for (const char* method : {"printer.objects.subscribe", "printer.objects.query"}) {
    server_.Handle(method, [=](const json& request) {
      return std::vector{
          ResultFor(request, {{"eventtime", eventtime_s()}, {"status", toolhead()}})};
    });
  }
  // Samples from the connection's start belong to other clocks; after a restart they begin anew.
  server_.Push(Notification("notify_klippy_ready"));
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.subscribe", 2).is_null());
  for (int i = 0; i < 20; ++i) {
    server_.Push(StatusUpdate(toolhead(), eventtime_s()));
    Settle();
  }
  const auto clock = Must(printer_->Clock(1.0, kPatience));
  const double now_s = HostNow();
  EXPECT_NEAR(clock.PrintTimeOf(now_s), 87.5 + now_s - host_s, clock.PrintTimeBound(now_s));
}

}  // namespace

}  // namespace trammel::machine
