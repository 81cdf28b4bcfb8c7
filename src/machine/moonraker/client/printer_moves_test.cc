// The moves of a printer behind Moonraker: subscribed to once in a session of Klipper.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine/moonraker/moonraker_test_support.h"
#include "support/matchers.h"

namespace trammel::machine {
namespace {

using nlohmann::json;
using test::ErrorFor;
using test::Notification;
using test::ResultFor;
using test::StatusUpdate;
using ::testing::ElementsAre;

class MoonrakerMovesTest : public MoonrakerPrinterTest {
 protected:
  static constexpr const char* kDump = "printer.motion_report.dump_trapq";

  static json Batch(const json& rows, const char* method = "trammel_moves") {
    return {{"jsonrpc", "2.0"}, {"method", method}, {"params", {{"data", rows}}}};
  }
  static json Row(double print_time_s) {
    return {print_time_s, 1.0, 100.0, 0.0, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}};
  }
  /// The head moves from one moment on, of which the printer goes on telling for six seconds.
  void MoveFrom(double eventtime_s) {
    for (int i = 0; i < 24; ++i) {
      server_.Push(StatusUpdate({{"motion_report", {{"live_velocity", 100.0 + i}}}},
                                eventtime_s + 0.25 * i));
    }
    Settle();
  }
};

TEST_F(MoonrakerMovesTest, KeepsTheMovesThatAreTold) {
  Connect();
  ASSERT_TRUE(printer_->RecordMoves(kPatience));
  server_.Push(Batch({{104.0, 1.0, 100.0, 0.0, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}},
                      {105.0, 0.5, 100.0, -200.0, {100.0, 0.0, 0.0}, {1.0, 0.0, 0.0}},
                      {105.5, "no", 0.0, 0.0, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}},
                      {108.0, 1.0, 0.0, 10.0, {125.0, 0.0, 0.0}, {0.0, 1.0, 0.0}}}));
  const auto moves = Must(printer_->Moves(104.5, 105.2, kPatience));
  ASSERT_EQ(moves.size(), 2);
  EXPECT_EQ(moves.at(1).acceleration_mm_s2, -200);
  EXPECT_THAT(moves.at(1).start_mm, ElementsAre(100, 0, 0));
  EXPECT_THAT(printer_->Moves(200, 201, kShort), FailsWith("the moves until print time 201"));
}

TEST_F(MoonrakerMovesTest, MovesThatComeByThemselvesAreNotSubscribedToOnceMore) {
  Connect();
  ASSERT_TRUE(printer_->RecordMoves(kPatience));
  server_.Push(Batch(json::array({Row(104)})));  // from an earlier run's subscription
  MoveFrom(3050);
  EXPECT_EQ(server_.CountRequests(kDump), 0);
  ASSERT_TRUE(printer_->RecordMoves(kPatience));
  EXPECT_EQ(server_.CountRequests("connection.register_remote_method"), 1);
}

TEST_F(MoonrakerMovesTest, OneSubscriptionInASessionOfKlipper) {
  Connect();
  ASSERT_TRUE(printer_->RecordMoves(kPatience));
  MoveFrom(3050);
  const json request = server_.WaitForRequest(kDump);
  EXPECT_EQ(request["params"],
            (json{{"name", "toolhead"}, {"response_template", {{"method", "trammel_moves"}}}}));
  MoveFrom(3060);
  EXPECT_EQ(server_.CountRequests(kDump), 1);
  // Ready is told, and heard of by asking, too.
  server_.Push(Notification("notify_klippy_disconnected"));
  EXPECT_FALSE(server_.WaitForRequest("server.info", 2).is_null());
  server_.Push(Notification("notify_klippy_ready"));
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.subscribe", 2).is_null());
  Settle();
  MoveFrom(3080);
  EXPECT_FALSE(server_.WaitForRequest(kDump, 2).is_null());
  MoveFrom(3090);
  EXPECT_EQ(server_.CountRequests(kDump), 2);
  EXPECT_EQ(server_.CountRequests("printer.objects.subscribe"), 2);
}

TEST_F(MoonrakerMovesTest, ABatchThatDoesNotComeIsAskedForOnceMore) {
  Connect();
  ASSERT_TRUE(printer_->RecordMoves(kPatience));
  server_.Handle(kDump, [](const json& request) {
    return std::vector{ResultFor(request, json::object()), Batch(json::array({Row(200)}))};
  });
  server_.Push(StatusUpdate({{"toolhead", {{"estimated_print_time", 203.0}}}}, 3160));
  const auto moves = Must(printer_->Moves(200, 201, kPatience));
  EXPECT_EQ(moves.size(), 1);
  EXPECT_EQ(server_.CountRequests(kDump), 1);
}

TEST_F(MoonrakerMovesTest, MovesOfAnEarlierSessionAreNotTakenForThoseOfThisOne) {
  Connect();
  ASSERT_TRUE(printer_->RecordMoves(kPatience));
  server_.Push(Batch({Row(104), Row(110)}));
  ASSERT_TRUE(printer_->Moves(104, 105, kPatience));
  server_.Push(Notification("notify_klippy_disconnected"));
  server_.Push(Notification("notify_klippy_ready"));
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.subscribe", 2).is_null());
  Settle();
  EXPECT_FALSE(printer_->Moves(104, 105, kShort));
}

TEST_F(MoonrakerMovesTest, ASecondTrammelTakesANameOfItsOwn) {
  Connect();
  server_.Handle("connection.register_remote_method", [](const json& request) {
    return std::vector{
        request["params"]["method_name"] == "trammel_moves"
            ? ErrorFor(request, 400, "Remote method (trammel_moves) already registered")
            : ResultFor(request, "ok")};
  });
  ASSERT_TRUE(printer_->RecordMoves(kPatience));
  server_.Push(Batch({Row(104), Row(106)}, "trammel_moves_2"));
  EXPECT_TRUE(printer_->Moves(104, 105, kPatience));
}

// A server that lets us through to Klipper.
class KlippyMovesTest : public MoonrakerMovesTest {
 protected:
  static constexpr const char* kOwnDump = "motion_report/dump_trapq";

  void ConnectThrough() {
    server_.Answer(kOwnDump, {{"header", {"time"}}});
    Connect();
    ASSERT_TRUE(printer_->RecordMoves(kPatience));
  }
};

TEST_F(KlippyMovesTest, MovesComeOverAConnectionThatEndsWithTheRun) {
  ConnectThrough();
  const json request = server_.WaitForRequest(kOwnDump);
  EXPECT_EQ(request["params"],
            (json{{"name", "toolhead"}, {"response_template", {{"method", "moves"}}}}));
  EXPECT_EQ(server_.HttpRequestNumber(2).target, "/klippysocket");
  server_.Push(Batch({Row(104), Row(106)}, "moves"));
  const auto moves = Must(printer_->Moves(104, 105, kPatience));
  EXPECT_EQ(moves.size(), 1);
  MoveFrom(3050);
  EXPECT_EQ(server_.CountRequests(kDump), 0) << "nothing is left with Moonraker";
  EXPECT_EQ(server_.CountRequests("connection.register_remote_method"), 0);
}

}  // namespace

}  // namespace trammel::machine
