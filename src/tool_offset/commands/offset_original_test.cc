// trammel offset analyze on a sheet of the original generator: what its owner may hand over.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "support/run_trammel.h"

namespace trammel::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kDx_mm = 0.31;
constexpr double kDy_mm = -0.17;

// Printed and scanned once for all.
class OffsetOriginal : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    const CommandResult made =
        Trammel(fmt::format("sim sheet --original 1,2 --reference 2 --seed 12 --dpi 300 "
                            "--offset 1:{},{} --offset 2:0,0 --out a.png --truth truth.json "
                            "--pattern-out o.gcode --settings-out o.py",
                            kDx_mm, kDy_mm));
    ASSERT_EQ(made.exit_code, 0) << made.output;
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static CommandResult Trammel(const std::string& arguments, RunLimits limits = {}) {
    return RunTrammel(arguments, folder_->path(), limits);
  }
  static CommandResult Analyze(const std::string& arguments) {
    return Trammel("offset analyze a.png " + arguments);
  }
  static std::filesystem::path Path(const std::string& name) { return folder_->path() / name; }
  static std::string Settings() { return ReadWhole(Path("o.py")); }

  /// Why a file is not taken: refused before the scan is looked at, in little memory.
  static std::string WhyNot(const std::string& text) {
    constexpr int kMemory_kb = 300'000;
    WriteWhole(Path("hostile"), text);
    const CommandResult result =
        Trammel("offset analyze a.png --pattern hostile", {.memory_kb = kMemory_kb});
    EXPECT_EQ(result.exit_code, 1) << result.output;
    EXPECT_EQ(result.standard_output, "");
    EXPECT_THAT(result.standard_error, Not(HasSubstr("reading")));
    return result.standard_error;
  }
  static std::string Replaced(std::string text, const std::string& what, const std::string& by) {
    const std::size_t at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return at == std::string::npos ? text : text.replace(at, what.size(), by);
  }

  static std::unique_ptr<TemporaryFolder> folder_;
};
std::unique_ptr<TemporaryFolder> OffsetOriginal::folder_;

TEST_F(OffsetOriginal, IsReadWithItsGcodeItsSettingsOrItsListOfTools) {
  constexpr double kWorst_mm = 0.015;  // at 300 dpi
  const json truth = json::parse(ReadWhole(Path("truth.json")));
  for (const char* sheet :
       {"--pattern o.gcode", "--pattern o.py", "--original 1,2 --reference-tool 2"}) {
    const CommandResult result = Analyze(fmt::format("{} --json", sheet));
    ASSERT_EQ(result.exit_code, 0) << result.output;
    const json found = json::parse(result.standard_output);
    ASSERT_EQ(found["tools"].size(), 1U);
    EXPECT_NEAR(found["tools"][0]["dx_mm"].get<double>(), kDx_mm, kWorst_mm) << sheet;
    EXPECT_NEAR(found["tools"][0]["dy_mm"].get<double>(), kDy_mm, kWorst_mm) << sheet;
    for (const char* axis : {"x", "y"}) {
      EXPECT_NEAR(found["backlash_mm"][axis].get<double>(),
                  truth["backlash_mm"][axis].get<double>(), kWorst_mm);
    }
    EXPECT_THAT(found["notices"].dump(), HasSubstr("identity not checked")) << sheet;
  }
}

TEST_F(OffsetOriginal, IsRefusedAsASheetOfOtherTools) {
  const CommandResult result = Analyze("--original 1,2,3 --reference-tool 2");
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_THAT(result.standard_error, HasSubstr("that of 3 pairs"));
}

TEST_F(OffsetOriginal, IsNotReadFromAPhoto) {
  EXPECT_THAT(Analyze("--pattern o.gcode --photo").standard_error,
              HasSubstr("put it on a scanner"));
}

TEST_F(OffsetOriginal, AListIsOneOfUpToFiveToolsWithTheirReference) {
  const auto fault = [](const std::string& arguments) {
    const CommandResult result = Analyze(arguments);
    EXPECT_EQ(result.exit_code, 1) << result.output;
    return result.standard_error;
  };
  EXPECT_THAT(fault("--original 1,2"), HasSubstr("needs --reference-tool"));
  EXPECT_THAT(fault("--original 1,2 --reference-tool 2 --pattern o.gcode"), HasSubstr("give"));
  for (const char* list : {"1,,2", "1,2,", "x", "1;2", "99999999999", "1.5"}) {
    EXPECT_THAT(fault(fmt::format("--original '{}' --reference-tool 2", list)),
                HasSubstr("list of tools"))
        << list;
  }
  EXPECT_THAT(fault("--original 1,2,3,4,5,6 --reference-tool 2"), HasSubstr("6 entries"));
  EXPECT_THAT(fault("--original 1,100 --reference-tool 2"), HasSubstr("tool 100"));
}

TEST_F(OffsetOriginal, SettingsOfSeveralPrintsNeedToBeToldWhich) {
  WriteWhole(Path("two.py"),
             Settings() + "pattern.full_interlocked_print([1,2,3], 2, \"second.gcode\")\n");
  EXPECT_THAT(Analyze("--pattern two.py").standard_error, HasSubstr("--print"));
  EXPECT_EQ(Analyze("--pattern two.py --print 1").exit_code, 0);
  EXPECT_EQ(Analyze("--pattern two.py --print 2").exit_code, 2);
  EXPECT_EQ(Analyze("--pattern two.py --print 3").exit_code, 1);
}

TEST_F(OffsetOriginal, NothingOfASettingsFileIsRun) {
  WriteWhole(Path("run.py"), "__import__('os').system('touch run')\n" + Settings());
  EXPECT_EQ(Analyze("--pattern run.py").exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(Path("run")));
  EXPECT_THAT(WhyNot(Replaced(Settings(), "rotation = 15", "rotation = open('run', 'w')")),
              HasSubstr("rotation is to be a number"));
  EXPECT_FALSE(std::filesystem::exists(Path("run")));
}

TEST_F(OffsetOriginal, HostileSettingsAreRefusedByTheirLine) {
  const std::string settings = Settings();
  const std::string deep(100'000, '[');
  EXPECT_THAT(WhyNot("x = " + deep + "\n" + settings), HasSubstr("line 1:"));
  EXPECT_THAT(WhyNot("#" + std::string(20'000'000, 'a') + "\n" + settings), HasSubstr("line 1:"));
  EXPECT_THAT(WhyNot(std::string(200'000, '\n') + settings), HasSubstr("line 1001:"));
  EXPECT_THAT(WhyNot(std::string(3, '\0') + settings), HasSubstr("line 1:"));
  EXPECT_THAT(WhyNot(Replaced(settings, "rotation = 15", "rotation = 1e999")), HasSubstr("1e999"));
  EXPECT_THAT(WhyNot(Replaced(settings, "pitch = 0.75", "pitch = nan")), HasSubstr("nan"));
  EXPECT_THAT(WhyNot(Replaced(settings, "x_offsets = [0,0]", "x_offsets = [0]*1000000000")),
              HasSubstr("no list of numbers"));
  EXPECT_THAT(WhyNot(Replaced(settings, "period = 4", "period = 3.5")),
              HasSubstr("interlocked_period is 3.5"));
  EXPECT_THAT(WhyNot(Replaced(settings, "print([1,2]", "print([1,99999999999999999999]")),
              HasSubstr("list of tools"));
}

TEST_F(OffsetOriginal, HostileGcodeIsRefusedByItsLine) {
  const std::string gcode = ReadWhole(Path("o.gcode"));
  EXPECT_THAT(WhyNot(gcode.substr(0, gcode.size() / 2)), HasSubstr("cut off"));
  EXPECT_THAT(WhyNot(Replaced(gcode, "G1 X", "G1 Xnan")), HasSubstr("line "));
  EXPECT_THAT(WhyNot(Replaced(gcode, "\nT1\n", "\nT3\n")), HasSubstr("by T3 and by T1"));
  std::string endless = gcode;
  for (int i = 0; i < 300'000; ++i) endless += "G1 X1 Y1 E1\n";
  EXPECT_THAT(WhyNot(endless), HasSubstr("more than 200 lines"));
}

}  // namespace
}  // namespace trammel::test
