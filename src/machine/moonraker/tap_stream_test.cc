// Taps from a scripted Moonraker over a real socket.
#include "machine/moonraker/tap_stream.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "machine/moonraker/tap_stream_test_support.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

using ::testing::HasSubstr;

TEST(ProbeResult, ReadsWhatKlipperSaysOfAProbe) {
  const auto older = ProbeResult("// probe at 150.000,150.000 is z=0.041963");
  ASSERT_TRUE(older);
  EXPECT_EQ(older->z_mm, 0.041963);
  EXPECT_FALSE(older->less_offset);
  const auto newer = ProbeResult("// probe: at 10.000,20.000 bed will contact at z=-0.500000");
  ASSERT_TRUE(newer);
  EXPECT_EQ(newer->z_mm, -0.5);
  EXPECT_TRUE(newer->less_offset);
  EXPECT_FALSE(ProbeResult("// probe at 1,2 is z=nan"));
  EXPECT_FALSE(ProbeResult("// probe: at 1,2 bed will contact at z="));
  EXPECT_FALSE(ProbeResult("// probe: z_offset: 0.5 z=0.5"));
  EXPECT_FALSE(ProbeResult("// Result: at 1.000,2.000 estimate contact at z=0.5"));
  EXPECT_FALSE(ProbeResult("// Z offset z=0.5"));
  EXPECT_FALSE(ProbeResult("B:60.0 /60.0 T0:210.1 /210.0"));
}

TEST_F(TapStreamTest, HandsOnWholeTapsAsTheyAre) {
  const auto stream = Open();
  const std::string method = MethodOf("printer.load_cell_probe.dump_taps");
  const json tap = {
      {"time", {1, 2}}, {"force", {3, 4}}, {"moves", {{{"print_time", 1}}}}, {"is_valid", true}};
  json next = tap;
  next["time"] = {11, 12};
  // Each twice, as where an earlier subscription is still there.
  for (const json& sent : {tap, tap, next, next}) Push(method, {{"tap", sent}});
  Push("trammel_tap", {{"id", 7}});
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.calls.empty(); }));
  EXPECT_THAT(heard_.taps, testing::ElementsAre(tap, next));
}

TEST_F(TapStreamTest, StreamsComeOverAConnectionThatEndsWithTheRun) {
  for (const char* endpoint :
       {"load_cell_probe/dump_taps", "load_cell/dump_force", "motion_report/dump_trapq"}) {
    server_.Answer(endpoint, {{"header", json::array()}});
  }
  const auto stream = Open();
  EXPECT_EQ(MethodOf("load_cell_probe/dump_taps"), "trammel_tap_taps");
  EXPECT_EQ(MethodOf("load_cell/dump_force"), "trammel_tap_forces");
  EXPECT_EQ(MethodOf("motion_report/dump_trapq"), "trammel_tap_moves");
  Push("trammel_tap_taps",
       {{"tap", {{"time", {1, 2}}, {"force", {3, 4}}, {"moves", {{{"print_time", 1}}}}}}});
  EXPECT_TRUE(heard_.Wait([&] { return !heard_.taps.empty(); }));
  for (const char* method : {"printer.load_cell_probe.dump_taps", "printer.load_cell.dump_force",
                             "printer.motion_report.dump_trapq"}) {
    EXPECT_EQ(server_.CountRequests(method), 0) << "nothing is left with Moonraker";
  }
}

TEST_F(TapStreamTest, StreamsThatAnEarlierRunLeftAreHeardAndNotSubscribedToOnceMore) {
  const json objects = {{"objects", {"load_cell_probe"}}};
  int asked = 0;
  server_.Handle("printer.objects.list", [&](const json& request) {
    std::vector<json> said = {test::ResultFor(request, objects)};
    if (++asked == 1) {
      said.push_back({{"jsonrpc", "2.0"},
                      {"method", "trammel_tap_forces"},
                      {"params", {{"data", json::array()}}}});
    }
    return said;
  });
  const auto hears = Open("a-token");  // with which no second connection can be made
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.list").is_null());
  const auto subscribes = Open("a-token");
  EXPECT_EQ(MethodOf("printer.load_cell.dump_force"), "trammel_tap_forces");
  EXPECT_EQ(server_.CountRequests("printer.load_cell.dump_force"), 1);
}

TEST_F(TapStreamTest, BuildsTapsWhereThePrinterSendsThemWithoutMoves) {
  const auto stream = Open();
  const std::string taps = MethodOf("printer.load_cell_probe.dump_taps");
  const std::string forces = MethodOf("printer.load_cell.dump_force");
  Push(taps, {{"tap", {{"time", {1}}, {"force", {3}}}}});
  Push(MethodOf("printer.motion_report.dump_trapq"), TapMoves());
  for (const json& batch : Forces(99, 103)) Push(forces, batch);
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.taps.empty(); }));
  EXPECT_EQ(heard_.taps[0]["moves"].size(), 6u);
}

TEST_F(TapStreamTest, ATapThatThePrinterSendsWholeIsNotBuiltAsWell) {
  const auto stream = Open();
  const std::string taps = MethodOf("printer.load_cell_probe.dump_taps");
  const std::string forces = MethodOf("printer.load_cell.dump_force");
  const std::string moves = MethodOf("printer.motion_report.dump_trapq");
  // On a busy computer the printer's own word of its first tap comes behind all else.
  Push(moves, TapMoves());
  for (const json& batch : Forces(99, 102.5)) Push(forces, batch);
  const json tap = {{"time", {1}}, {"force", {3}}, {"moves", {{{"print_time", 1}}}}};
  Push(taps, {{"tap", tap}});
  Push("trammel_tap", {{"id", 7}});
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.calls.empty(); }));
  EXPECT_THAT(heard_.taps, testing::ElementsAre(tap));
}

TEST_F(TapStreamTest, ATapThatTheProbeSaysNothingOfIsBuiltAllTheSame) {
  const auto stream = Open();
  const std::string forces = MethodOf("printer.load_cell.dump_force");
  Push(MethodOf("printer.motion_report.dump_trapq"), TapMoves());
  for (const json& batch : Forces(99, 104)) Push(forces, batch);
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.taps.empty(); }));
  EXPECT_EQ(heard_.taps[0]["moves"].size(), 6u);
}

TEST_F(TapStreamTest, MovesThatStayAwayAreAskedForOnceMore) {
  const auto stream = Open();
  const std::string forces = MethodOf("printer.load_cell.dump_force");
  (void)MethodOf("printer.motion_report.dump_trapq");
  for (const json& batch : Forces(99, 104)) Push(forces, batch);
  for (int i = 0; i < 3; ++i) Push("trammel_tap", {{"since", 99.0}});
  EXPECT_FALSE(server_.WaitForRequest("printer.motion_report.dump_trapq", 2).is_null());
  ASSERT_TRUE(heard_.Wait([&] { return heard_.calls.size() == 3; }));
  EXPECT_EQ(server_.CountRequests("printer.motion_report.dump_trapq"), 2);
  EXPECT_THAT(heard_.news, testing::Contains(HasSubstr("moves stay away")));
}

TEST_F(TapStreamTest, ACellWithoutWholeTapsIsBuiltFrom) {
  server_.Answer("printer.objects.list", {{"objects", {"toolhead", "load_cell"}}});
  const auto stream = Open();
  const std::string forces = MethodOf("printer.load_cell.dump_force");
  Push(MethodOf("printer.motion_report.dump_trapq"), TapMoves());
  for (const json& batch : Forces(99, 103)) Push(forces, batch);
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.taps.empty(); }));
  EXPECT_EQ(heard_.taps[0]["x_rise_print_time_s"], kRise_s);
}

TEST_F(TapStreamTest, ASecondStreamForTheSameMacroSaysWhatToDo) {
  server_.Handle("connection.register_remote_method", [](const json& request) {
    const std::string method = request["params"]["method_name"];
    if (method != "trammel_tap") return std::vector<json>{test::ResultFor(request, "ok")};
    return std::vector<json>{
        test::ErrorFor(request, 400, "Remote method (trammel_tap) already registered")};
  });
  TapStreamOptions options;
  options.moonraker.address = fmt::format("127.0.0.1:{}", server_.port());
  options.remote_method = "trammel_tap";
  const auto second = OpenTapStream(options, heard_.Events(), {10});
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message,
              testing::AllOf(HasSubstr("another trammel answers"), HasSubstr("without --answer")));
}

TEST_F(TapStreamTest, BothConsoleSentencesTellTheHeightOfTheTrigger) {
  server_.Answer(
      "printer.objects.query",
      {{"status", {{"configfile", {{"settings", {{"load_cell_probe", {{"z_offset", 0.25}}}}}}}}}});
  const auto stream = Open();
  (void)MethodOf("printer.motion_report.dump_trapq");  // behind the settings
  server_.Push(test::GcodeResponse("// probe at 1.000,2.000 is z=0.012500"));
  server_.Push(test::GcodeResponse("// probe: at 1.000,2.000 bed will contact at z=-0.237500"));
  Push("trammel_tap", {{"id", 7}});
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.calls.empty(); }));
  EXPECT_THAT(heard_.firmware_z_mm,
              testing::ElementsAre(0.0125, testing::DoubleNear(0.0125, 1e-12)));
}

// Klipper removes last_z_result; what replaces it is the bed's height, less the probe's offset.
TEST_F(TapStreamTest, WhereThePrinterTellsThePlaceOnTheBedItsHeightIsThatOfTheTrigger) {
  server_.Answer(
      "printer.objects.query",
      {{"status", {{"configfile", {{"settings", {{"load_cell_probe", {{"z_offset", 0.25}}}}}}}}}});
  server_.Answer("printer.objects.subscribe",
                 {{"status", {{"probe", {{"last_probe_position", {1, 2, 9.0}}}}}}});
  const auto stream = Open();
  (void)MethodOf("printer.motion_report.dump_trapq");  // behind the settings
  for (const json& odd : {json("high"), json::array(), json::array({1, 2, "x"}), json()}) {
    server_.Push(test::StatusUpdate({{"probe", {{"last_probe_position", odd}}}}, 100));
  }
  server_.Push(
      test::StatusUpdate({{"probe", {{"last_probe_position", {1.0, 2.0, -0.2375}}}}}, 100));
  Push("trammel_tap", {{"id", 7}});
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.calls.empty(); }));
  EXPECT_THAT(heard_.firmware_z_mm, testing::ElementsAre(testing::DoubleNear(0.0125, 1e-12)));
}

TEST_F(TapStreamTest, TellsThePrintersOwnResultAndItsMacrosCalls) {
  const auto stream = Open();
  for (int i = 0; i < 1000 && !stream->NozzleTemperature(); ++i) {  // what it is at the start
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  server_.Push(test::GcodeResponse("// probe at 1.0,2.0 is z=0.0125"));
  server_.Push(test::StatusUpdate(
      {{"probe", {{"last_z_result", 0.5}}}, {"extruder", {{"temperature", 151.5}}}}, 100));
  Push("trammel_tap", {{"id", 7}});
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.calls.empty(); }));
  EXPECT_THAT(heard_.firmware_z_mm, testing::ElementsAre(0.0125, 0.5));
  EXPECT_EQ(heard_.calls[0]["id"], 7);
  EXPECT_EQ(stream->NozzleTemperature(), 151.5);
  stream->Send("TRAMMEL_TAP_RESULT VERDICT=good");
  const json script = server_.WaitForRequest("printer.gcode.script");
  EXPECT_EQ(script["params"]["script"], "TRAMMEL_TAP_RESULT VERDICT=good");
}

TEST_F(TapStreamTest, LastWordsStillLeaveWhenItIsClosed) {
  constexpr int kScripts = 200;
  {
    const auto stream = Open();
    for (int i = 0; i < kScripts; ++i) stream->Send(fmt::format("M117 {}", i));
  }
  EXPECT_FALSE(server_.WaitForRequest("printer.gcode.script", kScripts).is_null());
}

TEST_F(TapStreamTest, SubscribesAgainAfterARestart) {
  const auto stream = Open();
  (void)MethodOf("printer.load_cell.dump_force");
  server_.Push(test::Notification("notify_klippy_disconnected"));
  server_.Push(test::Notification("notify_klippy_ready"));
  EXPECT_FALSE(server_.WaitForRequest("printer.load_cell.dump_force", 2).is_null());
}

TEST_F(TapStreamTest, SaysThatThereIsNoLoadCell) {
  server_.Answer("printer.objects.list", {{"objects", {"toolhead", "probe"}}});
  const auto stream = Open();
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.news.empty(); }));
  ASSERT_TRUE(heard_.Wait([&] {
    return testing::Matches(testing::Contains(HasSubstr("no [load_cell_probe]")))(heard_.news);
  }));
}

}  // namespace
}  // namespace trammel::machine
