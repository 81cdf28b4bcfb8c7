// The pieces that need no server: addresses, scripts, messages, states, moves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "machine/message_log.h"
#include "machine/moonraker_address.h"
#include "machine/moonraker_status.h"
#include "machine/move_log.h"
#include "machine/script_watch.h"
#include "machine/webcam_list.h"

namespace trammel::machine {
namespace {

using nlohmann::json;
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
        "unix:", "unix:x", "h\r\nX: y", "user@h", "ws://h/?a", "http://"}) {
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
  EXPECT_EQ(state.pressure_advance_s, 0.05);
  EXPECT_EQ(state.heaters.size(), 1);
  EXPECT_THAT(state.lights.at("neopixel case").at(0), ElementsAre(1.0, 0.5, 0.0, 0.25));
  EXPECT_EQ(state.eventtime_s, 7);
}

TEST(MoonrakerStatus, NothingKnownIsNotReady) {
  for (const json& nothing : {json(), json::object(), json::array({1}), json("x")}) {
    const PrinterState state = ReadStatus(nothing, 0);
    EXPECT_EQ(state.readiness, PrinterReadiness::kDisconnected);
    EXPECT_FALSE(state.pressure_advance_s);
    EXPECT_THAT(state.heaters, IsEmpty());
  }
}

TEST(MoonrakerStatus, UpdatesOfAnotherFormAreIgnored) {
  json known = {{"extruder", {{"temperature", 20.0}, {"target", 0.0}}}};
  MergeStatus(known, {{"extruder", {{"target", 210.0}}}});
  MergeStatus(known, {{"extruder", 5}});
  MergeStatus(known, json::array({1}));
  MergeStatus(known, nullptr);
  EXPECT_EQ(known["extruder"], (json{{"temperature", 20.0}, {"target", 210.0}}));
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

TEST(WebcamList, RelativeAddressesAreTheWebInterfaces) {
  const json answer = {{"webcams", {{{"name", "a"}, {"stream_url", "webcam/?action=stream"}}}}};
  const auto url = [&](const char* address) {
    return ReadWebcams(answer, *ParseMoonrakerAddress(address)).at(0).stream_url;
  };
  EXPECT_EQ(url("voron.local"), "http://voron.local:80/webcam/?action=stream");
  EXPECT_EQ(url("https://farm.example/v"), "https://farm.example:443/webcam/?action=stream");
  EXPECT_EQ(url("unix:/run/m.sock"), "http://localhost/webcam/?action=stream");
  for (const json& odd : {json(), json{{"webcams", 3}}, json{{"webcams", {nullptr, 4, {"x"}}}}}) {
    EXPECT_THAT(ReadWebcams(odd, *ParseMoonrakerAddress("h")), IsEmpty());
  }
}

}  // namespace
}  // namespace trammel::machine
