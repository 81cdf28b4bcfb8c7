// Surveys of which a part contradicts the rest: never good and wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "part_alignment/survey/survey_test_support.h"

namespace trammel::part_alignment {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

constexpr std::uint64_t kSeed = 700;

std::string ReasonText(const Survey& survey) {
  std::string words = survey.reason + "\n";
  for (const std::string& notice : survey.notices) words += notice + "\n";
  for (const std::string& unchecked : survey.unchecked) words += "unchecked: " + unchecked + "\n";
  return words;
}

// With three bars, adds one along the part, between two of its targets.
test::SurveyWorld WorldOf(std::uint64_t seed, std::size_t bars) {
  test::SurveyWorld world = SmallWorld(seed);
  if (bars == 1) world.bars.pop_back();
  if (bars == 3) {
    const auto& from = world.targets.at("1");
    const auto& to = world.targets.at("2");
    world.bars.push_back({"1", "2", (to.at_mm - from.at_mm).norm(), 0.01});
  }
  return world;
}

// Each bar in turn: by mm and by a factor; its ends taken for others.
std::vector<std::function<void(ScaleBar&)>> WrongBars() {
  std::vector<std::function<void(ScaleBar&)>> wrong;
  for (const double by_mm : {-0.5, 0.5, 100.0}) {
    wrong.emplace_back([by_mm](ScaleBar& bar) { bar.length_mm += by_mm; });
  }
  wrong.emplace_back([](ScaleBar& bar) {
    bar.length_mm *= 1.02;
    bar.sigma_mm = 1e-5 * bar.length_mm;
  });
  wrong.emplace_back([](ScaleBar& bar) { bar.to = "7"; });
  return wrong;
}

TEST(SurveyContradiction, AWrongBarIsNamedOrTheAnswerIsNotGoodOrItsHeadNamesTheBarAsUnchecked) {
  for (const std::size_t bars : {1U, 2U, 3U}) {
    const test::SurveyWorld world = WorldOf(kSeed, bars);
    const SurveyInput sound = test::Photograph(world, kSeed);
    std::size_t turn = 0;
    for (const auto& wrong : WrongBars()) {
      SurveyInput input = sound;
      const std::size_t of = turn++ % bars;
      wrong(input.bars[of]);
      SCOPED_TRACE(testing::Message() << "bar " << of << " of " << bars << ", fault " << turn);
      const Survey survey = Solved(input);
      const std::string name = input.bars[of].from + "-" + input.bars[of].to;
      EXPECT_THAT(ReasonText(survey), HasSubstr(name));
      if (bars == 1) {
        ASSERT_EQ(survey.unchecked.size(), 1U);
        EXPECT_THAT(survey.unchecked[0], HasSubstr(name));
        continue;
      }
      if (bars == 2) {
        EXPECT_EQ(survey.verdict, Verdict::kRefused);
        continue;
      }
      EXPECT_EQ(survey.verdict, Verdict::kGood) << survey.reason;
      EXPECT_FALSE(survey.bars[of].test.used);
      EXPECT_EQ(survey.check.rejected, static_cast<int>(survey.outliers.size()));
      EXPECT_FALSE(IsWrong(world, survey));
    }
  }
}

TEST(SurveyContradiction, EndsExchangedBetweenBarsRefuseAllOfThem) {
  for (const std::size_t bars : {2U, 3U}) {
    SurveyInput input = test::Photograph(WorldOf(kSeed, bars), kSeed);
    std::swap(input.bars[0].to, input.bars[1].to);
    EXPECT_EQ(Solved(input).verdict, Verdict::kRefused);
    std::swap(input.bars[0].to, input.bars[1].from);
    EXPECT_EQ(Solved(input).verdict, Verdict::kRefused);
  }
}

// The test of two bars states the error that it cannot detect.
TEST(SurveyContradiction, ABarWrongByTwiceWhatIsStatedAsDetectableIsDetected) {
  const SurveyInput sound = test::Photograph(WorldOf(kSeed, 2), kSeed);
  const Survey before = Solved(sound);
  ASSERT_EQ(before.verdict, Verdict::kGood) << before.reason;
  for (std::size_t of = 0; of < 2; ++of) {
    const double detectable_mm = before.bars[of].test.detectable_mm;
    EXPECT_GT(detectable_mm, 0.05);
    EXPECT_LT(detectable_mm, 0.3);
    SurveyInput input = sound;
    input.bars[of].length_mm += 2 * detectable_mm;
    EXPECT_EQ(Solved(input).verdict, Verdict::kRefused);
  }
}

// A focal length is where the search begins: it does not reach the answer.
TEST(SurveyContradiction, AWrongFocalLengthChangesNoCoordinate) {
  const test::SurveyWorld world = WorldOf(kSeed, 2);
  SurveyInput input = test::Photograph(world, kSeed);
  for (const double factor : {0.5, 0.95, 1.3}) {
    input.focal_length_px = 2773 * factor;
    const Survey survey = Solved(input);
    EXPECT_EQ(survey.verdict == Verdict::kGood && IsWrong(world, survey), false) << factor;
  }
}

TEST(SurveyContradiction, APartOfWhichHalfMovedIsNotMeasured) {
  constexpr std::size_t kFirstAfter = 20;
  for (const double share : {0.35, 0.5}) {
    for (const double by_mm : {0.3, 5.0}) {
      SCOPED_TRACE(testing::Message()
                   << share << " of it by " << by_mm << " mm before " << kFirstAfter + 1);
      test::SurveyWorld world = SmallWorld(kSeed);
      for (std::size_t s = kFirstAfter; s < world.shots.size(); ++s) {
        for (const auto& [id, target] : world.targets) {
          if (target.at_mm.x() > 2000 * (0.5 - share)) {
            world.shots[s].displaced_mm[id] = {0.6 * by_mm, 0, 0.8 * by_mm};
          }
        }
      }
      const Survey survey = Solved(test::Photograph(world, kSeed));
      EXPECT_NE(survey.verdict, Verdict::kGood) << ReasonText(survey);
      EXPECT_THAT(survey.reason, AnyOf(HasSubstr("contradict"), HasSubstr("changed its shape"),
                                       HasSubstr("focal length"), HasSubstr("hang together"),
                                       HasSubstr("a part that bends")));
    }
  }
}

TEST(SurveyContradiction, ACodeMisreadInAThirdOfThePicturesIsNamed) {
  for (const char* read_as : {"99", "8", "13"}) {
    for (const std::size_t every : {1U, 2U, 3U}) {
      SCOPED_TRACE(testing::Message() << "7 as " << read_as << " in 1 of " << every);
      const test::SurveyWorld world = SmallWorld(kSeed);
      SurveyInput input = test::Photograph(world, kSeed);
      std::size_t shown = 0;
      for (SurveyPicture& picture : input.pictures) {
        for (Observation& observation : picture.observations) {
          if (observation.target != "7" || shown++ % every != 0) continue;
          std::erase_if(picture.observations,
                        [&](const Observation& other) { return other.target == read_as; });
          for (Observation& misread : picture.observations) {
            if (misread.target == "7") misread.target = read_as;
          }
          break;
        }
      }
      Survey survey = Solved(input);
      if (survey.verdict != Verdict::kGood) {
        EXPECT_THAT(survey.reason, HasSubstr("contradict"));
        continue;
      }
      // A code that is read so in all pictures is that target's.
      if (every == 1 && std::string(read_as) == "99") continue;
      std::string named = ReasonText(survey);
      for (const SurveyOutlier& outlier : survey.outliers) named += outlier.seen_there + "\n";
      EXPECT_THAT(named, HasSubstr("7"));
      EXPECT_FALSE(IsWrong(world, survey));
    }
  }
}

}  // namespace
}  // namespace trammel::part_alignment
