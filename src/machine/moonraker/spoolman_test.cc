// Spoolman through a server that answers as a test says; what is written there: apply_test.
#include "machine/moonraker/spoolman.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "machine/moonraker/moonraker_test_support.h"

namespace trammel::machine {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const ExtraField kField{"pressure_advance", "Pressure advance", "float", "s"};

class SpoolmanTest : public MoonrakerPrinterTest {
 protected:
  // A Spoolman that takes requests and answers none, behind a Moonraker that goes on.
  void ConnectToHanging() {
    Connect();
    server_.Handle("server.spoolman.proxy", [](const json&) { return std::vector<json>(); });
  }
  void AnswerStatus() {
    server_.Handle("server.spoolman.status", [](const json& request) {
      return std::vector<json>{test::ResultFor(request, {{"spoolman_connected", true}})};
    });
  }
};

TEST_F(SpoolmanTest, OneThatHangsIsNamedAndThePrintersComputerIsNot) {
  ConnectToHanging();
  AnswerStatus();
  const auto field = Spoolman(*printer_, kShort).HasField(SpoolmanEntity::kSpool, kField);
  ASSERT_FALSE(field);
  EXPECT_EQ(field.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(field.error().message,
              AllOf(HasSubstr("Spoolman does not answer GET /v1/field/spool within the 0.1 s"),
                    HasSubstr("leave it out"), Not(HasSubstr("overloaded")),
                    Not(HasSubstr("last messages")), Not(HasSubstr("come to be written"))));
}

// Each question waited for its own ten seconds, and there are ten of them.
TEST_F(SpoolmanTest, AllQuestionsTogetherHaveOneLimit) {
  Connect();
  server_.Handle("server.spoolman.proxy", [](const json& request) {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return std::vector<json>{test::ResultFor(
        request, {{"response", {{"id", 5}, {"extra", json::object()}, {"version", "0.26.0"}}}})};
  });
  AnswerStatus();
  constexpr double kAll_s = 1;
  constexpr double kEnd_s = 3;  // and a busy computer
  const double begin_s = HostNow();
  Spoolman spoolman(*printer_, {kAll_s});
  std::optional<bool> written = true;
  int asked = 0;
  while (spoolman.Extra(SpoolmanEntity::kSpool, 5, "x") && asked < 100) ++asked;
  EXPECT_LT(asked, 5);
  const auto set = spoolman.SetExtra(SpoolmanEntity::kSpool, 5, "x", 1, written);
  ASSERT_FALSE(set);
  EXPECT_EQ(written, false);  // nothing was sent
  EXPECT_LT(HostNow() - begin_s, kEnd_s);
}

TEST_F(SpoolmanTest, WhetherAValueWasWrittenIsKnownOrSaidNotToBe) {
  Connect();
  std::string method_that_fails;
  bool answers = true;
  server_.Handle("server.spoolman.proxy", [&](const json& request) {
    const json& params = request["params"];
    if (params["request_method"] == method_that_fails) {
      if (!answers) return std::vector<json>();
      return std::vector<json>{test::ResultFor(
          request, {{"error", {{"status_code", 400}, {"message", "no"}}}, {"response", nullptr}})};
    }
    return std::vector<json>{test::ResultFor(
        request, {{"response", {{"id", 5}, {"extra", json::object()}, {"version", "0.26.0"}}}})};
  });
  AnswerStatus();
  const auto set = [this] {
    std::optional<bool> written = true;
    EXPECT_FALSE(Spoolman(*printer_, {0.5}).SetExtra(SpoolmanEntity::kSpool, 5, "x", 1, written));
    return written;
  };
  EXPECT_EQ(set(), true);  // it was taken, and reads otherwise
  method_that_fails = "PATCH";
  EXPECT_EQ(set(), false);
  answers = false;
  EXPECT_EQ(set(), std::nullopt);
}

}  // namespace

}  // namespace trammel::machine
