#include "part_alignment/survey/survey.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"
#include "part_alignment/survey/survey_test_support.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using ::testing::HasSubstr;

std::string Notices(const Survey& survey) {
  std::string all;
  for (const std::string& notice : survey.notices) all += notice + "\n";
  return all;
}

/// Targets that are named as seen too little.
std::size_t NotGiven(const Survey& survey) {
  return static_cast<std::size_t>(std::count_if(
      survey.notices.begin(), survey.notices.end(),
      [](const std::string& notice) { return notice.find("is not given") != std::string::npos; }));
}

/// Targets that any picture shows.
std::size_t Shown(const SurveyInput& input) {
  std::set<std::string> ids;
  for (const auto& picture : input.pictures) {
    for (const auto& observation : picture.observations) ids.insert(observation.target);
  }
  return ids.size();
}

bool Gives(const Survey& survey, const std::string& id) {
  return std::any_of(survey.targets.begin(), survey.targets.end(),
                     [&](const SurveyedTarget& target) { return target.id == id; });
}

std::vector<SurveyPicture>::iterator PictureWith(SurveyInput& input,
                                                 const std::vector<std::string>& ids) {
  return std::find_if(input.pictures.begin(), input.pictures.end(), [&](const auto& picture) {
    return std::all_of(ids.begin(), ids.end(), [&](const std::string& id) {
      return std::any_of(picture.observations.begin(), picture.observations.end(),
                         [&](const Observation& observation) { return observation.target == id; });
    });
  });
}

Observation& ObservationOf(SurveyPicture& picture, const std::string& id) {
  return *std::find_if(picture.observations.begin(), picture.observations.end(),
                       [&](const Observation& observation) { return observation.target == id; });
}

// Unlikely by 1e-5 either way.
void ExpectConsistent(const test::SurveyWorld& world, const Survey& survey) {
  ASSERT_EQ(survey.verdict, Verdict::kGood) << survey.reason;
  EXPECT_FALSE(IsWrong(world, survey));
  const auto errors = test::ErrorsOf(world, survey);
  EXPECT_GT(errors.nees, ChiSquareQuantile(1e-5, errors.freedom));
}

TEST(Survey, FindsAllTargetsWithinItsCovariance) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const test::SurveyWorld world = SmallWorld(seed);
    const SurveyInput input = test::Photograph(world, seed);
    const Survey survey = Solved(input);
    EXPECT_EQ(survey.targets.size() + NotGiven(survey), Shown(input));
    EXPECT_GE(survey.targets.size(), 36U);
    EXPECT_LT(survey.check.rejected_share(), 0.01);
    EXPECT_GT(survey.check.redundancy, 500);
    EXPECT_NEAR(survey.variance_root, 1, 0.1);
    EXPECT_NEAR(survey.lens[kFocal], 2773, 5 * survey.lens_sigma[kFocal]);
    ExpectConsistent(world, survey);
  }
}

TEST(Survey, IsExactWithoutNoise) {
  test::SurveyScene scene = SmallScene();
  scene.bar_sigma_mm = 1e-9;
  test::SurveyWorld world = test::MakeSurveyWorld(scene, 1);
  world.scene.sigma_px = 1e-9;
  SurveyInput input = test::Photograph(world, 1);
  for (auto& picture : input.pictures) {
    for (auto& observation : picture.observations) observation.sigma_px = 0.03;
  }
  for (ScaleBar& bar : input.bars) bar.sigma_mm = 0.01;
  const Survey survey = Solved(input);
  ASSERT_EQ(survey.verdict, Verdict::kGood) << survey.reason;
  constexpr double kExact_mm = 1e-5;  // the adjustment ends where nothing is gained
  EXPECT_LT(test::ErrorsOf(world, survey).coordinates.cwiseAbs().maxCoeff(), kExact_mm);
}

TEST(Survey, SolvesAFlatPartWithoutAFocalLength) {
  test::SurveyScene scene = SmallScene();
  scene.flat = true;
  for (const auto& [seed, focal] : {std::pair<std::uint64_t, double>{1, 2000}, {2, 7500}}) {
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", focal length " << focal);
    scene.focal_px = focal;
    scene.distance_mm = 2500 * focal / 2773;
    const test::SurveyWorld world = test::MakeSurveyWorld(scene, seed);
    ExpectConsistent(world, Solved(test::Photograph(world, seed)));
  }
}

TEST(Survey, NamesExchangedCodes) {
  const test::SurveyWorld world = SmallWorld(6);
  SurveyInput input = test::Photograph(world, 6);
  const auto picture = PictureWith(input, {"1", "8"});
  ASSERT_NE(picture, input.pictures.end());
  std::swap(ObservationOf(*picture, "1").target, ObservationOf(*picture, "8").target);
  const Survey survey = Solved(input);
  EXPECT_THAT(Notices(survey),
              HasSubstr("in " + picture->name + " the targets 1 and 8 are exchanged"));
  ExpectConsistent(world, survey);
}

TEST(Survey, LeavesOutSingleErrorsOfHalfAPixel) {
  const test::SurveyWorld world = SmallWorld(8);
  SurveyInput input = test::Photograph(world, 8);
  for (const std::string id : {"1", "2", "7", "8", "13"}) {
    ObservationOf(*PictureWith(input, {id}), id).row_px += 0.5;
  }
  const Survey survey = Solved(input);
  EXPECT_EQ(survey.outliers.size(), 5U);
  ExpectConsistent(world, survey);
}

TEST(Survey, NamesAMovedTarget) {
  for (const double by_mm : {0.4, 5.0, 300.0}) {
    SCOPED_TRACE(by_mm);
    test::SurveyWorld world = SmallWorld(9);
    for (std::size_t s = 22; s < world.shots.size(); ++s) {
      world.shots[s].displaced_mm["8"] = {0, 0.6 * by_mm, 0.8 * by_mm};
    }
    const SurveyInput input = test::Photograph(world, 9);
    const Survey survey = Solved(input);
    EXPECT_THAT(Notices(survey), HasSubstr("target 8 moved by"));
    EXPECT_FALSE(Gives(survey, "8"));
    EXPECT_EQ(survey.targets.size() + NotGiven(survey), Shown(input) - 1);
    ExpectConsistent(world, survey);
  }
}

TEST(Survey, NamesAChangeOfTheFocalLength) {
  for (const double factor : {1.0005, 1.01, 1.1, 0.7}) {
    SCOPED_TRACE(factor);
    test::SurveyWorld world = SmallWorld(12);
    for (std::size_t s = 20; s < world.shots.size(); ++s) world.shots[s].focal_px *= factor;
    const Survey survey = Solved(test::Photograph(world, 12));
    EXPECT_EQ(survey.verdict, Verdict::kRefused) << Notices(survey);
    EXPECT_THAT(survey.reason, HasSubstr("focal length"));
  }
}

// Four of its pictures show eight or nine targets, which other focal lengths seem to explain, too.
TEST(Survey, SeesNoChangeOfTheFocalLengthInPicturesOfFewTargets) {
  const test::SurveyWorld world = test::MakeSurveyWorld({}, 500023);
  const Survey survey = Solved(test::Photograph(world, 500023));
  EXPECT_EQ(survey.verdict, Verdict::kGood) << survey.reason;
  ExpectConsistent(world, survey);
}

TEST(Survey, LeavesOutAPictureOfAnotherPart) {
  const test::SurveyWorld world = SmallWorld(13);
  const test::SurveyWorld other = SmallWorld(1013);
  SurveyInput input = test::Photograph(world, 13);
  input.pictures[17] = test::Photograph(other, 14).pictures[3];
  input.pictures[17].name = "stray";
  const Survey survey = Solved(input);
  EXPECT_THAT(Notices(survey), HasSubstr("stray is left out"));
  EXPECT_FALSE(survey.stations[17].used);
  ExpectConsistent(world, survey);
}

TEST(Survey, RefusesPicturesOfDifferentSizes) {
  SurveyInput input = test::Photograph(SmallWorld(15), 15);
  std::swap(input.pictures[4].width_px, input.pictures[4].height_px);
  EXPECT_THAT(Solved(input), Answers(Verdict::kRefused, "p5 has 3000 x 4000 px"));
}

TEST(Survey, CannotTellFromTooFewPictures) {
  test::SurveyScene scene = SmallScene();
  for (const int pictures : {0, 1, 5}) {
    SCOPED_TRACE(pictures);
    scene.pictures = pictures;
    EXPECT_THAT(Solved(test::Photograph(test::MakeSurveyWorld(scene, 18), 18)),
                Answers(Verdict::kCannotTell, "pictures show four coded targets or more"));
  }
  scene.pictures = 40;
  SurveyInput input = test::Photograph(test::MakeSurveyWorld(scene, 18), 18);
  for (auto& picture : input.pictures) picture.observations.clear();
  EXPECT_THAT(Solved(input).reason, HasSubstr("0 of 40 pictures show four"));
}

TEST(Survey, CannotTellFromTwoPartsThatHangTogetherNowhere) {
  test::SurveyScene scene = SmallScene();
  SurveyInput input = test::Photograph(test::MakeSurveyWorld(scene, 19), 19);
  SurveyInput other = test::Photograph(test::MakeSurveyWorld(scene, 1019), 20);
  for (std::size_t s = 0; s < 20; ++s) {
    input.pictures[s] = other.pictures[s];
    for (auto& observation : input.pictures[s].observations)
      observation.target = "other " + observation.target;
  }
  EXPECT_THAT(Solved(input), Answers(Verdict::kCannotTell, "hang together"));
}

// Whatever the pictures show: an answer that is not good.
TEST(Survey, HasNoCoordinatesOfNonsense) {
  Random random(22);
  for (const int kind : {0, 1, 2, 3, 4}) {
    SCOPED_TRACE(kind);
    SurveyInput input;
    for (int s = 0; s < 12; ++s) {
      SurveyPicture& picture = input.pictures.emplace_back();
      picture = {"p" + std::to_string(s + 1), 4000, 3000, {}, {}};
      for (int i = 0; i < 15; ++i) {
        Eigen::Vector2d pixel{random.Uniform(0, 3999), random.Uniform(0, 2999)};
        const Eigen::Vector2d noise(0.03 * random.Normal(), 0.03 * random.Normal());
        if (kind == 1) pixel = Eigen::Vector2d::Constant(1000) + noise;   // all in one place
        if (kind == 2) pixel = Eigen::Vector2d(250.0 * i, 1500) + noise;  // stationary, on one line
        if (kind == 3)
          pixel = Eigen::Vector2d(250.0 * i, 100.0 * ((7 * i) % 15)) + noise;  // from one position
        if (kind == 4) pixel = Eigen::Vector2d(2000, 1500) + 3e3 * noise;      // about the middle
        picture.observations.push_back({std::to_string(i), pixel.x(), pixel.y(), 0.03});
      }
    }
    input.bars = {{"0", "1", 1000, 0.01}, {"2", "3", 1000, 0.01}};
    EXPECT_NE(Solved(input).verdict, Verdict::kGood);
  }
}

TEST(Survey, NamesAFocalLengthInAnotherUnit) {
  SurveyInput input = test::Photograph(SmallWorld(23), 23);
  input.focal_length_px = 24;  // mm
  EXPECT_THAT(Solved(input), Answers(Verdict::kCannotTell, "focal length that is given, 24 px"));
}

TEST(Survey, RefusesInputThatCannotBe) {
  struct Row {
    const char* words;
    std::function<void(SurveyInput&)> spoil;
  };
  const Row rows[] = {
      {"p5 (copy) of p5",
       [](SurveyInput& input) {
         input.pictures.push_back(input.pictures[4]);
         input.pictures.back().name = "p5 (copy)";
       }},
      {"lies outside of a picture of 4000 x 3000 px",
       [](SurveyInput& input) { input.pictures[3].observations[0].row_px = 3200; }},
      {"902-901 stands there twice",
       [](SurveyInput& input) {
         input.bars.push_back(input.bars[0]);
         std::swap(input.bars.back().from, input.bars.back().to);
       }},
      {"both are in mm", [](SurveyInput& input) { input.bars[0].length_mm /= 1000; }},
      {"has one end", [](SurveyInput& input) { input.bars[0].to = input.bars[0].from; }},
      {"sigma -1 mm", [](SurveyInput& input) { input.bars[0].sigma_mm = -1; }},
      {"sigma 1e-06 mm", [](SurveyInput& input) { input.bars[0].sigma_mm = 1e-6; }},
      {"p4: target", [](SurveyInput& input) { input.pictures[3].observations[0].row_px = NAN; }},
      {"p4: a plain point",
       [](SurveyInput& input) {
         input.pictures[3].plain = {{9, 9, NAN}};
       }},
      {"sigma above 0", [](SurveyInput& input) { input.pictures[3].observations[0].sigma_px = 0; }},
      {"stands twice", [](SurveyInput& input) {
         input.pictures[3].observations.push_back(input.pictures[3].observations[0]);
       }}};
  const SurveyInput sound = test::Photograph(SmallWorld(21), 21);
  for (const Row& row : rows) {
    SurveyInput input = sound;
    row.spoil(input);
    EXPECT_THAT(SolveSurvey(input, {}), FailsWith(row.words)) << row.words;
  }
}

}  // namespace
}  // namespace trammel::part_alignment
