// trammel offset apply against the virtual printer with klipper-toolchanger, over real sockets.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/matchers.h"
#include "support/run_trammel.h"
#include "support/trammel_process.h"

namespace trammel::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// A kept result of T1, each value ±2 um, and of T2, which did not print.
std::string KeptResult(double dx_mm, double dy_mm) {
  const auto answer = [](const char* name, double mm) {
    return fmt::format(
        R"({{"name": "{}", "unit": "mm", "verdict": "good", "reason": "", "value": {:.4f},
        "standard_uncertainty": 0.001, "interval95": [{:.4f}, {:.4f}]}})",
        name, mm, mm - 0.002, mm + 0.002);
  };
  const auto none = [](const char* name) {
    return fmt::format(
        R"({{"name": "{}", "unit": "mm", "verdict": "refused", "reason": "it did not print",
        "value": null, "standard_uncertainty": null, "interval95": null}})",
        name);
  };
  return fmt::format(
      R"({{"format": 1, "instrument": "tool_offset", "program": "trammel 9", "utc": "2026",
      "sources": [], "verdict": "refused", "reason": "it did not print", "notices": [],
      "answers": [{}, {}, {}, {}]}})",
      answer("tool_1_dx", dx_mm), answer("tool_1_dy", dy_mm), none("tool_2_dx"), none("tool_2_dy"));
}

// T1 keeps 0.25, -0.5 and lands 0.1234, -0.0456 beside: it shall keep 0.1266, -0.4544.
const std::string kResult = KeptResult(0.1234, -0.0456);
constexpr const char* kHistory = "state/trammel/offset-history.jsonl";

class OffsetApply : public testing::Test {
 protected:
  OffsetApply() { WriteWhole(folder_.path() / "result.json", kResult); }

  void Serve(const std::string& more = "") {
    printer_ = std::make_unique<TrammelProcess>(
        "sim printer --port 0 --speed 20 --tool 0:0,0 --tool 1:0.25,-0.5 " + more, folder_.path());
    address_ = printer_->WaitForLine("listening http://");
    ASSERT_FALSE(address_.empty()) << printer_->StandardErrorSoFar();
  }
  [[nodiscard]] CommandResult Apply(const std::string& more) const {
    return RunTrammel(fmt::format("offset apply result.json --printer {} {}", address_, more),
                      folder_.path());
  }
  [[nodiscard]] CommandResult Undo(const std::string& more) const {
    return RunTrammel(fmt::format("offset apply --undo --printer {} {}", address_, more),
                      folder_.path());
  }
  [[nodiscard]] std::string History() const {
    const auto path = folder_.path() / kHistory;
    return std::filesystem::exists(path) ? ReadWhole(path) : "";
  }

  TemporaryFolder folder_;
  std::unique_ptr<TrammelProcess> printer_;
  std::string address_;
};

TEST_F(OffsetApply, ShowsOldAndNewAndChangesNothingUnlessTold) {
  Serve();
  for (int i = 0; i < 2; ++i) {
    const CommandResult shown = Apply("");
    EXPECT_THAT(
        shown, Prints(0, "0.250  ->  0.127", "-0.500  ->  -0.454", "dx 95 %: +0.1214 to +0.1254 mm",
                      "dy 95 %: -0.0476 to -0.0436 mm", "nothing was changed",
                      "trammel offset apply result.json --apply --printer " + address_));
    EXPECT_THAT(shown.standard_error, HasSubstr("it did not print"));
  }
  EXPECT_EQ(History(), "");
}

TEST_F(OffsetApply, SetsReadsBackAndNotesTheOldValue) {
  Serve();
  EXPECT_THAT(Apply("--apply"), Prints(0, "applied   tool 1", "--save keeps it",
                                       "trammel offset apply --undo --printer " + address_));
  EXPECT_THAT(Apply("").standard_output, HasSubstr("0.127  ->  0.004"));
  EXPECT_THAT(History(), AllOf(HasSubstr(R"("kind":"begun")"), HasSubstr(R"("kind":"applied")"),
                               HasSubstr(R"("old_mm":{"x":0.25,"y":-0.5})")));
}

TEST_F(OffsetApply, TheSameMeasurementIsNotTakenOutTwice) {
  Serve();
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  const std::string before = History();
  const CommandResult twice = Apply("--apply");
  EXPECT_EQ(twice.exit_code, 4);
  EXPECT_THAT(twice.standard_error, AllOf(HasSubstr("twice"), HasSubstr("--force")));
  EXPECT_EQ(History(), before);
  EXPECT_EQ(Apply("--apply --force").exit_code, 0);
}

TEST_F(OffsetApply, TheSameMeasurementIsKnownFromEveryFolderAndUnderEveryName) {
  Serve();
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  const auto other = folder_.path() / "other";
  std::filesystem::create_directory(other);
  WriteWhole(other / "copy.json", kResult);
  std::filesystem::create_directory_symlink(folder_.path() / "state", other / "state");
  EXPECT_THAT(
      RunTrammel(fmt::format("offset apply copy.json --printer {} --apply", address_), other),
      Fails(4, (folder_.path() / "result.json").string()));
}

TEST_F(OffsetApply, AMeasurementOfAnEarlierOffsetIsNotTakenOutOfAnother) {
  Serve();
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  WriteWhole(folder_.path() / "next.json", KeptResult(0.01, 0));
  ASSERT_THAT(RunTrammel("offset apply next.json --apply --printer " + address_, folder_.path()),
              Ends(0));
  EXPECT_EQ(Apply("--apply").exit_code, 4);  // the first sheet again
}

TEST_F(OffsetApply, WhatWasCutOffAfterItWasSetCountsAsSet) {
  Serve();
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  const std::string history = History();
  WriteWhole(folder_.path() / kHistory, history.substr(0, history.find('\n') + 1));
  EXPECT_EQ(Apply("--apply").exit_code, 4);
}

TEST_F(OffsetApply, WhatARestartLostMayBeSetAgain) {
  Serve();
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  Serve();  // another start of the printer, as its configuration has it
  EXPECT_EQ(Apply("--apply").exit_code, 0);
}

TEST_F(OffsetApply, AKeptResultIsNotedAsApplied) {
  Serve();
  ASSERT_EQ(Apply("").exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "state/trammel/applied.jsonl"));
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  EXPECT_THAT(ReadWhole(folder_.path() / "state/trammel/applied.jsonl"),
              AllOf(HasSubstr("tool_offset"), HasSubstr(address_)));
}

TEST_F(OffsetApply, MoreThanASheetCanShowIsNotSetUnforced) {
  Serve();
  WriteWhole(folder_.path() / "result.json", KeptResult(-30, 0));
  EXPECT_THAT(Apply("--apply"), Fails(4, "30.000 mm", "--force"));
  EXPECT_EQ(History(), "");
  EXPECT_THAT(Apply("--dry-run").standard_output,
              AllOf(HasSubstr("0.250  ->  30.250"), HasSubstr("nothing was changed")));
}

TEST_F(OffsetApply, WhatSaveConfigCannotWriteIsSaidAndStaysSet) {
  Serve("--fault included-tools=1");
  const CommandResult kept = Apply("--apply --save");
  EXPECT_THAT(kept, Prints(3, "applied   tool 1"));
  EXPECT_THAT(kept.standard_error, HasSubstr("conflicts with included value"));
  EXPECT_THAT(History(), Not(HasSubstr(R"("kind":"kept")")));
}

TEST_F(OffsetApply, APrintIsNotDisturbed) {
  Serve("--fault printing=1");
  EXPECT_THAT(Apply("--apply"), Fails(3, "is printing"));
  EXPECT_THAT(Apply("").standard_output, HasSubstr("0.250  ->"));
  EXPECT_THAT(History(), Not(HasSubstr(R"("kind":"applied")")));
}

TEST_F(OffsetApply, AValueThatDoesNotComeBackIsAnErrorAndNotApplied) {
  Serve("--fault deaf-tools=1");
  const CommandResult deaf = Apply("--apply --save");
  EXPECT_THAT(deaf, Fails(3, "reports 0.250, -0.500 mm"));
  EXPECT_THAT(deaf.standard_output, Not(HasSubstr("applied")));
  EXPECT_THAT(History(), AllOf(HasSubstr(R"("kind":"begun")"), Not(HasSubstr("applied"))));
}

TEST_F(OffsetApply, NothingIsSetWhereTheOldValueCannotBeKept) {
  Serve();
  EXPECT_THAT(Apply("--apply --history result.json/history"), Fails(1, "history"));
  EXPECT_THAT(Apply("").standard_output, HasSubstr("0.250  ->"));
}

TEST_F(OffsetApply, WithoutTheOffsetOfNowItShowsByHowMuchItChanges) {
  for (const auto& [firmware, change] :
       {std::pair{"klipper-tool", "X -0.123, Y +0.046 mm"}, {"marlin", "X +0.123, Y -0.046 mm"}}) {
    EXPECT_THAT(
        RunTrammel(fmt::format("offset apply result.json --for {}", firmware), folder_.path()),
        Prints(0, change, "nothing was changed", "--now 1:X,Y"));
  }
}

TEST_F(OffsetApply, UndoBringsBackWhatWasBeforeOnceAndSaysSo) {
  Serve();
  EXPECT_EQ(Undo("").exit_code, 1);  // nothing was applied yet
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  EXPECT_THAT(Undo("--dry-run"), Prints(0, "0.127  ->  0.250", "nothing was changed"));
  const auto undone = Must(Undo(""));
  EXPECT_THAT(undone.standard_output, HasSubstr("undone    tool 1: read back"));
  EXPECT_THAT(Apply("").standard_output, HasSubstr("0.250  ->  0.127"));
  EXPECT_THAT(History(), HasSubstr(R"("kind":"undone")"));
  EXPECT_THAT(Undo(""), Fails(1, "taken back at"));
  // An undone change may be applied again, and undone again.
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  EXPECT_EQ(Undo("").exit_code, 0);
}

TEST_F(OffsetApply, WhatSomebodySetSinceIsNotUndoneUnforced) {
  Serve();
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  WriteWhole(folder_.path() / "next.json", KeptResult(0.01, 0));
  const std::string history = History();
  ASSERT_EQ(
      RunTrammel("offset apply next.json --apply --printer " + address_, folder_.path()).exit_code,
      0);
  WriteWhole(folder_.path() / kHistory, history);  // as if set by hand
  EXPECT_THAT(Undo(""), Fails(4, "somebody set another", "--force"));
  EXPECT_EQ(Undo("--force").exit_code, 0);
  EXPECT_THAT(Apply("").standard_output, HasSubstr("0.250  ->  0.127"));
}

TEST_F(OffsetApply, AnUndoThatIsSavedOutlivesARestart) {
  Serve();
  ASSERT_EQ(Apply("--apply --save").exit_code, 0);
  EXPECT_THAT(Undo("--save"), Prints(0, "kept      in the printer's configuration"));
  EXPECT_THAT(Apply("").standard_output, HasSubstr("0.250  ->  0.127"));
}

TEST_F(OffsetApply, UndoIsOfThisPrinterAlone) {
  Serve();
  ASSERT_EQ(Apply("--apply").exit_code, 0);
  const std::string history = History();
  std::string other = history;
  for (std::size_t at = 0; (at = other.find("127.0.0.1:", at)) != std::string::npos; at += 4) {
    other.replace(at, 10, "other.lan:");
  }
  WriteWhole(folder_.path() / kHistory, other);
  EXPECT_THAT(Undo(""), Fails(1, "notes no offset that was set on"));
}

}  // namespace
}  // namespace trammel::test
