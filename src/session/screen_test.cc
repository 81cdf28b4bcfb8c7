#include "session/screen.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "session/fake_printer.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;
using testing::FakePrinter;

TEST(Screen, SpeaksInTheConsoleAndOnTheDisplay) {
  FakePrinter printer;
  Screen screen(printer);
  ASSERT_TRUE(screen.Show("scanning line 1 of 10", {1}));
  EXPECT_THAT(printer.scripts, ElementsAre("TRAMMEL_SAY MSG=\"scanning line 1 of 10\"\n"
                                           "M117 scanning line 1 of 10"));
}

TEST(Screen, UsesWhatThePrinterHas) {
  FakePrinter printer;
  printer.unknown = {{"TRAMMEL_SAY", true}, {"M117", true}};
  Screen with_respond(printer);
  ASSERT_TRUE(with_respond.Show("a", {1}));
  printer.unknown["RESPOND"] = true;
  Screen with_m118(printer);
  ASSERT_TRUE(with_m118.Show("b", {1}));
  printer.unknown["M118"] = true;
  Screen mute(printer);
  ASSERT_TRUE(mute.Show("c", {1}));
  EXPECT_THAT(printer.scripts,
              ElementsAre("RESPOND TYPE=echo MSG=\"trammel: a\"", "M118 trammel: b"));
}

// Klipper takes RESPOND then, and tells of no macro.
class SpeaksInShutdown : public FakePrinter {
 public:
  Result<void> Run(std::string_view script, const machine::WaitLimit&) override {
    scripts.emplace_back(script);
    return {};
  }
};

TEST(Screen, LooksAgainOnceThePrinterIsBackFromItsShutdown) {
  SpeaksInShutdown printer;
  printer.state.readiness = machine::PrinterReadiness::kShutdown;
  printer.unknown = {{"TRAMMEL_SAY", true}, {"TRAMMEL_ASK", true}, {"M117", true}};
  Screen screen(printer);
  ASSERT_TRUE(screen.Show("a", {1}));
  printer.state.readiness = machine::PrinterReadiness::kReady;
  printer.unknown.clear();
  ASSERT_TRUE(screen.Ask("b", Buttons::kClose, {}, {1}));
  EXPECT_THAT(printer.scripts, ElementsAre("RESPOND TYPE=echo MSG=\"trammel: a\"",
                                           "TRAMMEL_ASK BUTTONS=close MSG=\"b\""));
}

TEST(Screen, AsksWhereThePrinterHasDialogs) {
  FakePrinter printer;
  Screen screen(printer);
  ASSERT_TRUE(screen.Ask("0.0172 s | \"was\" 0.04", Buttons::kUse, {}, {1}));
  ASSERT_TRUE(
      screen.Ask("empty?", Buttons::kStart, {{"filament", "pla__2b"}, {"temp", "1 M112"}}, {1}));
  ASSERT_TRUE(screen.Ask("paper?", Buttons::kSheet, {{"tools", "0,1"}}, {1}));
  EXPECT_THAT(printer.scripts,
              ElementsAre("TRAMMEL_ASK BUTTONS=use MSG=\"0.0172 s   was 0.04\"",
                          "TRAMMEL_ASK BUTTONS=start FILAMENT=pla__2b MSG=\"empty?\"",
                          "TRAMMEL_ASK BUTTONS=sheet TOOLS=0,1 MSG=\"paper?\""));
  FakePrinter older;
  older.unknown["TRAMMEL_ASK"] = true;
  Screen without(older);
  EXPECT_TRUE(without.Ask("a", Buttons::kClose, {}, {1}));
  EXPECT_THAT(older.scripts, ElementsAre());
}

TEST(Screen, WhatIsSaidAfterADialogClosesItWhereThePrinterCan) {
  for (const bool can : {true, false}) {
    FakePrinter printer;
    if (!can) printer.unknown["_TRAMMEL_CLOSE"] = true;
    Screen screen(printer);
    ASSERT_TRUE(screen.Ask("b", Buttons::kClose, {}, {1}));
    ASSERT_TRUE(screen.Show("at work", {1}));
    EXPECT_EQ(printer.scripts.back().ends_with("\n_TRAMMEL_CLOSE"), can);
    ASSERT_TRUE(screen.Show("done", {1}));
    EXPECT_FALSE(printer.scripts.back().ends_with("_TRAMMEL_CLOSE"));
  }
}

TEST(Screen, NothingThatIsSaidCanBecomeACommand) {
  EXPECT_EQ(Screen::Plain("a\" ;b #c*d\\e 60 °C\nG28"), "a b c d e 60 C");
  const std::string cause = "The cause. ";
  const std::string remedy = " The remedy.";
  const std::string shown = Screen::Plain(cause + std::string(2000, 'x') + remedy);
  EXPECT_EQ(shown.size(), 1000U);
  EXPECT_THAT(shown, ::testing::StartsWith(cause));
  EXPECT_THAT(shown, ::testing::EndsWith(remedy));
  EXPECT_THAT(shown, ::testing::HasSubstr("x ... x"));
  EXPECT_EQ(Screen::Plain(std::string(1000, 'x')).size(), 1000U);
  EXPECT_EQ(Screen::Plain(""), "");
}

TEST(ProgressLine, ComesBackAsItWasSaid) {
  const Progress said{.text = "scanning \"line\"\n2 \xC2\xB5m",
                      .remaining_s = 40.5,
                      .phase = "scanning",
                      .done = 0.25};
  const std::string line = ProgressLine(said);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const auto heard = ParseProgressLine(line);
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->text, said.text);
  EXPECT_EQ(heard->remaining_s, said.remaining_s);
  EXPECT_EQ(heard->phase, said.phase);
  EXPECT_EQ(heard->done, said.done);
}

}  // namespace
}  // namespace trammel::procedure
