// trammel tap … as a user runs it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "support/drawn_tap_json.h"
#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class TapCommand : public testing::Test {
 protected:
  CommandResult Run(const std::string& arguments) { return RunTrammel(arguments, folder_.path()); }
  void Write(const std::string& name, const std::string& text) {
    WriteWhole(folder_.path() / name, text);
  }
  TemporaryFolder folder_;
};

TEST_F(TapCommand, OneTapIsOneObjectAndItsContactIsThatWhichWasDrawn) {
  Write("a.json", DrawnTap(-0.01).dump());
  const auto result = Must(Run("tap analyze a.json --json"));
  const json tap = json::parse(result.standard_output);
  EXPECT_EQ(tap["verdict"], "good");
  // The head was 0.00015 mm lower than the drawn samples say while it accelerated, and no more.
  EXPECT_NEAR(tap["contact_z_mm"].get<double>(), -0.01, 0.001);
  EXPECT_EQ(tap["x_mm"], 10);
}

TEST_F(TapCommand, SeveralTapsAreAListInTheirOrderAndText) {
  Write("a.json", DrawnTap(-0.01).dump());
  Write("b.jsonl", DrawnTap(0.02).dump() + "\n" + DrawnTap(0.03).dump() + "\n");
  const json list = json::parse(Run("tap analyze b.jsonl a.json --json").standard_output);
  ASSERT_EQ(list.size(), 3u);
  EXPECT_EQ(list[0]["source"], "b.jsonl tap 1");
  EXPECT_NEAR(list[1]["contact_z_mm"].get<double>(), 0.03, 0.001);
  EXPECT_NEAR(list[2]["contact_z_mm"].get<double>(), -0.01, 0.001);
  const json both = json::parse(Run("tap analyze b.jsonl a.json --json --summary").standard_output);
  EXPECT_EQ(both["taps"], list);
  EXPECT_EQ(both["ensemble"]["taps"], 3);
  EXPECT_THAT(Run("tap analyze b.jsonl a.json").standard_output,
              Containing("taps              3", "mean step"));
}

TEST_F(TapCommand, RefusedTapsHaveAReasonAndNoHeight) {
  json tap = DrawnTap(0);
  for (json& force : tap["force"]) force = 5;
  Write("flat.json", tap.dump());
  Write("none.json", R"({"time":[],"force":[]})");
  Write("one.json", R"({"time":[1],"force":[1],"moves":[]})");
  for (const char* file : {"flat.json", "none.json", "one.json"}) {
    const CommandResult result = Run(fmt::format("tap analyze {} --json", file));
    EXPECT_EQ(result.exit_code, 2) << result.output;
    const json refused = json::parse(result.standard_output);
    EXPECT_NE(refused["verdict"], "good");
    EXPECT_TRUE(refused["contact_z_mm"].is_null());
    EXPECT_THAT(refused["reason"].get<std::string>(), Not(IsEmpty()));
    EXPECT_THAT(Run(fmt::format("tap analyze {}", file)).standard_output,
                AllOf(HasSubstr("because"), Not(HasSubstr("contact z"))));
  }
}

TEST_F(TapCommand, FilesThatCannotBeReadAreNamedAndTheOthersAnalysed) {
  Write("good.json", DrawnTap(0).dump());
  Write("cut.json", DrawnTap(0).dump().substr(0, 500));
  const CommandResult alone = Run("tap analyze cut.json --json");
  EXPECT_EQ(alone.exit_code, 1);
  EXPECT_THAT(alone.standard_output, IsEmpty());
  EXPECT_THAT(alone.standard_error, Containing("cut.json", "cut off"));
  const CommandResult both = Run("tap analyze cut.json good.json --json");
  EXPECT_EQ(both.exit_code, 1);
  const json list = json::parse(both.standard_output);
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0]["reason_code"], "unread");
  EXPECT_EQ(list[1]["verdict"], "good");
  EXPECT_EQ(Run("tap analyze missing.json").exit_code, 1);
}

TEST_F(TapCommand, OptionsOutOfBoundsAreNamed) {
  Write("a.json", DrawnTap(0).dump());
  for (const std::string option : {"--method best", "--latency-ms -201", "--latency-ms nan",
                                   "--latency-uncertainty-ms 1e9", "--nozzle-temperature 2000"}) {
    EXPECT_THAT(Run("tap analyze a.json " + option), Fails(1, option.substr(0, option.find(' '))))
        << option;
  }
}

TEST_F(TapCommand, PlotsAPageAndPictures) {
  Write("a.jsonl", DrawnTap(0).dump() + "\n" + DrawnTap(0.002).dump() + "\n");
  for (const std::string file : {"p.html", "p.svg", "p.png", "tap.png --figure tap"}) {
    EXPECT_THAT(Run("tap plot a.jsonl --out " + file), Ends(0));
    EXPECT_GT(fs::file_size(folder_.path() / file.substr(0, file.find(' '))), 2000u) << file;
  }
  EXPECT_EQ(Run("tap plot a.jsonl --out p.pdf").exit_code, 1);
  EXPECT_THAT(Run("tap plot a.jsonl --out p.png --figure cake").standard_error,
              HasSubstr("series, tap"));
}

TEST_F(TapCommand, PlotOverwritesNothingUnasked) {
  Write("a.json", DrawnTap(0).dump());
  Write("p.svg", "precious");
  EXPECT_THAT(Run("tap plot a.json --out p.svg"), Fails(1, "p.svg", "--force"));
  EXPECT_EQ(ReadWhole(folder_.path() / "p.svg"), "precious");
  EXPECT_EQ(Run("tap plot a.json --out p.svg --force").exit_code, 0);
  EXPECT_THAT(ReadWhole(folder_.path() / "p.svg"), HasSubstr("<svg"));
  // Given a hostile user's links.
  Write("anothers", "precious");
  fs::create_symlink(folder_.path() / "anothers", folder_.path() / "q.svg.part");
  fs::create_symlink(folder_.path() / "anothers", folder_.path() / "r.svg");
  EXPECT_EQ(Run("tap plot a.json --out q.svg").exit_code, 0);
  const CommandResult link = Run("tap plot a.json --out r.svg --force");
  EXPECT_EQ(link.exit_code, 1);
  EXPECT_THAT(link.standard_error, HasSubstr("r.svg: is a link"));
  EXPECT_EQ(ReadWhole(folder_.path() / "anothers"), "precious");
}

TEST_F(TapCommand, ComparesMethodsAndFilesAndNeedsSeveralTaps) {
  std::string lines;
  for (int i = 0; i < 10; ++i) {
    json tap = DrawnTap(0.01 + 0.0007 * ((i * 7) % 10));
    // Swings of the samples that are another's in each tap.
    for (std::size_t k = 0; k < tap["force"].size(); ++k) {
      tap["force"][k] = tap["force"][k].get<double>() + 2 * std::sin(0.37 * (i + 2) * double(k));
    }
    lines += tap.dump() + "\n";
  }
  Write("ten.jsonl", lines);
  Write("again.jsonl", lines);
  Write("one.json", DrawnTap(0).dump());
  const auto methods = Must(Run("tap analyze ten.jsonl --compare methods --json"));
  const json comparison = json::parse(methods.standard_output)["comparison"];
  ASSERT_EQ(comparison.size(), 2u);
  EXPECT_EQ(comparison[1]["series"], "contact");
  // The contacts were drawn with a deviation of 2.1 um.
  EXPECT_NEAR(comparison[1]["deviation_mm"]["value"].get<double>(), 0.0021, 0.0008);
  EXPECT_EQ(comparison[1]["ratio"]["verdict"], "good");
  EXPECT_THAT(Run("tap analyze ten.jsonl again.jsonl --compare files").standard_output,
              Containing("again.jsonl       10 of 10", "1.00 (95 %: ", "cannot tell"));
  EXPECT_THAT(Run("tap analyze one.json --compare methods"), Prints(2, "because: 0 of 1 taps"));
  EXPECT_THAT(Run("tap analyze one.json --compare all").standard_error,
              HasSubstr("methods or files"));
}

TEST_F(TapCommand, AdvisesWithReasonsAndNamesWhyItCannot) {
  Write("a.json", DrawnTap(0).dump());
  EXPECT_THAT(
      Run("tap analyze a.json --advice"),
      Prints(0, "\nnoise ", "\nadvice\n", "pull-back speed", "µm by noise alone", "drift filter"));
  const json advice =
      json::parse(Run("tap analyze a.json --advice --json").standard_output)["advice"];
  EXPECT_EQ(advice["settings"].size(), 5u);
  EXPECT_EQ(advice["reason"], "");
  json tap = DrawnTap(0);
  for (json& force : tap["force"]) force = 0.0;
  Write("flat.json", tap.dump());
  EXPECT_THAT(Run("tap analyze flat.json --advice"),
              Prints(2, "advice            none: 0 of 1 taps are good. "));
  EXPECT_THAT(Run("tap analyze a.json --advice --method two-line").standard_error,
              HasSubstr("--advice needs --method contact"));
  EXPECT_THAT(Run("tap analyze a.json --advice --uncertainty-um 0").standard_error,
              HasSubstr("--uncertainty-um 0"));
}

}  // namespace
}  // namespace trammel::test
