// Taps from a scripted Moonraker over a real socket, and built from streams of forces and moves.
#include "machine/moonraker/taps/tap_stream.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "machine/moonraker/taps/tap_intake.h"
#include "support/matchers.h"
#include "support/scripted_moonraker.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

using nlohmann::json;

constexpr double kRate_hz = 320;
constexpr double kHalt_s = 101;
constexpr double kRise_s = 101.3;
constexpr double kRiseTime_s = 0.35;

json Move(double time_s, double duration_s, double speed, double accel, double z,
          double direction) {
  return json::array({time_s, duration_s, speed, accel, {10.0, 20.0, z}, {0.0, 0.0, direction}});
}

/// A descent that the trigger cuts short, a halt, a pull-back and a lift.
json TapMoves(double shift_s = 0) {
  return {
      {"data",
       {Move(shift_s + 100, 0.01, 0, 200, 2.1, -1), Move(shift_s + 100.01, 0.99, 2, 0, 2.09, -1),
        Move(shift_s + kHalt_s, 0, 0, 0, -0.03, 0),
        Move(shift_s + kRise_s, 0.001, 0, 300, -0.03, 1),
        Move(shift_s + kRise_s + 0.001, kRiseTime_s - 0.002, 0.3, 0, -0.02985, 1),
        Move(shift_s + kRise_s + kRiseTime_s - 0.001, 0.001, 0.3, -300, 0.0745, 1),
        Move(shift_s + 102.4, 0.5, 5, 0, 0.0746, 1)}}};
}

/// Batches of forces like load_cell/dump_force sends them, 36 samples each.
std::vector<json> Forces(double from_s, double to_s) {
  std::vector<json> batches;
  json data = json::array();
  for (double t = from_s; t < to_s; t += 1 / kRate_hz) {
    data.push_back({t, 1.5, 12345, 12000});
    if (data.size() == 36) {
      batches.push_back({{"data", data}, {"errors", 0}});
      data = json::array();
    }
  }
  return batches;
}

/// Events of a stream, for a test's thread.
struct ReceivedTaps {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<json> taps, calls;
  std::vector<double> firmware_z_mm;
  std::vector<std::string> news;

  TapStreamEvents Events() {
    return {.on_tap = [this](const json& tap, double) { Add(taps, tap); },
            .on_firmware_z = [this](double z, double) { Add(firmware_z_mm, z); },
            .on_call = [this](const json& call, double) { Add(calls, call); },
            .on_news = [this](const std::string& text) { Add(news, text); }};
  }
  template <class T>
  void Add(std::vector<T>& list, const T& value) {
    const std::lock_guard lock(mutex);
    list.push_back(value);
    changed.notify_all();
  }
  template <class Done>
  bool Wait(Done done) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(10), done);
  }
};

class TapStreamTest : public testing::Test {
 protected:
  TapStreamTest() {
    test::AnswerLikeMoonraker(server_);
    server_.Answer("connection.register_remote_method", "ok");
    server_.Answer("printer.objects.list",
                   {{"objects", {"toolhead", "load_cell_probe", "probe", "extruder"}}});
    for (const char* method : {"printer.load_cell_probe.dump_taps", "printer.load_cell.dump_force",
                               "printer.motion_report.dump_trapq"}) {
      server_.Answer(method, {{"header", json::array()}});
    }
  }

  std::unique_ptr<TapStream> Open() {
    TapStreamOptions options;
    options.moonraker.address = fmt::format("127.0.0.1:{}", server_.port());
    options.moonraker.connect_time_limit_s = connect_time_limit_s_;
    options.remote_method = "trammel_tap";
    options.ask_again_s = 0.02;
    return Must(OpenTapStream(options, heard_.Events(), {10}));
  }

  /// The method that the printer was told to send a subscription to.
  std::string MethodOf(const std::string& endpoint) {
    const json request = server_.WaitForRequest(endpoint);
    EXPECT_FALSE(request.is_null()) << endpoint;
    return request.is_null() ? ""
                             : request["params"]["response_template"]["method"].get<std::string>();
  }

  void Push(const std::string& method, const json& params) {
    server_.Push({{"jsonrpc", "2.0"}, {"method", method}, {"params", params}});
  }

  double connect_time_limit_s_ = 10;
  test::ScriptedMoonraker server_;
  ReceivedTaps heard_;
};

using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(TapBuilder, CutsATapOutOfForcesAndMoves) {
  TapBuilder builder;
  builder.AddMoves(TapMoves());
  std::vector<json> taps;
  for (const json& batch : Forces(95, 104)) {
    builder.AddForces(batch);
    for (json& tap : builder.Take()) taps.push_back(std::move(tap));
  }
  ASSERT_THAT(taps, SizeIs(1));
  const json& tap = taps[0];
  EXPECT_EQ(tap["time"].size(), tap["force"].size());
  EXPECT_NEAR(tap["time"].front().get<double>(), 100, 1 / kRate_hz);
  EXPECT_NEAR(tap["time"].back().get<double>(), kRise_s + kRiseTime_s + 0.25, 1 / kRate_hz);
  ASSERT_EQ(tap["moves"].size(), 6u) << "the lift is no part of it";
  EXPECT_EQ(tap["moves"][0]["z_r"], -1);
  EXPECT_EQ(tap["moves"][3]["accel"], 300);
  EXPECT_EQ(tap["moves"][0]["start_x"], 10);
}

TEST(TapBuilder, BatchesThatComeTwiceMakeOneTapWithEverySampleAndMoveOnce) {
  TapBuilder builder;
  builder.AddMoves(TapMoves());
  builder.AddMoves(TapMoves());  // the history again, behind itself
  std::vector<json> taps;
  for (const json& batch : Forces(95, 104)) {
    builder.AddForces(batch);
    builder.AddForces(batch);
    for (json& tap : builder.Take()) taps.push_back(std::move(tap));
  }
  builder.AddMoves(TapMoves());
  for (json& tap : builder.Take()) taps.push_back(std::move(tap));
  ASSERT_THAT(taps, SizeIs(1));
  EXPECT_THAT(taps[0]["moves"], SizeIs(6));
  const auto time_s = taps[0]["time"].get<std::vector<double>>();
  EXPECT_TRUE(std::adjacent_find(time_s.begin(), time_s.end(), std::greater_equal<>()) ==
              time_s.end());
}

TEST(TapBuilder, LeavesOutTapsFromBeforeTheForcesBegan) {
  TapBuilder builder;
  builder.AddMoves(TapMoves());
  for (const json& batch : Forces(kRise_s + 0.1, 104)) builder.AddForces(batch);
  EXPECT_THAT(builder.Take(), IsEmpty());
  builder.AddMoves(TapMoves(5));
  for (const json& batch : Forces(104, 109)) builder.AddForces(batch);
  EXPECT_THAT(builder.Take(), SizeIs(1));
}

TEST(TapBuilder, TakesLiftsAndTravelForNoTap) {
  TapBuilder builder;
  builder.AddMoves({{"data",
                     {Move(100, 1, 5, 0, 10, -1), Move(101.2, 2, 5, 0, 5, 1),  // 10 mm up
                      json::array({103.5, 1.0, 100.0, 0.0, {0, 0, 15}, {1, 0, 0}}),
                      Move(105, 0.2, 5, 0, 15, 1),  // up, but not after a descent
                      Move(106, 1, 2, 0, 2, -1), Move(107.2, 0.4, 5, 0, 0, 1)}}});  // homing's 2 mm
  for (const json& batch : Forces(99, 110)) builder.AddForces(batch);
  EXPECT_THAT(builder.Take(), IsEmpty());
}

using ::testing::HasSubstr;

TEST(ProbeResult, ReadsWhatKlipperSaysOfAProbe) {
  const auto older = Must(ProbeResult("// probe at 150.000,150.000 is z=0.041963"));
  EXPECT_EQ(older.z_mm, 0.041963);
  EXPECT_FALSE(older.less_offset);
  const auto newer =
      Must(ProbeResult("// probe: at 10.000,20.000 bed will contact at z=-0.500000"));
  EXPECT_EQ(newer.z_mm, -0.5);
  EXPECT_TRUE(newer.less_offset);
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
  const auto hears = Open();
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.list").is_null());
  const auto subscribes = Open();
  EXPECT_EQ(MethodOf("printer.load_cell.dump_force"), "trammel_tap_forces");
  EXPECT_EQ(server_.CountRequests("printer.load_cell.dump_force"), 1);
}

TEST_F(TapStreamTest, ATapThatThePrinterSendsWholeIsNotBuiltAsWell) {
  const auto stream = Open();
  const std::string taps = MethodOf("printer.load_cell_probe.dump_taps");
  const std::string forces = MethodOf("printer.load_cell.dump_force");
  const std::string moves = MethodOf("printer.motion_report.dump_trapq");
  // On a busy computer the printer's own report of its first tap arrives last.
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
  EXPECT_THAT(OpenTapStream(options, heard_.Events(), {10}),
              FailsWith("another trammel answers", "without --answer"));
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
  for (int i = 0; i < 1000 && !stream->NozzleTemperature(); ++i) {  // initial value
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

TEST_F(TapStreamTest, SubscribesAgainAfterARestart) {
  const auto stream = Open();
  (void)MethodOf("printer.load_cell.dump_force");
  server_.Push(test::Notification("notify_klippy_disconnected"));
  server_.Push(test::Notification("notify_klippy_ready"));
  EXPECT_FALSE(server_.WaitForRequest("printer.load_cell.dump_force", 2).is_null());
}

using ::testing::Contains;
using ::testing::Not;

class TapStreamAgainTest : public TapStreamTest {
 protected:
  /// Lets Klipper's streams come over a connection of their own, on which a macro calls once all
  /// are there; after that `forces` answers for those of the load cell.
  void PassThrough(const test::ScriptedMoonraker::Handler& forces) {
    for (const char* endpoint : {"load_cell_probe/dump_taps", "load_cell/dump_force"}) {
      server_.Answer(endpoint, {{"header", json::array()}});
    }
    server_.Handle("motion_report/dump_trapq", [this, forces](const json& request) {
      server_.Handle("load_cell/dump_force", forces);
      return std::vector<json>{test::ResultFor(request, json::object()), Call(7)};
    });
  }

  static json Call(int id) { return {{"method", "trammel_tap"}, {"params", {{"id", id}}}}; }

  void RestartKlipper() {
    server_.Push(test::Notification("notify_klippy_disconnected"));
    server_.Push(test::Notification("notify_klippy_ready"));
  }

  bool IsTold(const std::string& words) {
    return heard_.Wait([&] { return testing::Matches(Contains(HasSubstr(words)))(heard_.news); });
  }
};

const json kTap = {{"time", {1, 2}}, {"force", {3, 4}}, {"moves", {{{"print_time", 1}}}}};

TEST_F(TapStreamAgainTest, AStreamThatIsNotThereYetAfterARestartIsAskedForAgain) {
  std::atomic<int> asked = 0;
  PassThrough([&asked](const json& request) {
    if (++asked == 1) {
      return std::vector<json>{{{"id", request["id"]}, {"error", {{"message", "not there yet"}}}}};
    }
    return std::vector<json>{test::ResultFor(request, json::object()),
                             {{"method", "trammel_tap_taps"}, {"params", {{"tap", kTap}}}}};
  });
  const auto stream = Open();
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.calls.empty(); }));
  RestartKlipper();
  EXPECT_TRUE(heard_.Wait([&] { return !heard_.taps.empty(); }));
  EXPECT_THAT(heard_.news, Not(Contains(HasSubstr("restart its firmware"))));
  EXPECT_EQ(server_.CountRequests("printer.load_cell.dump_force"), 0)
      << "nothing is left with Moonraker";
}

TEST_F(TapStreamAgainTest, AStreamThatStaysAwayIsAskedOfMoonrakerAndItsTrueCauseTold) {
  PassThrough([](const json& request) {
    return std::vector<json>{{{"id", request["id"]}, {"error", {{"message", "sensor is gone"}}}}};
  });
  server_.AnswerError("printer.load_cell.dump_force", 400, "no such sensor");
  const auto stream = Open();
  ASSERT_TRUE(heard_.Wait([&] { return !heard_.calls.empty(); }));
  RestartKlipper();
  EXPECT_TRUE(IsTold("sensor is gone (asked 5 times"));
  EXPECT_TRUE(IsTold("no such sensor (asked 5 times"));
  EXPECT_THAT(heard_.news, Not(Contains(HasSubstr("restart its firmware"))));
}

}  // namespace
}  // namespace trammel::machine
