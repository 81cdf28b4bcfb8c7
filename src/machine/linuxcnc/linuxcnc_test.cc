#include "machine/linuxcnc/linuxcnc.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "machine/net/host_clock.h"
#include "support/matchers.h"
#include "support/scripted_linuxcnc.h"

namespace trammel::machine {
namespace {

using test::ScriptedLinuxCnc;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;
using Fault = ScriptedLinuxCnc::Fault;

LinuxCncOptions Options(const ScriptedLinuxCnc& server) {
  LinuxCncOptions options;
  options.session.helper = {server.helper()};
  options.session.time_limit_s = 1;
  options.spindle_locked_by_hand = true;
  return options;
}

std::unique_ptr<LinuxCnc> Connected(const LinuxCncOptions& options) {
  return Must(LinuxCnc::Connect(options, {}));
}

// A script with one fault at the first request that contains `where`, from the `from`th on.
ScriptedLinuxCnc::Script FaultAt(const std::string& where, Fault fault, int from = 1) {
  return [where, fault, left = from](const std::string& request) mutable {
    if (request.find(where) == std::string::npos || --left != 0) return Fault::kNone;
    return fault;
  };
}

TEST(LinuxCnc, WritesAnOffsetAndReadsItBack) {
  ScriptedLinuxCnc server;
  const auto machine = Connected(Options(server));
  const LinuxCncOffset offset{{-1203.4567894, 87.5, -410}, -12.345678901};
  Must(machine->WriteOffset(2, offset, {}));
  EXPECT_EQ(server.parameter(5241), -1203.456789);
  EXPECT_EQ(server.parameter(5243), -410);
  EXPECT_EQ(server.parameter(5250), -12.345678901);
  const auto read = Must(machine->ReadOffsets(2, {}));
  EXPECT_NEAR(read.offset.rotation_deg, offset.rotation_deg, 1e-6);
  EXPECT_FALSE(read.g92);
}

TEST(LinuxCnc, AnOffsetThatWasRefusedOrNotKeptIsAnErrorThatSaysSo) {
  ScriptedLinuxCnc deaf(FaultAt("G10", Fault::kRefuse));
  EXPECT_THAT(Connected(Options(deaf))->WriteOffset(1, {{1, 2, 3}, 4}, {}),
              FailsWith(ErrorKind::kMachine, "by the script"));

  std::atomic<ScriptedLinuxCnc*> shop = nullptr;
  ScriptedLinuxCnc forgetful([&shop, shown = 0](const std::string& request) mutable {
    if (request.find("#5221") != std::string::npos && ++shown == 2)
      shop.load()->SetParameter(5221, 99);
    return Fault::kNone;
  });
  shop = &forgetful;
  EXPECT_THAT(Connected(Options(forgetful))->WriteOffset(1, {{1, 2, 3}, 4}, {}),
              FailsWith("keeps X 99.000000", "where X 1.000000 Y 2.000000"));
}

TEST(LinuxCnc, RefusesToWriteWhileAG92IsActive) {
  ScriptedLinuxCnc server;
  server.SetParameter(5210, 1);
  EXPECT_THAT(Connected(Options(server))->WriteOffset(1, {{1, 2, 3}, 4}, {}),
              FailsWith(ErrorKind::kSafety, "G92.1"));
  EXPECT_THAT(server.requests(), Each(Not(HasSubstr("G10"))));
}

TEST(LinuxCnc, MovesInPiecesAndArrives) {
  ScriptedLinuxCnc server;
  const auto machine = Connected(Options(server));
  const auto moved = machine->MoveTo({30, -40, 5.5}, 6000, {});  // 50 mm at 50 mm a piece
  ASSERT_TRUE(moved) << moved.error().message;
  EXPECT_NEAR(server.position()[1], -40, 1e-3);
  EXPECT_FALSE(server.moving());
  int pieces = 0;
  for (const std::string& request : server.requests()) {
    pieces += request.find("G53 G1") != std::string::npos ? 1 : 0;
    EXPECT_THAT(request, AllOf(Not(HasSubstr("M3")), Not(HasSubstr("M4"))));
  }
  EXPECT_EQ(pieces, 2);
}

TEST(LinuxCnc, TurnsTheSpindleByItsAxisInPiecesAndNothingElse) {
  ScriptedLinuxCnc server;
  LinuxCncOptions options = Options(server);
  options.spindle_locked_by_hand = false;
  options.c_holds_spindle = true;
  const auto machine = Connected(options);
  const auto turned = machine->TurnTo(180, 7200, {});  // 60 degrees a piece
  ASSERT_TRUE(turned) << turned.error().message;
  const auto state = Must(machine->State({}));
  EXPECT_EQ(state.c_deg, 180);
  std::vector<std::string> moves;
  for (const std::string& request : server.requests()) {
    if (request.find("G53 G1") != std::string::npos) moves.push_back(request);
  }
  EXPECT_EQ(moves.size(), 3);
  EXPECT_THAT(moves, Each(AllOf(HasSubstr(" C"), Not(HasSubstr("X")), Not(HasSubstr("Z")))));
  server.Answer("spindle_stopped", false);
  EXPECT_THAT(machine->TurnTo(0, 7200, {}), FailsWith(ErrorKind::kSafety));
}

TEST(LinuxCnc, RefusesUnlessTheMachineIsReadyAndTheSpindleHeld) {
  struct Case {
    const char* name;
    nlohmann::json value;
    const char* said;
  };
  for (const Case& c :
       {Case{"estop", true, "emergency stop"}, Case{"on", false, "power"},
        Case{"homed", {1, 0, 1, 1}, "homed"}, Case{"homed", nlohmann::json::array(), "homed"},
        Case{"spindle_stopped", false, "spindle turns"}, Case{"idle", false, "runs a program"},
        Case{"metric", false, "millimetre"}, Case{"feed_override", 0, "feed override"}}) {
    ScriptedLinuxCnc server;
    server.Answer(c.name, c.value);
    const auto machine = Connected(Options(server));
    EXPECT_THAT(machine->MoveTo({1, 2, 3}, 600, {}), FailsWith(ErrorKind::kSafety, c.said))
        << c.name;
    EXPECT_THAT(server.requests(), Each(Not(HasSubstr("mdi"))));
  }
  ScriptedLinuxCnc server;
  LinuxCncOptions options = Options(server);
  options.spindle_locked_by_hand = false;
  EXPECT_THAT(Connected(options)->MoveTo({1, 2, 3}, 600, {}).error().message,
              HasSubstr("locked by hand"));
  options.c_holds_spindle = true;
  EXPECT_TRUE(Connected(options)->MoveTo({1, 2, 3}, 6000, {}));
}

TEST(LinuxCnc, ATakeOverEndsTheMoveAndIsNotFought) {
  ScriptedLinuxCnc* server = nullptr;
  ScriptedLinuxCnc served([&server, moves = 0](const std::string& request) mutable {
    if (request.find("G53") != std::string::npos && ++moves == 2) server->Answer("mode", "MANUAL");
    return Fault::kNone;
  });
  server = &served;
  const auto machine = Connected(Options(served));
  EXPECT_THAT(machine->MoveTo({100, 0, 0}, 1200, {}),
              FailsWith(ErrorKind::kSafety, "somebody took LinuxCNC over", "MANUAL mode"));
  const auto sent = served.requests().size();
  EXPECT_FALSE(machine->MoveTo({0, 0, 0}, 1200, {}));
  served.Answer("mode", "MDI");  // theirs as well
  EXPECT_FALSE(machine->WriteOffset(1, {}, {}));
  const auto requests = served.requests();
  const std::vector<std::string> later(requests.begin() + static_cast<std::ptrdiff_t>(sent),
                                       requests.end());
  EXPECT_THAT(later, Each(Not(HasSubstr("mdi"))));
  EXPECT_THAT(requests, Each(Not(HasSubstr("abort"))));
}

TEST(LinuxCnc, AStopAbortsTheMoveAndSeesTheMachineStand) {
  ScriptedLinuxCnc server;
  const auto machine = Connected(Options(server));
  std::stop_source source;
  std::thread stopper([&source] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    source.request_stop();
  });
  const auto moved = machine->MoveTo({1000, 0, 0}, 600, source.get_token());
  stopper.join();
  ASSERT_THAT(moved, FailsWith(ErrorKind::kInterrupted, "the machine stands at X"));
  EXPECT_FALSE(server.moving());
  EXPECT_LT(server.position()[0], 100);
}

TEST(LinuxCnc, ALostHelperIsReplacedToAbort) {
  ScriptedLinuxCnc server(FaultAt("look", Fault::kDrop, 5));
  const auto machine = Connected(Options(server));
  EXPECT_THAT(machine->MoveTo({1000, 0, 0}, 600, {}),
              FailsWith(ErrorKind::kMachine, "it has ended", "the machine stands at X"));
  EXPECT_FALSE(server.moving());
}

TEST(LinuxCnc, AMoveThatNobodyEndsIsOverWithinASecond) {
  std::atomic<bool> gone = false;
  ScriptedLinuxCnc server([&gone](const std::string& request) {
    if (request.find("G53 G1") != std::string::npos) {
      gone = true;  // taken, but from here on the line is dead
      return Fault::kNone;
    }
    return gone ? Fault::kDrop : Fault::kNone;
  });
  const auto machine = Connected(Options(server));
  EXPECT_THAT(machine->MoveTo({1000, 0, 0}, 600, {}), FailsWith("look at the machine"));
  const double end_s = HostNow() + 1;
  while (server.moving() && HostNow() < end_s) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_FALSE(server.moving());
  EXPECT_LT(server.position()[0], 6);
}

TEST(LinuxCnc, AnEmergencyStopInAMoveEndsItAtOnceAndIsNamed) {
  std::atomic<ScriptedLinuxCnc*> shop = nullptr;
  ScriptedLinuxCnc server([&shop, moves = false](const std::string& request) mutable {
    moves = moves || request.find("G53 G1") != std::string::npos;
    if (!moves) return Fault::kNone;
    shop.load()->Answer("error", "somebody took LinuxCNC over (its emergency stop was pressed)");
    shop.load()->Answer("kind", "taken");
    return Fault::kNone;
  });
  shop = &server;
  const double begin_s = HostNow();
  const auto moved = Connected(Options(server))->MoveTo({100, 0, 0}, 600, {});
  ASSERT_FALSE(moved);
  EXPECT_LT(HostNow() - begin_s, 2);
  EXPECT_EQ(moved.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(moved.error().message, HasSubstr("emergency stop"));
}

TEST(LinuxCnc, EndsTheMoveWhenTheSpindleStartsOrItsAxisTurns) {
  std::atomic<ScriptedLinuxCnc*> shop = nullptr;
  ScriptedLinuxCnc server([&shop](const std::string& request) {
    if (request.find("G53 G1") != std::string::npos) shop.load()->Answer("spindle_stopped", false);
    return Fault::kNone;
  });
  shop = &server;
  EXPECT_THAT(Connected(Options(server))->MoveTo({100, 0, 0}, 600, {}),
              FailsWith(ErrorKind::kSafety, "spindle was started"));
  EXPECT_FALSE(server.moving());

  ScriptedLinuxCnc turning([&shop](const std::string& request) {
    if (request.find("G53 G1") != std::string::npos) shop.load()->Answer("c", 0.5);
    return Fault::kNone;
  });
  shop = &turning;
  EXPECT_THAT(Connected(Options(turning))->MoveTo({1, 0, 0}, 600, {}).error().message,
              HasSubstr("axis C went from 0.0000 to 0.5000"));
}

TEST(LinuxCnc, EveryFaultOfTheHelperIsANamedError) {
  for (const char* where : {"\"state\"", "\"take\"", "G10", "\"show\""}) {
    for (const Fault fault : {Fault::kDrop, Fault::kNoise, Fault::kRefuse}) {
      ScriptedLinuxCnc server(FaultAt(where, fault));
      const auto machine = Connected(Options(server));
      EXPECT_THAT(machine->WriteOffset(1, {{1, 2, 3}, 4}, {}), FailsWith(ErrorKind::kMachine))
          << where;
    }
  }
}

TEST(LinuxCnc, APlaceWhereNoMachineCanBeIsAFaultOfTheControllerAndNothingMoves) {
  for (const nlohmann::json& told : std::vector<nlohmann::json>{
           {1e300, 0, 0, 0}, {0, 0, 1e300, 0}, {0, -2e5, 0, 0}, {0, 0, 1e7, 0}, {0, 0}, "home"}) {
    ScriptedLinuxCnc server;
    server.Answer("position", told);
    const auto machine = Connected(Options(server));
    EXPECT_THAT(machine->MoveTo({1, 2, 3}, 600, {}), FailsWith(ErrorKind::kMachine, "LinuxCNC"))
        << told;
    EXPECT_THAT(server.requests(), Each(Not(HasSubstr("G53")))) << told;
  }
}

TEST(LinuxCnc, TheLimitsOfTheAxesHoldForWhatIsToldAndForWhatIsDriven) {
  ScriptedLinuxCnc server;
  server.SetIni("[AXIS_Z]MIN_LIMIT", "-400.000000");
  server.SetIni("[AXIS_Z]MAX_LIMIT", "1.500000");
  const auto machine = Connected(Options(server));
  EXPECT_THAT(machine->MoveTo({0, 0, 1.6}, 6000, {}),
              FailsWith(ErrorKind::kSafety, "Z 1.6", "Z -400"));
  EXPECT_FALSE(machine->MoveTo({NAN, 0, 0}, 6000, {}));
  EXPECT_FALSE(machine->MoveTo({1e300, 0, 0}, 6000, {}));
  EXPECT_THAT(server.requests(), Each(Not(HasSubstr("G53"))));
  EXPECT_TRUE(machine->MoveTo({0, 0, 1.5}, 6000, {}));
  server.Answer("position", {0, 0, 7.5, 0});
  EXPECT_THAT(machine->MoveTo({0, 0, 1}, 6000, {}),
              FailsWith(ErrorKind::kMachine, "Z 7.5", "cannot be"));
}

TEST(LinuxCnc, AMoveThatDoesNotGetOnIsAbortedAtItsTimeLimit) {
  ScriptedLinuxCnc server;
  server.SetHurry(1e-6);
  LinuxCncOptions options = Options(server);
  options.session.time_limit_s = 0.5;
  EXPECT_THAT(Connected(options)->MoveTo({100, 0, 0}, 600, {}),
              FailsWith("did not arrive within", "the machine stands at X"));
  EXPECT_FALSE(server.moving());
}

TEST(LinuxCnc, OffsetsThatCannotBeAreNeitherBelievedNorWritten) {
  for (const auto& [parameter, value] :
       {std::pair{5221, 1e300}, std::pair{5223, -1e6}, std::pair{5230, 1e9}, std::pair{5210, 7.0},
        std::pair{5403, 1e12}}) {
    ScriptedLinuxCnc server;
    server.SetParameter(parameter, value);
    const auto read = Connected(Options(server))->ReadOffsets(1, {});
    ASSERT_THAT(read, FailsWith(ErrorKind::kMachine)) << parameter;
    EXPECT_LT(read.error().message.size(), 400u);
  }
  ScriptedLinuxCnc server;
  EXPECT_THAT(Connected(Options(server))->WriteOffset(1, {{0, 1e9, 0}, 0}, {}),
              FailsWith("work offset 1"));
  EXPECT_THAT(server.requests(), Each(Not(HasSubstr("G10"))));
}

}  // namespace
}  // namespace trammel::machine
