// The pieces that need no server: addresses, calls, scripts, messages, states, moves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "machine/moonraker/client/move_log.h"
#include "machine/moonraker/client/script_watch.h"
#include "machine/moonraker/client/status.h"
#include "machine/moonraker/link/address.h"
#include "machine/moonraker/link/rpc.h"
#include "machine/moonraker/webcam_list.h"

namespace trammel::machine {
namespace {

using nlohmann::json;
using Kind = RpcAnswer::Kind;

/// Ends of calls, in their order.
struct Ends {
  std::vector<RpcAnswer> answers;
  std::function<void(const RpcAnswer&)> Note() {
    return [this](const RpcAnswer& answer) { answers.push_back(answer); };
  }
};

TEST(RpcCalls, EachCallGetsItsOwnAnswerOnce) {
  RpcCalls calls;
  Ends first, second;
  const auto one = calls.Begin("server.info", nullptr, first.Note());
  const auto two = calls.Begin("printer.info", {{"a", "\xff"}}, second.Note());
  EXPECT_EQ(json::parse(one.text),
            json({{"jsonrpc", "2.0"}, {"method", "server.info"}, {"id", one.id}}));
  EXPECT_EQ(json::parse(two.text)["params"]["a"], "\xef\xbf\xbd");
  for (int i = 0; i < 2; ++i) calls.TakeAnswer({{"id", two.id}, {"result", {{"b", i}}}}, 5);
  EXPECT_TRUE(first.answers.empty());
  ASSERT_EQ(second.answers.size(), 1u);
  EXPECT_EQ(second.answers[0].kind, Kind::kResult);
  EXPECT_EQ(second.answers[0].result["b"], 0);
  EXPECT_EQ(second.answers[0].received_s, 5);
  calls.TakeAnswer({{"id", one.id}, {"error", {{"code", 1e300}, {"message", "no"}}}}, 6);
  ASSERT_EQ(first.answers.size(), 1u);
  EXPECT_EQ(first.answers[0].kind, Kind::kError);
  EXPECT_EQ(first.answers[0].code, 1'000'000);
  EXPECT_EQ(first.answers[0].message, "no");
}

TEST(RpcCalls, AnAnswerIsHandedOnWithoutACopyHoweverLargeItIs) {
  RpcCalls calls;
  RpcAnswer got;
  const auto call =
      calls.Begin("server.info", nullptr, [&got](RpcAnswer answer) { got = std::move(answer); });
  json message = {{"id", call.id}, {"result", {1, 2, 3}}};
  const json* const first = &message["result"][0];
  calls.TakeAnswer(std::move(message), 0);
  ASSERT_EQ(got.result.size(), 3u);
  EXPECT_EQ(&got.result[0], first);
}

TEST(RpcCalls, AnAnswerToNobodyIsLeftOut) {
  RpcCalls calls;
  Ends ends;
  const auto call = calls.Begin("server.info", nullptr, ends.Note());
  for (const json& id : {json(call.id + 1), json(), json("1"), json(0.5), json::object()}) {
    calls.TakeAnswer({{"id", id}, {"result", "ok"}}, 0);
  }
  calls.TakeAnswer({{"result", "ok"}}, 0);
  EXPECT_TRUE(ends.answers.empty());
  calls.TakeAnswer({{"id", call.id}, {"error", 7}}, 0);
  ASSERT_EQ(ends.answers.size(), 1u);
  EXPECT_EQ(ends.answers[0].kind, Kind::kError);
}

TEST(RpcCalls, EveryCallEndsWithItsLinkAndNoneTwice) {
  RpcCalls calls;
  Ends ends;
  const auto unsent = calls.Begin("a", nullptr, ends.Note());
  calls.NotSent(unsent.id, "there is no link");
  calls.NotSent(unsent.id, "there is no link");
  // What one call's end begins anew waits for the next link.
  (void)calls.Begin("b", nullptr, [&](const RpcAnswer& answer) {
    ends.answers.push_back(answer);
    (void)calls.Begin("c", nullptr, ends.Note());
  });
  calls.Lose("the cable was pulled");
  ASSERT_EQ(ends.answers.size(), 2u);
  EXPECT_EQ(ends.answers[0].kind, Kind::kNotSent);
  EXPECT_EQ(ends.answers[1].kind, Kind::kLost);
  EXPECT_EQ(ends.answers[1].message, "the cable was pulled");
  calls.Lose("once more");
  EXPECT_EQ(ends.answers.size(), 3u);
}

}  // namespace

namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

TEST(MoonrakerAddress, UnderstandsWhatPeopleWrite) {
  const auto url = [](const char* text) {
    const auto address = ParseMoonrakerAddress(text);
    return address ? address->WebSocketUrl() : address.error().message;
  };
  EXPECT_EQ(url("voron.local"), "ws://voron.local:7125/websocket");
  EXPECT_EQ(url("192.168.1.20:7126"), "ws://192.168.1.20:7126/websocket");
  EXPECT_EQ(url("[::1]"), "ws://[::1]:7125/websocket");
  EXPECT_EQ(url("[fd00::7]:80"), "ws://[fd00::7]:80/websocket");
  EXPECT_EQ(url("http://mainsail.local/"), "ws://mainsail.local:80/websocket");
  EXPECT_EQ(url("https://farm.example/voron"), "wss://farm.example:443/voron/websocket");
  EXPECT_EQ(url("ws://h:7125/websocket"), "ws://h:7125/websocket");
  EXPECT_EQ(url("unix:/run/moonraker.sock"), "unix:/run/moonraker.sock");
  EXPECT_EQ(ParseMoonrakerAddress("wss://h/a/websocket")->HttpUrl(), "https://h:443/a");
}

TEST(MoonrakerAddress, RefusesWhatIsNone) {
  for (const char* text :
       {"", " ", "h:", "h:x", "h:0", "h:65536", ":7125", "[::1", "ftp://h", "://h",
        "unix:", "unix:x", "h\r\nX: y", "[[[]", "a]b", "user@h", "ws://h/?a", "http://"}) {
    EXPECT_FALSE(ParseMoonrakerAddress(text)) << text;
  }
  EXPECT_FALSE(ParseMoonrakerAddress("unix:/" + std::string(200, 'a')));
  EXPECT_FALSE(ParseMoonrakerAddress(std::string(5000, 'a')));
}

TEST(ScriptWatch, FindsTheCommandsOfAScript) {
  EXPECT_THAT(CommandsOf("g28 ; home\n\n; nothing\n  LASER_ON\tPOWER=1\r\nM400"),
              ElementsAre("G28", "LASER_ON", "M400"));
  EXPECT_THAT(CommandsOf(""), IsEmpty());
}

TEST(ScriptWatch, BlamesTheLineThatTheComplaintIsAbout) {
  const std::string script =
      "G90\nM83\nG1 X10 Y50 Z0.3 F6000 ; start\nG1 X20 E1\nSET_PRESSURE_ADVANCE ADVANCE=-1\n"
      "G1 X-50\nM400";
  EXPECT_EQ(BlamedLine(script, "Move out of range: -50.000 50.000 0.300 [1.000]"),
            "line 6, 'G1 X-50'");
  EXPECT_EQ(BlamedLine(script, "Must home axis first: 10.000 50.000 0.300 [0.000]"),
            "line 3, 'G1 X10 Y50 Z0.3 F6000'");
  EXPECT_EQ(BlamedLine(script, "Extrude below minimum temp"), "line 4, 'G1 X20 E1'");
  EXPECT_EQ(BlamedLine(script,
                       "Error on 'SET_PRESSURE_ADVANCE ADVANCE=-1': ADVANCE must have "
                       "minimum of 0.0"),
            "line 5, 'SET_PRESSURE_ADVANCE ADVANCE=-1'");
  EXPECT_EQ(BlamedLine(script, "Something else"), "one of its 7 lines, from 'G90' to 'M400'");
  EXPECT_EQ(BlamedLine("G28", "Something else"), "line 1, 'G28'");
  EXPECT_EQ(BlamedLine("", "Something"), "a script without commands");
  EXPECT_THAT(BlamedLine("G91\nG1 X5\nG1 X5", "Move out of range: 5 5 5"), HasSubstr("3 lines"));
  EXPECT_THAT(BlamedLine("G1 X5\nG1 X6", "Move out of range:"), HasSubstr("2 lines"));
}

TEST(ScriptWatch, TellsOwnUnknownCommandsFromOthers) {
  const std::string unknown = "// Unknown command:\"LASER_OFF\"";
  ScriptWatch own("M400\nlaser_off", std::set<std::string>{});
  own.OnResponse(unknown);
  EXPECT_THAT(own.Verdict(), AllOf(HasSubstr("line 2"), HasSubstr("went on without it")));
  ScriptWatch others("M400", std::set<std::string>{"LASER_ON"});
  others.OnResponse(unknown);
  EXPECT_EQ(others.Verdict(), "");
  ScriptWatch macro("laser_on", std::set<std::string>{"LASER_ON"});
  macro.OnResponse(unknown);
  EXPECT_THAT(macro.Verdict(), HasSubstr("a macro called by this script"));
  ScriptWatch not_known("M400", std::nullopt);
  not_known.OnResponse(unknown);
  EXPECT_THAT(not_known.Verdict(), Not(IsEmpty()));
}

TEST(ScriptWatch, TakesTheFirstErrorAndIgnoresInformation) {
  ScriptWatch watch("G28\nG1 X5", std::set<std::string>{});
  for (const char* line : {"// Klipper state: Ready", "B:60.0 /60.0 T0:210.1 /210.0", "echo: !!",
                           "", "!", "// Unknown command:", "ok"}) {
    watch.OnResponse(line);
    EXPECT_FALSE(watch.complained()) << line;
  }
  EXPECT_EQ(watch.Verdict(), "");
  watch.OnResponse("!! first");
  watch.OnResponse("!! second");
  EXPECT_THAT(watch.Verdict(), AllOf(HasSubstr("first"), Not(HasSubstr("second"))));
}

TEST(MessageLog, KeepsTheLastMessagesShortAndWithoutSecrets) {
  MessageLog log(3);
  log.Add(MessageDirection::kOut, "first");
  log.Add(MessageDirection::kOut, R"({"api_key":"s3cret","id":1})");
  log.Add(MessageDirection::kIn, "a\nb\x01" + std::string(5000, 'x'));
  log.Add(MessageDirection::kIn, R"({"method":"notify_status_update"})");
  const std::vector<std::string> all = log.All();
  ASSERT_EQ(all.size(), 3);
  EXPECT_THAT(all[0], AllOf(HasSubstr("> {\"api_key\":\"…\""), Not(HasSubstr("s3cret"))));
  EXPECT_THAT(all[1], HasSubstr("< a b x"));
  EXPECT_LT(all[1].size(), 400);
  EXPECT_THAT(log.Excerpt(5), Not(HasSubstr("notify_status_update")));
  EXPECT_EQ(MessageLog().Excerpt(5), "");
}

TEST(MessageLog, KeepsNoKeyThatAServerAnswersWith) {
  MessageLog log;
  log.Add(MessageDirection::kIn, R"({"jsonrpc":"2.0","result":"s3cret0123456789","id":4})");
  log.Add(MessageDirection::kIn, R"({"result":{"token":"s3cret","refresh_token":"s3cret"}})");
  log.Add(MessageDirection::kOut, R"({"params": {"password" : "a\"s3cret\\", "user": "me"}})");
  log.Add(MessageDirection::kIn, R"({"stream_url": "http://me:s3cret@camera/stream"})");
  log.Add(MessageDirection::kIn, R"({"jsonrpc":"2.0","result":"ok","id":5})");
  EXPECT_THAT(log.Excerpt(5), AllOf(Not(HasSubstr("s3cret")), HasSubstr("\"result\":\"ok\"")));
}

TEST(MessageLog, CutsBetweenCharacters) {
  MessageLog log;
  for (std::size_t length = 290; length < 305; ++length) {
    log.Add(MessageDirection::kIn, std::string(length, 'x') + "°°°°");
  }
  for (const std::string& message : log.All()) {
    EXPECT_TRUE(json::parse(json(message).dump(), nullptr, false).is_string());
  }
}

TEST(MoonrakerStatus, AsksOnlyForWhatThePrinterHas) {
  const json wanted = WantedObjects({"toolhead", "extruder1", "output_pin LASER", "mcu"});
  EXPECT_EQ(wanted.size(), 4);
  EXPECT_TRUE(wanted.contains("webhooks"));
  EXPECT_FALSE(wanted.contains("mcu"));
  EXPECT_EQ(wanted["output_pin LASER"], json::array({"value"}));
}

TEST(MoonrakerStatus, PressureAdvanceIsTheActiveExtruders) {
  const json status = {{"webhooks", {{"state", "ready"}}},
                       {"toolhead", {{"extruder", "extruder1"}}},
                       {"extruder", {{"pressure_advance", 0.02}}},
                       {"extruder1", {{"pressure_advance", 0.05}, {"temperature", 200.0}}},
                       {"neopixel case", {{"color_data", {{1.0, 0.5, 0.0, 0.25}}}}}};
  const PrinterState state = ReadStatus(status, 7);
  EXPECT_EQ(state.readiness, PrinterReadiness::kReady);
  EXPECT_EQ(ActiveAdvance_s(state), 0.05);
  EXPECT_EQ(state.heaters.size(), 1);
  EXPECT_THAT(state.lights.at("neopixel case").at(0), ElementsAre(1.0, 0.5, 0.0, 0.25));
  EXPECT_EQ(state.eventtime_s, 7);
}

TEST(MoonrakerStatus, PressureAdvanceIsOfEveryMotorThatPushesFilament) {
  const json status = {
      {"webhooks", {{"state", "ready"}}},
      {"toolhead", {{"extruder", "extruder2"}}},
      {"extruder", {{"pressure_advance", 0.02}, {"smooth_time", 0.04}, {"motion_queue", nullptr}}},
      {"extruder1", {{"pressure_advance", 0.05}, {"motion_queue", "extruder"}}},
      {"extruder2", {{"temperature", 20.0}}},  // its filament is pushed by the motor below
      {"extruder_stepper belted", {{"pressure_advance", 0.03}, {"motion_queue", "extruder2"}}},
      {"extruder_stepper spare", {{"pressure_advance", 0.0}, {"motion_queue", nullptr}}}};
  const PrinterState state = ReadStatus(status, 0);
  const std::map<std::string, PressureAdvance> motors = {
      {"extruder", {0.02, 0.04, "extruder"}},
      {"extruder1", {0.05, {}, "extruder"}},
      {"extruder_stepper belted", {0.03, {}, "extruder2"}},
      {"extruder_stepper spare", {0.0, {}, ""}}};
  EXPECT_EQ(state.pressure_advance, motors);
  EXPECT_EQ(ActiveAdvance_s(state), std::nullopt);
  EXPECT_EQ(state.heaters.size(), 1);
  EXPECT_EQ(NameInGcode("extruder_stepper belted"), "belted");
  const json wanted = WantedObjects({"extruder_stepper belted", "extruder"});
  EXPECT_TRUE(wanted.contains("extruder_stepper belted"));
}

TEST(MoonrakerStatus, AnOldKlippersAccelerationToDecelerateIsACruiseRatio) {
  const auto ratio = [](const json& toolhead) {
    return ReadStatus({{"toolhead", toolhead}}, 0).limits.minimum_cruise_ratio;
  };
  EXPECT_EQ(ratio({{"max_accel", 3000.0}, {"max_accel_to_decel", 750.0}}), 0.75);
  EXPECT_EQ(ratio({{"max_accel", 3000.0}, {"max_accel_to_decel", 9000.0}}), 0.0);
  EXPECT_EQ(
      ratio({{"max_accel", 3000.0}, {"max_accel_to_decel", 750.0}, {"minimum_cruise_ratio", 0.5}}),
      0.5);
  EXPECT_EQ(ratio({{"max_accel", 3000.0}}), std::nullopt);
}

TEST(MoonrakerStatus, NothingKnownIsNotReady) {
  for (const json& nothing : {json(), json::object(), json::array({1}), json("x")}) {
    const PrinterState state = ReadStatus(nothing, 0);
    EXPECT_EQ(state.readiness, PrinterReadiness::kDisconnected);
    EXPECT_FALSE(ActiveAdvance_s(state));
    EXPECT_THAT(state.heaters, IsEmpty());
  }
}

TEST(MoonrakerStatus, UpdatesOfAnotherFormAreIgnored) {
  const json wanted = WantedObjects({"extruder"});
  json known = {{"extruder", {{"temperature", 20.0}, {"target", 0.0}}}};
  MergeStatus(known, {{"extruder", {{"target", 210.0}}}}, wanted);
  MergeStatus(known, {{"extruder", 5}}, wanted);
  MergeStatus(known, json::array({1}), wanted);
  MergeStatus(known, nullptr, wanted);
  EXPECT_EQ(known["extruder"], (json{{"temperature", 20.0}, {"target", 210.0}}));
}

TEST(MoonrakerStatus, WhatIsKnownDoesNotGrowWithWhatAServerSendsUnasked) {
  const json wanted = WantedObjects({"extruder", "toolhead", "neopixel case"});
  json known = json::object();
  for (int i = 0; i < 1000; ++i) {
    const std::string odd = std::to_string(i);
    const std::size_t length = i % 100 == 0 ? 100'000 : 2002;  // 2001 would be kept
    MergeStatus(known,
                {{"heater_generic " + odd, {{"temperature", 1.0}}},
                 {"extruder", {{"temperature", 1.0 * i}, {"field " + odd, odd}}},
                 {"webhooks", {{"state", "ready"}, {"field " + odd, odd}}},
                 {"toolhead", {{"position", std::vector<double>(length, 1.0)}}},
                 {"neopixel case", {{"color_data", json::parse("[[[[1]]]]")}}}},
                wanted);
  }
  EXPECT_EQ(known, (json{{"extruder", {{"temperature", 999.0}}},
                         {"webhooks", {{"state", "ready"}}},
                         {"toolhead", {{"position", nullptr}}},
                         {"neopixel case", {{"color_data", nullptr}}}}));
}

TEST(MoonrakerStatus, AFieldHoldsNoMoreInAllThanAPrintersDo) {
  const json wanted = WantedObjects({"neopixel case"});
  const auto known_of = [&wanted](const json& color_data) {
    json known = json::object();
    MergeStatus(known, {{"neopixel case", {{"color_data", color_data}}}}, wanted);
    return known["neopixel case"]["color_data"];
  };
  // Lists of lists, each of them within its own bound.
  const json many = std::vector<std::vector<double>>(1000, std::vector<double>(1000, 1.0));
  EXPECT_TRUE(known_of(many).is_null());
  const json chain = std::vector<std::vector<double>>(2000, std::vector<double>(4, 1.0));
  EXPECT_EQ(known_of(chain), chain);
}

TEST(MoonrakerStatus, AbsurdFiguresAreTheServersFaultByFieldAndValue) {
  const json status = {
      {"toolhead", {{"extruder", "extruder"}, {"position", {1.0, 2.0, 3.0, 1e6}}}},
      {"extruder", {{"temperature", 20.0}, {"target", 0.0}, {"pressure_advance", 0.04}}},
      {"gcode_move", {{"speed", 1500.0}, {"extrude_factor", 0.95}}},
      {"output_pin LASER", {{"value", 0.0}}}};
  std::string fault;
  (void)ReadStatus(status, 0, &fault);
  EXPECT_EQ(fault, "");
  const auto fault_with = [&](const char* object, const char* field, const json& value) {
    json odd = status;
    odd[object][field] = value;
    const PrinterState state = ReadStatus(odd, 0, &fault);
    EXPECT_LT(std::abs(state.position_mm[2]), 1e6);
    EXPECT_LT(state.limits.max_accel_mm_s2, 1e9);
    EXPECT_LT(ActiveAdvance_s(state).value_or(0), 101);
    return fault;
  };
  EXPECT_EQ(fault_with("toolhead", "max_accel", 1e308),
            "toolhead.max_accel is 1e+308, which lies outside 0 … 1e+08");
  EXPECT_THAT(fault_with("toolhead", "max_velocity", -1.0),
              HasSubstr("toolhead.max_velocity is -1"));
  EXPECT_THAT(fault_with("toolhead", "position", {0.0, 0.0, 1e300, 0.0}),
              HasSubstr("toolhead.position is 1e+300"));
  EXPECT_THAT(fault_with("toolhead", "axis_maximum", {-1e7, 0.0, 0.0}), HasSubstr("axis_maximum"));
  EXPECT_THAT(fault_with("extruder", "target", 1e9), HasSubstr("extruder.target is 1e+09"));
  EXPECT_THAT(fault_with("extruder", "temperature", -1e5), HasSubstr("extruder.temperature"));
  EXPECT_THAT(fault_with("extruder", "pressure_advance", -0.1), HasSubstr("pressure_advance"));
  EXPECT_THAT(fault_with("gcode_move", "speed", -1500.0), HasSubstr("gcode_move.speed"));
  EXPECT_THAT(fault_with("gcode_move", "extrude_factor", 1e300), HasSubstr("extrude_factor"));
  EXPECT_THAT(fault_with("output_pin LASER", "value", 1e6), HasSubstr("output_pin LASER.value"));
  EXPECT_THAT(fault_with("neopixel case", "color_data", {{1.0, 1e9, 0.0, 0.0}}),
              HasSubstr("neopixel case.color_data"));
  EXPECT_THAT(fault_with("toolhead", "extruder", "extruder\nM112"),
              HasSubstr("toolhead.extruder is no name"));
  EXPECT_THAT(fault_with("toolhead", "homed_axes", std::string(1000, 'x')),
              HasSubstr("homed_axes is no name (1000 bytes"));
}

TEST(MoonrakerStatus, NoPrinterHasHundredsOfHeatersNorNamesOfSeveralLines) {
  std::vector<std::string> available = {"heater_generic a\nM104 S300", std::string(5000, 'x')};
  json status = json::object();
  for (int i = 0; i < 100'000; ++i) available.push_back("heater_generic " + std::to_string(i));
  const json wanted = WantedObjects(available);
  EXPECT_LT(wanted.size(), 2000);
  EXPECT_FALSE(wanted.contains(available.front()));
  for (const auto& [name, fields] : wanted.items()) status[name] = {{"temperature", 20.0}};
  std::string fault;
  const PrinterState state = ReadStatus(status, 0, &fault);
  EXPECT_LE(state.heaters.size(), 100);
  EXPECT_EQ(fault, "it tells of more than 100 heaters");
}

TEST(MoonrakerStatus, LongTextsAreCutBetweenCharacters) {
  std::string words(1999, 'x');
  for (int i = 0; i < 1000; ++i) words += "°";
  const PrinterState state = ReadStatus({{"print_stats", {{"message", words}}}}, 0);
  EXPECT_EQ(state.print_message, std::string(1999, 'x') + "…");
}

TEST(MoveLog, KeepsTheNewestAndFindsThoseThatOverlap) {
  MoveLog log(3);
  json rows = json::array();
  for (int i = 0; i < 5; ++i) {
    rows.push_back({1.0 * i, 1.0, 10.0, 0.0, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}});
  }
  log.Add({{"data", rows}});
  EXPECT_EQ(log.Overlapping(0, 100).size(), 3);
  EXPECT_EQ(log.Overlapping(3.2, 3.4).size(), 1);
  EXPECT_EQ(log.Overlapping(5.5, 9).size(), 0);
  EXPECT_TRUE(log.Reaches(4));
  EXPECT_FALSE(log.Reaches(4.1));
}

TEST(MoveLog, AMoveThatIsToldTwiceIsKeptOnce) {
  const auto row = [](double time_s, double duration_s) {
    return json{time_s, duration_s, 10.0, 0.0, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}};
  };
  MoveLog log;
  for (int subscription = 0; subscription < 3; ++subscription) {
    log.Add({{"data", {row(1, 1), row(2, 1)}}});
  }
  log.Add({{"data", {row(4, 1), row(2, 0.5), row(3, 1)}}});  // late, and one cut short meanwhile
  const auto moves = log.Overlapping(0, 100);
  ASSERT_EQ(moves.size(), 4);
  EXPECT_EQ(moves[1].duration_s, 0.5);
  EXPECT_EQ(moves[2].print_time_s, 3);
  EXPECT_EQ(moves[3].print_time_s, 4);
}

TEST(MoveLog, MovesThatNoPrinterMakesAreSkipped) {
  MoveLog log;
  for (int i = 0; i < 4; ++i) {
    json row = {1.0, 1.0, 10.0, 0.0, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}};
    row[i] = 1e308;
    log.Add({{"data", {row}}});
  }
  log.Add({{"data", {{1.0, 1.0, 10.0, 0.0, {0.0, 1e300, 0.0}, {1.0, 0.0, 0.0}}}}});
  EXPECT_TRUE(log.Overlapping(-1e300, 1e300).empty());
}

TEST(WebcamList, AnAddressOfAnotherHostKeepsIt) {
  const json answer = {{"webcams", {{{"name", "a"}, {"stream_url", "//cam.local:8080/stream"}}}}};
  const auto url = [&](const char* address) {
    return ReadWebcams(answer, *ParseMoonrakerAddress(address)).at(0).stream_url;
  };
  EXPECT_EQ(url("voron.local"), "http://cam.local:8080/stream");
  EXPECT_EQ(url("https://farm.example/v"), "https://cam.local:8080/stream");
  EXPECT_EQ(url("unix:/run/m.sock"), "http://cam.local:8080/stream");
}

TEST(WebcamList, WhatIsNoMjpegStreamIsPassedOver) {
  const auto webcam = [](const char* name, const char* service, bool enabled = true) {
    Webcam webcam;
    webcam.name = name;
    webcam.service = service;
    webcam.enabled = enabled;
    return webcam;
  };
  for (const char* other :
       {"webrtc-camerastreamer", "webrtc-go2rtc", "webrtc-mediamtx", "hlsstream", "jmuxer-stream",
        "iframe", "html-video", "uv4l", "of the future"}) {
    const std::vector<Webcam> webcams = {
        webcam("first", other), webcam("off", "mjpegstreamer", false),
        webcam("second", "mjpegstreamer-adaptive"), webcam("third", "mjpegstreamer")};
    EXPECT_EQ(ChooseWebcam(webcams, "")->name, "second") << other;
    EXPECT_EQ(ChooseWebcam(webcams, "third")->name, "third");
    for (const std::string name : {"", "first"}) {
      const auto none = ChooseWebcam({webcams[0], webcams[1]}, name);
      ASSERT_FALSE(none) << other;
      EXPECT_THAT(none.error().message,
                  AllOf(HasSubstr(std::string("first as ") + other), HasSubstr("[camera] url")));
    }
  }
  EXPECT_EQ(ChooseWebcam({webcam("old", "")}, "")->name, "old");
  EXPECT_THAT(ChooseWebcam({webcam("a", "")}, "b").error().message, HasSubstr("named b"));
}

TEST(WebcamList, RelativeAddressesAreTheWebInterfaces) {
  const json answer = {{"webcams", {{{"name", "a"}, {"stream_url", "webcam/?action=stream"}}}}};
  const auto url = [&](const char* address) {
    return ReadWebcams(answer, *ParseMoonrakerAddress(address)).at(0).stream_url;
  };
  EXPECT_EQ(url("voron.local"), "http://voron.local:80/webcam/?action=stream");
  EXPECT_EQ(url("https://farm.example/v"), "https://farm.example:443/v/webcam/?action=stream");
  EXPECT_EQ(url("ws://farm/printer2/websocket"), "http://farm:80/printer2/webcam/?action=stream");
  EXPECT_EQ(url("unix:/run/m.sock"), "http://localhost/webcam/?action=stream");
  const json root = {{"webcams", {{{"name", "a"}, {"stream_url", "/cam2/?action=stream"}}}}};
  EXPECT_EQ(ReadWebcams(root, *ParseMoonrakerAddress("http://farm/printer2")).at(0).stream_url,
            "http://farm:80/cam2/?action=stream");
  for (const json& odd : {json(), json{{"webcams", 3}}, json{{"webcams", {nullptr, 4, {"x"}}}}}) {
    EXPECT_THAT(ReadWebcams(odd, *ParseMoonrakerAddress("h")), IsEmpty());
  }
}

}  // namespace

}  // namespace trammel::machine
