// The pieces that need no server: addresses, calls, scripts, messages, states, moves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
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

TEST(RpcCalls, EveryCallEndsWithItsLinkAndNoneTwice) {
  RpcCalls calls;
  Ends ends;
  const auto unsent = calls.Begin("a", nullptr, ends.Note());
  calls.NotSent(unsent.id, "there is no link");
  calls.NotSent(unsent.id, "there is no link");
  // A call begun in another call's callback waits for the next link.
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

using ::testing::AllOf;
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

TEST(ScriptWatch, BlamesTheLineThatTheComplaintQuotes) {
  const std::string script = "G90\nSET_PRESSURE_ADVANCE ADVANCE=-1 ; tried\nM400";
  EXPECT_EQ(BlamedLine(script,
                       "Error on 'SET_PRESSURE_ADVANCE ADVANCE=-1': ADVANCE must have "
                       "minimum of 0.0"),
            "line 2, 'SET_PRESSURE_ADVANCE ADVANCE=-1'");
  EXPECT_EQ(BlamedLine(script, "Something else"), "one of its 3 lines, from 'G90' to 'M400'");
  EXPECT_EQ(BlamedLine("G28", "Something else"), "line 1, 'G28'");
  EXPECT_EQ(BlamedLine("", "Something"), "a script without commands");
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

TEST(MoonrakerStatus, PressureAdvanceIsOfEveryMotorThatPushesFilament) {
  const json status = {
      {"webhooks", {{"state", "ready"}}},
      {"toolhead", {{"extruder", "extruder2"}}},
      {"extruder", {{"pressure_advance", 0.02}, {"smooth_time", 0.04}, {"motion_queue", nullptr}}},
      {"extruder1", {{"pressure_advance", 0.05}, {"motion_queue", "extruder"}}},
      {"extruder2", {{"temperature", 20.0}}},  // fed by the motor below
      {"extruder_stepper belted", {{"pressure_advance", 0.03}, {"motion_queue", "extruder2"}}},
      {"extruder_stepper spare", {{"pressure_advance", 0.0}, {"motion_queue", nullptr}}}};
  const PrinterState state = ReadStatus(status);
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

TEST(MoonrakerStatus, WhatIsKnownDoesNotGrowWithWhatAServerSendsUnasked) {
  const json wanted = WantedObjects({"extruder", "toolhead", "heater_bed"});
  json known = json::object();
  for (int i = 0; i < 1000; ++i) {
    const std::string odd = std::to_string(i);
    const std::size_t length = i % 100 == 0 ? 100'000 : 2002;  // 2001 would be kept
    MergeStatus(known,
                {{"heater_generic " + odd, {{"temperature", 1.0}}},
                 {"extruder", {{"temperature", 1.0 * i}, {"field " + odd, odd}}},
                 {"webhooks", {{"state", "ready"}, {"field " + odd, odd}}},
                 {"toolhead", {{"position", std::vector<double>(length, 1.0)}}},
                 {"heater_bed", {{"target", json::parse("[[[[1]]]]")}}}},
                wanted);
  }
  EXPECT_EQ(known, (json{{"extruder", {{"temperature", 999.0}}},
                         {"webhooks", {{"state", "ready"}}},
                         {"toolhead", {{"position", nullptr}}},
                         {"heater_bed", {{"target", nullptr}}}}));
}

TEST(MoonrakerStatus, AbsurdFiguresAreTheServersFaultByFieldAndValue) {
  const json status = {
      {"toolhead", {{"extruder", "extruder"}, {"position", {1.0, 2.0, 3.0, 1e6}}}},
      {"extruder", {{"temperature", 20.0}, {"target", 0.0}, {"pressure_advance", 0.04}}},
      {"gcode_move", {{"extrude_factor", 0.95}}}};
  std::string fault;
  (void)ReadStatus(status, &fault);
  EXPECT_EQ(fault, "");
  const auto fault_with = [&](const char* object, const char* field, const json& value) {
    json odd = status;
    odd[object][field] = value;
    const PrinterState state = ReadStatus(odd, &fault);
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
  EXPECT_THAT(fault_with("gcode_move", "extrude_factor", 1e300), HasSubstr("extrude_factor"));
  EXPECT_THAT(fault_with("toolhead", "extruder", "extruder\nM112"),
              HasSubstr("toolhead.extruder is no name"));
  EXPECT_THAT(fault_with("toolhead", "homed_axes", std::string(1000, 'x')),
              HasSubstr("homed_axes is no name (1000 bytes"));
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

TEST(WebcamList, AnMjpegStreamThatIsSwitchedOnIsChosen) {
  const auto webcam = [](const char* name, const char* service, bool enabled = true) {
    return Webcam{.name = name, .service = service, .enabled = enabled};
  };
  const std::vector<Webcam> webcams = {
      webcam("first", "webrtc-camerastreamer"), webcam("off", "mjpegstreamer", false),
      webcam("second", "mjpegstreamer-adaptive"), webcam("third", "mjpegstreamer")};
  EXPECT_EQ(ChooseWebcam(webcams, "")->name, "second");
  EXPECT_EQ(ChooseWebcam(webcams, "third")->name, "third");
  EXPECT_EQ(ChooseWebcam({webcam("old", "")}, "")->name, "old");
  EXPECT_THAT(ChooseWebcam({webcams[0], webcams[1]}, "").error().message,
              AllOf(HasSubstr("first as webrtc-camerastreamer"), HasSubstr("[camera] url")));
  EXPECT_THAT(ChooseWebcam({webcam("a", "")}, "b").error().message, HasSubstr("named b"));
}

TEST(WebcamList, AddressesBecomeAbsolute) {
  struct Row {
    const char* stream;
    const char* printer;
    const char* want;
  };
  for (const Row& row :
       {Row{"webcam/?a=b", "voron.local", "http://voron.local:80/webcam/?a=b"},
        Row{"webcam/?a=b", "https://farm.example/v", "https://farm.example:443/v/webcam/?a=b"},
        Row{"webcam/?a=b", "ws://farm/p2/websocket", "http://farm:80/p2/webcam/?a=b"},
        Row{"webcam/?a=b", "unix:/run/m.sock", "http://localhost/webcam/?a=b"},
        Row{"/cam2/?a=b", "http://farm/p2", "http://farm:80/cam2/?a=b"},
        Row{"//cam.local:8080/s", "https://farm.example/v", "https://cam.local:8080/s"}}) {
    const json answer = {{"webcams", {{{"name", "a"}, {"stream_url", row.stream}}, "nonsense"}}};
    const auto webcams = ReadWebcams(answer, *ParseMoonrakerAddress(row.printer));
    ASSERT_EQ(webcams.size(), 1u);
    EXPECT_EQ(webcams[0].stream_url, row.want) << row.printer;
  }
  for (const json& odd : {json(), json{{"webcams", 3}}}) {
    EXPECT_THAT(ReadWebcams(odd, *ParseMoonrakerAddress("h")), IsEmpty());
  }
}

}  // namespace

}  // namespace trammel::machine
