// Spoolman through a server that answers as a test says; what is written there: apply_test.
#include "machine/moonraker/spoolman.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
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
              AllOf(HasSubstr("Spoolman does not answer GET /v1/field/spool within 0.1 s"),
                    HasSubstr("leave it out"), Not(HasSubstr("overloaded")),
                    Not(HasSubstr("last messages")), Not(HasSubstr("come to be written"))));
}

TEST_F(SpoolmanTest, AWriteThatWasNotAnsweredMayYetComeToBeWritten) {
  ConnectToHanging();
  AnswerStatus();
  const auto added = Spoolman(*printer_, kShort).AddField(SpoolmanEntity::kSpool, kField);
  ASSERT_FALSE(added);
  EXPECT_THAT(added.error().message, HasSubstr("may come to be written yet"));
}

TEST_F(SpoolmanTest, WhereMoonrakerHangsTooItIsNotPutDownToSpoolman) {
  ConnectToHanging();
  server_.Handle("server.spoolman.status", [](const json&) { return std::vector<json>(); });
  const auto field = Spoolman(*printer_, kShort).HasField(SpoolmanEntity::kSpool, kField);
  ASSERT_FALSE(field);
  EXPECT_THAT(field.error().message, HasSubstr("the printer's computer may be overloaded"));
}

}  // namespace
}  // namespace trammel::machine
