#include "pressure_advance/report/pressure_advance_report.h"

#include <gtest/gtest.h>

#include <string>

#include "document/page.h"
#include "document/parsers_test_support.h"
#include "pressure_advance/report/made_up_test_support.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

std::string Page(const pa::Analysis& analysis, const ReportOptions& options = {}) {
  const test::MadeUp made_up{.frames = 40};
  return PressureAdvanceReport(
      analysis, PressureAdvanceFigures({analysis, test::MakeScanView(made_up), {}}), options);
}

/// The page without its style and its pictures: what a reader reads.
std::string Text(const std::string& page) {
  std::string text = page;
  const auto cut = [&](const std::string& begin, const std::string& end) {
    for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin)) {
      text.erase(at, text.find(end, at + begin.size()) - at);
    }
  };
  cut("<path", "/>");
  cut("<image", "/>");
  cut("<style>", "</style>");
  return text;
}

bool Has(const std::string& text, const std::string& what) {
  return text.find(what) != std::string::npos;
}

TEST(PressureAdvanceReport, LeadsWithValueUncertaintyIntervalAndWhatToDo) {
  const auto analysis = test::MakeAnalysis({.frames = 40});
  const std::string page = Page(analysis, {"recordings/a", {{"printer", "Voron"}}});
  EXPECT_EQ(test::XmlProblem(page), "");
  const std::string text = Text(page);
  EXPECT_TRUE(Has(text, "0.0362 s"));
  EXPECT_TRUE(Has(text, "95 %: 0.0347 to 0.0377 s"));
  EXPECT_TRUE(Has(text, "SET_PRESSURE_ADVANCE ADVANCE=0.0362"));
  EXPECT_TRUE(Has(text, "pressure_advance: 0.0362"));
  EXPECT_TRUE(Has(text, "M900 K0.0362"));
  EXPECT_TRUE(Has(text, ">0.0368 s<"));  // the acceleration alone
  EXPECT_TRUE(Has(text, ">0.0393 s<"));  // the deceleration alone
  EXPECT_TRUE(Has(text, ">0.0359 s<"));  // the shape of the lines alone
  EXPECT_TRUE(Has(text, ">counts 75 %<"));
  EXPECT_TRUE(Has(text, ">0.0371 s<"));  // the changes of speed, weighed with it
  EXPECT_TRUE(Has(text, ">counts 25 %, corrected by -0.4 ms<"));
  EXPECT_TRUE(Has(text, analysis.lines[2].reason));
  EXPECT_TRUE(Has(text, analysis.notices[0]));
  EXPECT_TRUE(Has(text, "printer: Voron"));
  EXPECT_TRUE(Has(text, "<figcaption>"));
}

TEST(PressureAdvanceReport, NamesTheCommandOfTheFirmwareThatPrinted) {
  auto analysis = test::MakeAnalysis({.frames = 40});
  analysis.printed_by = gcode::PrintedBy{gcode::Dialect::kMarlin, 0};
  const std::string marlin = Text(Page(analysis));
  EXPECT_TRUE(Has(marlin, "M900 K0.0362"));
  EXPECT_FALSE(Has(marlin, "SET_PRESSURE_ADVANCE"));
  EXPECT_FALSE(Has(marlin, "printer.cfg"));
  analysis.printed_by = gcode::PrintedBy{gcode::Dialect::kRepRapFirmware, 1};
  EXPECT_TRUE(Has(Text(Page(analysis)), "M572 D1 S0.0362"));
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    analysis.printed_by = gcode::PrintedBy{words.dialect, 0};
    const std::string text = Text(Page(analysis));
    EXPECT_TRUE(Has(text, "<pre>" + PressureAdvanceCommands(words.dialect, "0.0362").front()))
        << words.name;
    EXPECT_TRUE(Has(text, std::string(words.title))) << words.name;
  }
  analysis.printed_by = std::nullopt;  // of each firmware
  const std::string unknown = Text(Page(analysis));
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    EXPECT_TRUE(Has(unknown, PressureAdvanceCommands(words.dialect, "0.0362").front()))
        << words.name;
  }
}

TEST(PressureAdvanceReport, NamesNoAnswerUnlessGoodHoweverGoodTheParts) {
  auto analysis = test::MakeAnalysis({.frames = 40});
  analysis.notices.clear();
  analysis.deviation.best_s = 0.0123;
  for (const Measured& bad :
       {Measured::CannotTell("the lines are flat"), Measured::Refused("no laser line")}) {
    analysis.pressure_advance = bad;
    const std::string text = Text(Page(analysis));
    EXPECT_TRUE(Has(text, bad.reason()));
    EXPECT_TRUE(Has(text, "No value"));
    for (const char* number :
         {"0.0362", "0.0368", "0.0393", "0.0359", "0.0371", "61.0 ms", "0.0123", "0.0380",
          "SET_PRESSURE_ADVANCE", "M900", "M572", "printer.cfg"}) {
      EXPECT_FALSE(Has(text, number)) << number;
    }
  }
}

TEST(PressureAdvanceReport, ARefusalIsSaidOnceWithItsOptionsUnbroken) {
  pa::Analysis analysis;
  const auto refused = Measured::Refused("no numbers are seen; give the file (--gcode FILE)");
  analysis.pressure_advance = analysis.response.acceleration.pressure_advance =
      analysis.response.deceleration.pressure_advance = refused;
  const std::string page = Page(analysis);
  EXPECT_EQ(page.find("no numbers are seen"), page.rfind("no numbers are seen"));
  EXPECT_TRUE(Has(page, "(<span class=\"option\">--gcode</span> FILE)"));
}

TEST(PressureAdvanceReport, SaysWhatTheShapeOfTheLinesTells) {
  auto analysis = test::MakeAnalysis({.frames = 40});
  const std::string text = Text(Page(analysis));
  const auto row = [&text](const std::string& name, const std::string& value,
                           const std::string& interval) {
    const std::size_t at = text.find(name);
    ASSERT_NE(at, std::string::npos) << name;
    const std::string cells = text.substr(at, text.find("</tr>", at) - at);
    EXPECT_TRUE(Has(cells, value)) << cells;
    EXPECT_TRUE(Has(cells, interval)) << cells;
  };
  row("lag at 5 mm/s", "61.0 ms", "95 %: 53.0 to 69.0 ms");
  row("lag at 150 mm/s", "27.5 ms", "95 %: 24.5 to 30.5 ms");
  row("slip at 150 mm/s", "1.20 %", "95 %: 0.40 to 2.00 %");
  row("scatter of the lag", "1.4 ms", "of 10 lines");
  analysis.response.law.reset();
  EXPECT_FALSE(Has(Text(Page(analysis)), "shape of the lines"));
}

TEST(PressureAdvanceReport, HostileTextStaysText) {
  auto analysis = test::MakeAnalysis({.frames = 40});
  const std::string hostile = "<script>alert('1')</script>\" onload=\"x & \xff\xfe\x01";
  analysis.lines[0].reason = hostile;
  analysis.notices = {hostile};
  analysis.response.acceleration.pressure_advance = Measured::Refused(hostile);
  for (const Measured& answer : {analysis.pressure_advance, Measured::Refused(hostile)}) {
    analysis.pressure_advance = answer;
    const std::string page = Page(analysis, {hostile, {{hostile, hostile}}});
    EXPECT_EQ(test::XmlProblem(page), "");
    EXPECT_FALSE(Has(page, "<script"));
    EXPECT_FALSE(Has(page, "\" onload"));
    EXPECT_TRUE(Has(page, "&lt;script&gt;alert(&#39;1&#39;)"));
  }
}

TEST(PressureAdvanceReport, LoadsNothingFromElsewhere) {
  const auto analysis = test::MakeAnalysis({.frames = 40});
  const std::string page = Page(analysis);
  EXPECT_FALSE(Has(page, "http://"));
  EXPECT_FALSE(Has(page, "https://"));
  EXPECT_FALSE(Has(page, "<script"));
  EXPECT_FALSE(Has(page, "<link"));
  EXPECT_FALSE(Has(page, "@import"));
}

TEST(PressureAdvanceReport, AnEmptyAnalysisIsARefusedPage) {
  const pa::Analysis analysis;
  const std::string page = Page(analysis);
  EXPECT_EQ(test::XmlProblem(page), "");
  EXPECT_TRUE(Has(page, "refused"));
  EXPECT_TRUE(Has(page, "nothing was measured"));
  EXPECT_FALSE(Has(page, "<svg"));
}

TEST(Base64, MatchesTheVectorsOfRfc4648) {
  EXPECT_EQ(Base64("fo"), "Zm8=");
  EXPECT_EQ(Base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64("\xff\xfe"), "//4=");
}

TEST(PressureAdvanceReport, SaysInWordsWhichWayTheFlowRatioIsWrong) {
  pa::FlowRatio flow = test::MakeFlow();
  EXPECT_EQ(FlowSentence(flow), "the printer lays 3.0 % too little: set the flow ratio to 1.031");
  flow.ratio = Measured::Good({0.97, 0.009, {0.952, 0.988}});
  EXPECT_EQ(FlowSentence(flow), "the printer lays 3.1 % too much: set the flow ratio to 0.970");
  flow.ratio = Measured::Good({0.99, 0.009, {0.972, 1.008}});
  EXPECT_TRUE(Has(FlowSentence(flow), "the printer lays what is commanded"));
  EXPECT_TRUE(Has(SlipSentence(flow, test::MakeAnalysis({}).motion),
                  "at 150 mm/s the lines have 1.9 % less than at 5 mm/s"));
}

TEST(PressureAdvanceReport, ShowsTheFlowRatioWithTheLinesToPasteOrTheReasonForNone) {
  auto analysis = test::MakeAnalysis({.frames = 40});
  const std::string page = Page(analysis);
  EXPECT_EQ(test::XmlProblem(page), "");
  const std::string text = Text(page);
  EXPECT_TRUE(Has(text, "95 %: 1.013 to 1.049"));
  EXPECT_TRUE(Has(text, "The printer lays 3.0 % too little: set the flow ratio to 1.031."));
  EXPECT_TRUE(Has(text, "filament_flow_ratio = 1.031"));
  EXPECT_TRUE(Has(text, "M221 S103.1"));
  EXPECT_TRUE(Has(text, "Nothing was applied"));
  analysis.flow->ratio = Measured::CannotTell("the scale is <unknown>");
  const std::string without = Text(Page(analysis));
  EXPECT_TRUE(Has(without, "the scale is &lt;unknown&gt;"));
  EXPECT_FALSE(Has(without, "M221"));
  analysis.flow.reset();
  EXPECT_FALSE(Has(Text(Page(analysis)), "Flow ratio"));
}

}  // namespace
}  // namespace trammel::report
