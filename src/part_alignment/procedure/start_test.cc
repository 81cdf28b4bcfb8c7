// Tests of a first alignment's start: questions by a script of lines, and a machine's facts.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>

#include "part_alignment/procedure/start_dialogue.h"
#include "support/matchers.h"

namespace trammel::procedure {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Types one line after the other, then goes away.
class ScriptedOperator : public Operator {
 public:
  explicit ScriptedOperator(std::deque<std::string> lines) : lines_(std::move(lines)) {}
  Result<void> CheckCanAnswer(const std::string&) const override { return {}; }
  bool AnsweredBefore(const std::string&) const override { return false; }
  Result<bool> Confirm(const Question&, const std::function<Result<void>()>&) override {
    return Fail("nothing to confirm");
  }
  Result<std::optional<std::string>> LineWithin(double) override {
    if (std::exchange(waits_, !waits_)) return std::optional<std::string>();
    if (lines_.empty()) {
      return tl::unexpected(Error{ErrorKind::kInterrupted, "nobody is there any more"});
    }
    std::string line = lines_.front();
    lines_.pop_front();
    return std::optional(line);
  }

 private:
  std::deque<std::string> lines_;
  bool waits_ = true;
};

std::vector<StartQuestion> Questions() {
  const auto numbers = [](std::size_t count) {
    return [count](const std::string& text) -> Result<void> {
      TRY(ParseNumbers(text, count));
      return {};
    };
  };
  return {{"rough", "about where the part's origin is, X,Y,Z mm", "", numbers(3), "400,250,-450"},
          {"distance", "from camera to target, mm", "300", numbers(1)}};
}

TEST(StartDialogue, AsksAgainUntilAnAnswerDoesAndTakesAnEmptyLineForTheFallback) {
  ScriptedOperator person({"", "1,2", " 1,2,-3.5 ", ""});
  std::string said;
  StartAnswers answers;
  Must(AnswerQuestions(
      Questions(), &person, [&](const std::string& text) { said += text; }, answers));
  EXPECT_EQ(answers, (StartAnswers{{"rough", "1,2,-3.5"}, {"distance", "300"}}));
  EXPECT_THAT(said, Containing("an answer is needed, such as 400,250,-450\n",
                               "\"1,2\" is not 3 numbers", "from camera to target, mm [300]: "));
}

TEST(StartDialogue, EndsWithThePersonWhoHasNoAnswer) {
  ScriptedOperator person({"", "", "", "", ""});
  std::string said;
  StartAnswers answers;
  EXPECT_THAT(AnswerQuestions(
                  Questions(), &person, [&](const std::string& text) { said += text; }, answers),
              FailsWith(ErrorKind::kInput, "--rough 400,250,-450", "about where the part's"));
}

TEST(StartDialogue, AsksNothingThatWasAnsweredBeforehand) {
  ScriptedOperator person({});
  StartAnswers answers{{"rough", "1,2,3"}, {"distance", "250"}};
  std::string said;
  const auto asked = AnswerQuestions(
      Questions(), &person, [&](const std::string& text) { said += text; }, answers);
  EXPECT_TRUE(asked);
  EXPECT_EQ(said, "");
}

TEST(StartDialogue, WithoutAPersonNamesAllOptionsThatAreMissing) {
  StartAnswers answers{{"distance", "250"}};
  EXPECT_THAT(AnswerQuestions(
                  Questions(), nullptr, [](const std::string&) {}, answers),
              FailsWith("no terminal", "--rough: about", Not(HasSubstr("--distance"))));
  answers = {{"rough", "1,2,3"}};
  ASSERT_TRUE(AnswerQuestions(
      Questions(), nullptr, [](const std::string&) {}, answers));
  EXPECT_EQ(answers["distance"], "300");
  answers = {{"rough", "1,2,nan"}};
  EXPECT_THAT(AnswerQuestions(
                  Questions(), nullptr, [](const std::string&) {}, answers),
              FailsWith("--rough: \"1,2,nan\" is not 3 numbers"));
}

TEST(StartDialogue, EndsWithThePersonWhoGoesAway) {
  ScriptedOperator person({"1,2,3"});
  StartAnswers answers;
  EXPECT_THAT(AnswerQuestions(
                  Questions(), &person, [](const std::string&) {}, answers),
              FailsWith(ErrorKind::kInterrupted));
}

TEST(StartDialogue, ReadsBoxes) {
  EXPECT_TRUE(ParseBoxes("none")->empty());
  EXPECT_EQ(ParseBoxes("1,2,3,4,5,6 -1,-2,-3,0,0,0")->size(), 12U);
  EXPECT_FALSE(ParseBoxes("1,2,3"));
  EXPECT_FALSE(ParseNumbers("1,2,3,", 3));
  EXPECT_FALSE(ParseNumbers("1;2;3", 3));
  EXPECT_FALSE(ParseNumbers("1e999,2,3", 3));
}

/// Returns a machine without contradictions.
machine::LinuxCncFacts Ready() {
  machine::LinuxCncFacts facts;
  facts.state.estop = false;
  facts.state.on = facts.state.homed = facts.state.spindle_stopped = true;
  facts.state.idle = facts.state.metric = true;
  facts.axes = "XYZC";
  facts.travel = {{0, 0, -500}, {2000, 1000, 0}};
  facts.joints = 4;
  return facts;
}

StartRequest Request() { return {true, {{0, 0, -500}, {2000, 1000, 0}}, -1}; }

// The only one, where it forbids or not.
void ExpectOne(const machine::LinuxCncFacts& facts, const StartRequest& request,
               const std::string& what, const std::string& remedy, bool forbids) {
  const auto found = CheckMachine(facts, request);
  ASSERT_EQ(found.size(), 1U) << what;
  EXPECT_THAT(found[0].what, HasSubstr(what));
  EXPECT_THAT(found[0].remedy, HasSubstr(remedy));
  EXPECT_EQ(found[0].forbids, forbids) << what;
}

TEST(StartChecks, SayNothingOfAMachineThatIsReady) {
  EXPECT_TRUE(CheckMachine(Ready(), Request()).empty());
  EXPECT_TRUE(CheckRequest(Request()).empty());
  EXPECT_EQ(FactsText(Ready()),
            "axes XYZC, unit 1 mm, X 0 … 2000, Y 0 … 1000, Z -500 … 0 mm, no "
            "tool in the spindle, 0 in the table");
}

TEST(StartChecks, NameEachContradictionWithItsRemedy) {
  const auto changed = [](const auto& change) {
    machine::LinuxCncFacts facts = Ready();
    change(facts);
    return facts;
  };
  using Facts = machine::LinuxCncFacts;
  const StartRequest request = Request();
  ExpectOne(changed([](Facts& of) {
              of.state.metric = false;
              of.unit_mm = 25.4;
            }),
            request, "unit is 25.4 mm", "LINEAR_UNITS = mm", true);
  ExpectOne(changed([](Facts& of) { of.axes = "XYZ"; }), request, "no axis C among XYZ",
            "--spindle locked", true);
  ExpectOne(changed([](Facts& of) { of.axes = "XYC"; }), request, "no axis Z among XYC", "needed",
            true);
  ExpectOne(changed([](Facts& of) { of.travel.high_mm.x() = 1500; }), request,
            "--travel X 0 … 2000", "leave --travel out", true);
  ExpectOne(changed([](Facts& of) { of.travel.high_mm.z() = -500; }), request, "which is none",
            "MIN_LIMIT", true);
  ExpectOne(changed([](Facts& of) { of.state.estop = true; }), request, "emergency stop",
            "release it", false);
  ExpectOne(changed([](Facts& of) { of.state.on = false; }), request, "power is off",
            "switch it on", false);
  ExpectOne(changed([](Facts& of) {
              of.not_homed = {1, 3};
              of.state.homed = false;
            }),
            request, "joint 1, 3 of 0 … 3 is not homed", "home the machine", false);
  ExpectOne(changed([](Facts& of) { of.state.idle = false; }), request, "runs a program",
            "choose MANUAL", false);
  ExpectOne(changed([](Facts& of) { of.state.spindle_stopped = false; }), request,
            "the spindle turns", "stop it", false);
  ExpectOne(changed([](Facts& of) { of.state.feed_override = 0; }), request, "feed override",
            "turn it up", false);
  ExpectOne(changed([](Facts& of) { of.state.c_deg = 37; }), request, "C stands at 37.0000",
            "turn it to 0", false);
  ExpectOne(changed([](Facts& of) {
              of.tool = 7;
              of.tool_length_mm = 120.5;
            }),
            request, "tool 7 is in the spindle, by the tool table 120.5 mm long", "take it out",
            false);
  StartRequest locked = Request();
  locked.c_holds_spindle = false;
  EXPECT_TRUE(CheckMachine(changed([](Facts& of) {
                             of.axes = "XYZ";
                             of.state.c_axis = false;
                           }),
                           locked)
                  .empty());
}

TEST(StartChecks, NameATravelThatIsNoneAndASafeHeightOutsideOfIt) {
  StartRequest request = Request();
  request.safe_z_mm = 10;
  ASSERT_EQ(CheckRequest(request).size(), 1U);
  EXPECT_THAT(CheckRequest(request)[0].what, HasSubstr("--safe-z 10"));
  request.travel.high_mm.x() = -1;
  ASSERT_EQ(CheckRequest(request).size(), 1U);
  EXPECT_THAT(CheckRequest(request)[0].what, HasSubstr("is no travel"));
}

TEST(StartChecks, FindThePrefixOfTargetsAndCodesThatThereAreNot) {
  const auto book = Must(part_alignment::MakeCodeBook(14));
  const TargetIds sound = CheckIds({{"T1", {}}, {"T44", {}}}, book);
  EXPECT_EQ(sound.prefix, "T");
  EXPECT_TRUE(sound.contradictions.empty());
  EXPECT_EQ(CheckIds({{"7", {}}}, book).prefix, "");
  for (const char* id : {"T45", "U2", "T", "T02", "T99999999999999999999"}) {
    const TargetIds wrong = CheckIds({{"T1", {}}, {id, {}}}, book);
    ASSERT_EQ(wrong.contradictions.size(), 1U) << id;
    EXPECT_THAT(wrong.contradictions[0].what, HasSubstr(fmt::format("target {} is no code", id)));
  }
}

}  // namespace
}  // namespace trammel::procedure
