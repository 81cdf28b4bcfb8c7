#include "service/printer_setup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "service/macros.h"
#include "session/fake_printer.h"
#include "support/temporary_folder.h"

namespace trammel::service {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kConfig = "# my printer\r\n[mcu]\r\nserial: /dev/x\r\n";

class PrinterSetupTest : public ::testing::Test {
 protected:
  PrinterSetupTest() {
    printer_.config_files["printer.cfg"] = kConfig;
    printer_.unknown[kLatestMacro] = true;
    printer_.server = [this](const std::string& method, const json& params) -> Result<json> {
      if (method == "server.files.delete_file") {
        const auto path = params.at("path").get<std::string>();
        EXPECT_EQ(path, "config/trammel.cfg");
        printer_.config_files.erase("trammel.cfg");
      } else {
        EXPECT_EQ(method, "printer.firmware_restart");
        ++restarts_;
        const bool included =
            printer_.config_files["printer.cfg"].starts_with("[include trammel.cfg]");
        if (included) {
          printer_.unknown.erase(kLatestMacro);
        } else {
          printer_.unknown[kLatestMacro] = true;
        }
        printer_.state.readiness = included && breaks_ ? machine::PrinterReadiness::kError
                                                       : machine::PrinterReadiness::kReady;
      }
      return json("ok");
    };
  }

  PrinterSetup Look() {
    auto setup = LookAtSetup(printer_, note_, {1, {}});
    EXPECT_TRUE(setup) << setup.error().message;
    return *setup;
  }

  test::TemporaryFolder folder_;
  const std::filesystem::path note_ = folder_.path() / "note";
  procedure::testing::FakePrinter printer_;
  std::string blocker_;
  const RestartBlockerCallback free_ = [this] { return blocker_; };
  int restarts_ = 0;
  bool breaks_ = false;
};

TEST(WithInclude, AddsOneLineByTheFilesOwnEndsAndTakesItOutAgain) {
  for (const std::string text : {"", "[mcu]\n", "[mcu]", "# x\r\n[mcu]\r\n", "\n", "\r\n",
                                 "[include other.cfg]\n#*# <-- SAVE_CONFIG -->\n"}) {
    const std::string with = WithInclude(text);
    EXPECT_EQ(with.size(), text.size() + std::string("[include trammel.cfg]\n").size() +
                               (text.find("\r\n") != std::string::npos ? 1 : 0));
    EXPECT_EQ(WithInclude(with), with);
    EXPECT_EQ(WithoutInclude(with), text);
    EXPECT_EQ(WithoutInclude(text), text);
  }
  const std::string there = "[mcu]\n  [include trammel.cfg]  \n[x]\n";
  EXPECT_EQ(WithInclude(there), there);
  EXPECT_EQ(WithInclude("#[include trammel.cfg]\n"),
            "[include trammel.cfg]\n#[include trammel.cfg]\n");
}

TEST_F(PrinterSetupTest, NamesWhatIsMissingAndChangesNothing) {
  printer_.told["configfile"]["settings"]["respond"] = json::object();
  const PrinterSetup setup = Look();
  EXPECT_FALSE(setup.has_macros);
  EXPECT_FALSE(setup.can_undo);
  EXPECT_THAT(setup.missing, SizeIs(4));
  ASSERT_THAT(setup.changes, SizeIs(2));
  EXPECT_EQ(setup.changes[1].file, "printer.cfg");
  EXPECT_THAT(JsonOf(setup).dump(), HasSubstr("[save_variables]"));
  EXPECT_THAT(printer_.config_files, SizeIs(1));
  EXPECT_EQ(restarts_, 0);
}

TEST_F(PrinterSetupTest, SetsUpAndGoesBackByteForByte) {
  ASSERT_TRUE(SetUpPrinter(printer_, note_, free_, {}));
  EXPECT_EQ(printer_.config_files["trammel.cfg"], kMacros);
  EXPECT_EQ(printer_.config_files["printer.cfg"],
            std::string("[include trammel.cfg]\r\n") + kConfig);
  EXPECT_EQ(restarts_, 1);
  const PrinterSetup setup = Look();
  EXPECT_TRUE(setup.has_macros && setup.can_undo);
  EXPECT_THAT(setup.changes, IsEmpty());
  ASSERT_TRUE(UndoSetUp(printer_, note_, free_, {}));
  EXPECT_EQ(printer_.config_files["printer.cfg"], kConfig);
  EXPECT_EQ(printer_.config_files.count("trammel.cfg"), 0U);
  EXPECT_FALSE(Look().can_undo);
  EXPECT_FALSE(UndoSetUp(printer_, note_, free_, {}));
}

TEST_F(PrinterSetupTest, KeepsWhatTheOwnerChangedSinceAndTheMacrosThatWereThere) {
  printer_.config_files["trammel.cfg"] = "# old \xb0\n";  // Latin-1
  EXPECT_THAT(Look().changes[0].change, HasSubstr("the old one is kept"));
  ASSERT_TRUE(SetUpPrinter(printer_, note_, free_, {}));
  ASSERT_TRUE(SetUpPrinter(printer_, note_, free_, {})) << "twice, as of two pages";
  printer_.config_files["printer.cfg"] += "[fan]\r\n";
  ASSERT_TRUE(UndoSetUp(printer_, note_, free_, {}));
  EXPECT_EQ(printer_.config_files["printer.cfg"], std::string(kConfig) + "[fan]\r\n");
  EXPECT_EQ(printer_.config_files["trammel.cfg"], "# old \xb0\n");
}

TEST_F(PrinterSetupTest, TakesEverythingBackWhereKlipperDoesNotStart) {
  breaks_ = true;
  const auto done = SetUpPrinter(printer_, note_, free_, {});
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message,
              AllOf(HasSubstr("everything was taken back"), HasSubstr("did not start")));
  EXPECT_EQ(printer_.config_files["printer.cfg"], kConfig);
  EXPECT_EQ(printer_.config_files.count("trammel.cfg"), 0U);
  EXPECT_EQ(restarts_, 2);
  EXPECT_FALSE(Look().can_undo);
}

TEST_F(PrinterSetupTest, LeavesAnIncludeThatTheOwnerHad) {
  const std::string own = "[mcu]\n[include trammel.cfg]\n";
  printer_.config_files["printer.cfg"] = own;
  printer_.config_files["trammel.cfg"] = "# old\n";
  ASSERT_TRUE(SetUpPrinter(printer_, note_, free_, {}));
  printer_.config_files["printer.cfg"] += "[fan]\n";
  ASSERT_TRUE(UndoSetUp(printer_, note_, free_, {}));
  EXPECT_EQ(printer_.config_files["printer.cfg"], own + "[fan]\n");
  EXPECT_EQ(printer_.config_files["trammel.cfg"], "# old\n");
}

TEST_F(PrinterSetupTest, RestartsNothingIntoAPrintThatBeganMeanwhile) {
  blocker_ = "the printer is printing";
  const auto done = SetUpPrinter(printer_, note_, free_, {});
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("is printing"));
  EXPECT_EQ(printer_.config_files["printer.cfg"], kConfig);
  EXPECT_EQ(printer_.config_files.count("trammel.cfg"), 0U);
  EXPECT_EQ(restarts_, 0);
}

}  // namespace
}  // namespace trammel::service
