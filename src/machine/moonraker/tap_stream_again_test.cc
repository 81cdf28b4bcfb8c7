// A stream of taps that is refused, or not answered, or whose session of Klipper is over.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "machine/moonraker/tap_stream_test_support.h"

namespace trammel::machine {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
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

TEST_F(TapStreamAgainTest, AStreamThatMoonrakerRefusesOnceIsAskedForAgain) {
  std::atomic<int> asked = 0;
  server_.Handle("printer.load_cell.dump_force", [&asked](const json& request) {
    return std::vector<json>{++asked == 1 ? test::ErrorFor(request, 503, "Klippy is not ready")
                                          : test::ResultFor(request, json::object())};
  });
  const auto stream = Open();
  EXPECT_FALSE(server_.WaitForRequest("printer.load_cell.dump_force", 2).is_null());
}

TEST_F(TapStreamAgainTest, AStreamThatIsNeverAnsweredIsAskedOfMoonraker) {
  server_.Handle("load_cell_probe/dump_taps", [](const json&) { return std::vector<json>{}; });
  for (const char* endpoint : {"load_cell/dump_force", "motion_report/dump_trapq"}) {
    server_.Answer(endpoint, {{"header", json::array()}});
  }
  connect_time_limit_s_ = 3;
  const auto stream = Open();
  EXPECT_EQ(MethodOf("printer.load_cell.dump_force"), "trammel_tap_forces");
}

TEST_F(TapStreamAgainTest, WhatWasBegunBeforeARestartAsksForNothingAfterIt) {
  std::atomic<int> asked = 0;
  server_.Handle("printer.objects.list", [&asked](const json& request) {
    if (++asked > 1) {
      return std::vector<json>{test::ResultFor(request, {{"objects", {"load_cell_probe new"}}})};
    }
    return std::vector<json>{test::ResultFor(request, {{"objects", {"load_cell_probe old"}}}),
                             test::Notification("notify_klippy_disconnected"),
                             test::Notification("notify_klippy_ready")};
  });
  const auto stream = Open("a-token");  // with which no second connection can be made
  const json request = server_.WaitForRequest("printer.load_cell.dump_force");
  ASSERT_FALSE(request.is_null());
  EXPECT_EQ(request["params"]["load_cell"], "new");
}

TEST_F(TapStreamAgainTest, APrinterThatDoesNotTellItsObjectsIsNotSaidToHaveNoLoadCell) {
  server_.AnswerError("printer.objects.list", 503, "Klippy Host not connected");
  const auto stream = Open();
  EXPECT_TRUE(IsTold("Klippy Host not connected (asked 5 times"));
  EXPECT_THAT(heard_.news, Not(Contains(HasSubstr("no [load_cell"))));
}

}  // namespace
}  // namespace trammel::machine
