// Plain targets of a survey: found among points without names.
#include "part_alignment/survey/survey_plain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "base/statistics.h"
#include "part_alignment/survey/survey.h"
#include "part_alignment/survey/survey_test_support.h"

namespace trammel::part_alignment {
namespace {

using ::testing::HasSubstr;

constexpr double kThere_mm = 1;  // ten sigmas of the least known; neighbours are farther

test::SurveyScene PlainScene() {
  test::SurveyScene scene = SmallScene();
  scene.plain = 60;
  scene.rows = 2;
  scene.row_length = 15;
  scene.stray = 8;
  return scene;
}

/// Plain targets of the world by index, and how many of the survey's are none of them.
struct Found {
  std::set<std::size_t> targets;
  int none = 0;
};
Found FoundIn(const test::SurveyWorld& world, const Survey& survey) {
  Found found;
  for (const auto& nearest : test::NearestPlain(world, survey)) {
    if (nearest.off_mm < kThere_mm) {
      found.targets.insert(nearest.target);
    } else {
      ++found.none;
    }
  }
  return found;
}

/// Plain targets of the world that so many pictures show, if nothing covers them.
int ShownIn(const test::SurveyWorld& world, int least) {
  test::SurveyWorld bare = world;
  bare.scene.stray = 0;
  bare.scene.hidden = 0;
  int shown = 0;
  for (const test::WorldTarget& target : world.plain) {
    bare.plain = {target};
    int pictures = 0;
    for (const auto& picture : test::Photograph(bare, 1).pictures)
      pictures += picture.plain.empty() ? 0 : 1;
    if (pictures >= least) ++shown;
  }
  return shown;
}

int LeftOver(const Survey& survey, const std::string& reason) {
  for (const auto& left : survey.plain.left_over) {
    if (left.reason.find(reason) != std::string::npos) return left.points;
  }
  return 0;
}

void ExpectConsistent(const test::SurveyWorld& world, const Survey& survey) {
  ASSERT_EQ(survey.verdict, Verdict::kGood) << survey.reason;
  const auto errors = test::ErrorsOf(world, survey);
  EXPECT_LT(errors.nees, ChiSquareQuantile(1 - 1e-5, errors.freedom));
  EXPECT_GT(errors.nees, ChiSquareQuantile(1e-5, errors.freedom));
}

TEST(SurveyPlain, FindsTargetsInRowsAndScatteredWithinTheirCovariance) {
  for (const std::uint64_t seed : {1, 2}) {
    SCOPED_TRACE(seed);
    const test::SurveyWorld world = test::MakeSurveyWorld(PlainScene(), seed);
    const SurveyInput input = test::Photograph(world, seed);
    const Survey survey = Solved(input);
    const Found found = FoundIn(world, survey);
    EXPECT_EQ(found.none, 0);
    constexpr double kShare = 0.95;
    EXPECT_GE(static_cast<double>(found.targets.size()), kShare * ShownIn(world, 6));
    EXPECT_EQ(static_cast<std::size_t>(survey.plain.targets), found.targets.size());
    EXPECT_NEAR(survey.plain.variance_root, 1, 0.1);
    ExpectConsistent(world, survey);
    int left = 0;
    for (const auto& left_over : survey.plain.left_over) left += left_over.points;
    EXPECT_EQ(survey.plain.used + left, survey.plain.points);
  }
}

TEST(SurveyPlain, TellsWhatPlainPointsScatterBy) {
  for (const double factor : {0.5, 2.5}) {
    SCOPED_TRACE(factor);
    const test::SurveyWorld world = test::MakeSurveyWorld(PlainScene(), 3);
    SurveyInput input = test::Photograph(world, 3);
    for (auto& picture : input.pictures) {
      for (auto& point : picture.plain) point.sigma_px /= factor;
    }
    const Survey survey = Solved(input);
    EXPECT_NEAR(survey.plain.variance_root, factor, 0.1 * factor);
    EXPECT_NEAR(survey.variance_root, 1, 0.1);
    EXPECT_EQ(FoundIn(world, survey).none, 0);
    ExpectConsistent(world, survey);
  }
}

/// Makes one disc of two neighbours.
/// @param alone  one pair in so many is one of the two in place of the middle; 0: none
/// @return pairs
int Merge(SurveyInput& input, double apart_px, int alone) {
  int pairs = 0;
  for (SurveyPicture& picture : input.pictures) {
    std::vector<PlainPoint> seen;
    for (const PlainPoint& point : picture.plain) {
      const auto near = std::find_if(seen.begin(), seen.end(), [&](const PlainPoint& other) {
        return std::hypot(other.column_px - point.column_px, other.row_px - point.row_px) <
               apart_px;
      });
      if (near == seen.end()) {
        seen.push_back(point);
      } else if (++pairs; alone == 0 || pairs % alone != 0) {
        near->column_px = (near->column_px + point.column_px) / 2;
        near->row_px = (near->row_px + point.row_px) / 2;
      } else if (pairs % (2 * alone) == 0) {
        *near = point;
      }
    }
    picture.plain = seen;
  }
  return pairs;
}

// Oblique views make one disc of two neighbours.
TEST(SurveyPlain, TellsNeighboursThatManyPicturesShowAsOne) {
  test::SurveyWorld world = test::MakeSurveyWorld(PlainScene(), 8);
  std::set<std::size_t> pairs;
  for (std::size_t i = 0, count = world.plain.size(); i < count; ++i) {
    if (world.plain[i].normal.z() < 0.5 || pairs.size() >= 20) continue;
    world.plain.push_back(world.plain[i]);
    world.plain.back().at_mm += Eigen::Vector3d(4.5, 4, 0);
    pairs.insert({i, world.plain.size() - 1});
  }
  SurveyInput input = test::Photograph(world, 8);
  ASSERT_GE(Merge(input, 5, 0), 40);
  const Survey survey = Solved(input);
  const Found found = FoundIn(world, survey);
  EXPECT_EQ(found.none, 0);
  int given = 0;
  for (const std::size_t target : pairs) given += found.targets.contains(target) ? 1 : 0;
  EXPECT_GE(given, static_cast<int>(pairs.size()) - 2);
  ExpectConsistent(world, survey);
}

// One disc of two that lie closer than discs, and now and then one of them alone.
TEST(SurveyPlain, GivesNoneBetweenTwoThatNoPictureTellsApart) {
  constexpr int kAlone = 3;  // one picture in so many shows one of the two
  test::SurveyWorld world = test::MakeSurveyWorld(PlainScene(), 12);
  std::vector<std::size_t> firsts;
  for (std::size_t i = 0, count = world.plain.size(); i < count && firsts.size() < 6; ++i) {
    if (world.plain[i].normal.z() < 0.5) continue;
    firsts.push_back(i);
    world.plain.push_back(world.plain[i]);
    world.plain.back().at_mm += Eigen::Vector3d(3, 2.6, 0);
  }
  world.scene.hidden = 0;
  world.scene.stray = 0;
  SurveyInput input = test::Photograph(world, 12);
  (void)Merge(input, 6, kAlone);
  const Survey survey = Solved(input);
  EXPECT_EQ(FoundIn(world, survey).none, 0) << "amid two";
  EXPECT_GE(LeftOver(survey, "does not tell them apart"), 60);
}

// Their codes are covered but for two or three.
TEST(SurveyPlain, JoinsPicturesThatShowFewCodes) {
  const test::SurveyWorld world = test::MakeSurveyWorld(PlainScene(), 14);
  for (const std::size_t left : {3, 2}) {
    SCOPED_TRACE(left);
    SurveyInput input = test::Photograph(world, 14);
    const std::vector<std::size_t> few = {3, 11, 20, 32};
    for (const std::size_t picture : few) input.pictures[picture].observations.resize(left);
    const Survey survey = Solved(input);
    for (const std::size_t picture : few) {
      EXPECT_TRUE(survey.stations[picture].used) << picture;
      EXPECT_EQ(survey.stations[picture].reason, "");
    }
    EXPECT_EQ(FoundIn(world, survey).none, 0);
    ExpectConsistent(world, survey);
  }
}

TEST(SurveyPlain, JoinsNoPictureOfAnotherPart) {
  const test::SurveyWorld world = test::MakeSurveyWorld(PlainScene(), 15);
  const test::SurveyWorld another = test::MakeSurveyWorld(PlainScene(), 16);
  SurveyInput input = test::Photograph(world, 15);
  SurveyPicture strange = test::Photograph(another, 16).pictures[5];
  strange.observations.resize(3);
  input.pictures[5] = strange;
  const Survey survey = Solved(input);
  EXPECT_FALSE(survey.stations[5].used);
  EXPECT_EQ(FoundIn(world, survey).none, 0);
}

TEST(SurveyPlain, TakesNothingForATargetWhoseOutlinesAreNoDiscs) {
  const test::SurveyWorld world = test::MakeSurveyWorld(PlainScene(), 20);
  SurveyInput input = test::Photograph(world, 20);
  // Flat discs facing up, of the right size and tilt in each picture, but for what looks long.
  test::SurveyWorld bare = world;
  bare.scene.stray = 0;
  bare.plain.clear();
  for (const test::WorldTarget& target : world.plain) {
    if (target.normal.z() > 0.5) bare.plain.push_back(target);
  }
  ASSERT_GE(bare.plain.size(), 40U);
  constexpr std::size_t kLong = 5;  // the first of them
  for (std::size_t s = 0; s < input.pictures.size(); ++s) {
    input.pictures[s].plain.clear();
    for (std::size_t i = 0; i < bare.plain.size(); ++i) {
      test::SurveyWorld one = bare;
      one.plain = {bare.plain[i]};
      one.scene.hidden = 0;
      one.shots = {world.shots[s]};
      const std::vector<PlainPoint> seen = test::Photograph(one, 1000 * s + i).pictures[0].plain;
      if (seen.empty()) continue;
      const test::WorldShot& shot = world.shots[s];
      const Eigen::Vector3d ray = bare.plain[i].at_mm - shot.place_mm;
      const double tilt = std::abs(ray.normalized().z());
      const double major_px = 4 * shot.focal_px / ray.dot(shot.ahead);
      // The minor axis lies along where the normal is seen to point.
      const double up_right =
          shot.right.z() - ray.dot(shot.right) / ray.dot(shot.ahead) * shot.ahead.z();
      const double up_down =
          shot.down.z() - ray.dot(shot.down) / ray.dot(shot.ahead) * shot.ahead.z();
      const double minor_angle = std::atan2(up_down, up_right);
      PlainPoint point = seen[0];
      point.disc = ImageEllipse{point.column_px, point.row_px, major_px, major_px * tilt,
                                minor_angle + 0.5 * M_PI};
      if (i < kLong) point.disc->semi_major_px *= 1.0 + 0.3 * static_cast<double>(s % 3);
      input.pictures[s].plain.push_back(point);
    }
  }
  const Survey survey = Solved(input);
  const auto nearest = test::NearestPlain(bare, survey);
  int given = 0;
  for (const auto& target : nearest) {
    EXPECT_GE(target.target, kLong);
    given += target.off_mm < kThere_mm ? 1 : 0;
  }
  EXPECT_GE(given, 20);
  EXPECT_GT(LeftOver(survey, "no round disc"), 0);
}

TEST(SurveyPlain, TakesNoCodedTargetTwiceWhoseCodeWasNotRead) {
  const test::SurveyWorld world = test::MakeSurveyWorld(PlainScene(), 9);
  SurveyInput input = test::Photograph(world, 9);
  const std::string covered = input.pictures[0].observations.front().target;
  int unread = 0;
  for (SurveyPicture& picture : input.pictures) {
    auto& observations = picture.observations;
    const auto of = std::find_if(observations.begin(), observations.end(),
                                 [&](const Observation& seen) { return seen.target == covered; });
    if (of == observations.end() || ++unread % 2 == 0) continue;
    picture.plain.push_back({of->column_px, of->row_px, of->sigma_px});
    observations.erase(of);
  }
  const Survey survey = Solved(input);
  const Found found = FoundIn(world, survey);
  EXPECT_EQ(found.none, 0) << "the covered target, given a second time";
  EXPECT_GE(LeftOver(survey, "codes were not read"), 3);
  ExpectConsistent(world, survey);
}

TEST(SurveyPlain, GivesNoneWhereReflectionsStandAsStill) {
  test::SurveyScene scene = PlainScene();
  scene.sigma_px = 0.8;
  const auto world = test::MakeSurveyWorld(scene, 21);
  const Survey survey = Solved(test::Photograph(world, 21));
  EXPECT_EQ(survey.verdict, Verdict::kGood) << survey.reason;
  EXPECT_TRUE(survey.plain.refused);
  EXPECT_THAT(survey.plain.reason, HasSubstr("at most 0.5"));
  EXPECT_EQ(survey.plain.targets, 0);
}

TEST(SurveyPlain, LeavesOutTargetsThatMoved) {
  for (const double by_mm : {0.4, 3.0, 25.0}) {
    SCOPED_TRACE(by_mm);
    test::SurveyWorld world = test::MakeSurveyWorld(PlainScene(), 7);
    std::vector<std::size_t> moved;
    for (std::size_t i = 0; i < world.plain.size() && moved.size() < 3; i += 2) {
      if (world.plain[i].normal.z() > 0.5) moved.push_back(i);
    }
    for (const std::size_t target : moved) {
      world.moved.push_back({target, 21, {0.6 * by_mm, 0.8 * by_mm, 0}});
    }
    const Survey survey = Solved(test::Photograph(world, 7));
    const Found found = FoundIn(world, survey);
    EXPECT_EQ(found.none, 0);
    for (const std::size_t target : moved) EXPECT_FALSE(found.targets.contains(target)) << target;
    EXPECT_GE(static_cast<int>(found.targets.size()), ShownIn(world, 6) - 3);
  }
}

// A highlight on a rounded edge: where it is seen depends on the camera's place.
TEST(SurveyPlain, TakesNoReflectionForATarget) {
  test::SurveyScene scene = PlainScene();
  scene.hidden = 0;
  const test::SurveyWorld world = test::MakeSurveyWorld(scene, 8);
  for (const double wander : {0.004, 0.02, 0.1}) {  // relative to the camera's motion
    SCOPED_TRACE(wander);
    SurveyInput input = test::Photograph(world, 8);
    test::SurveyWorld shining = world;
    shining.scene.stray = 0;
    for (std::size_t s = 0; s < world.shots.size(); ++s) {
      shining.plain.clear();
      for (int i = 0; i < 10; ++i) {
        // Along the edge, curved as the surface is.
        const double along = wander * (world.shots[s].place_mm.x() - 150.0 * i);
        const double down = wander * world.shots[s].place_mm.y();
        shining.plain.push_back({{150.0 * i - 700 + along, 590 + down - 1e-3 * along * along, 0},
                                 Eigen::Vector3d::UnitZ()});
      }
      const auto picture = test::Photograph(shining, 100 + s).pictures[s];
      input.pictures[s].plain.insert(input.pictures[s].plain.end(), picture.plain.begin(),
                                     picture.plain.end());
    }
    const Survey survey = Solved(input);
    EXPECT_EQ(FoundIn(world, survey).none, 0);
    EXPECT_GE(FoundIn(world, survey).targets.size(), 80U);
  }
}

TEST(SurveyPlain, FindsNothingAmongStrayPoints) {
  test::SurveyScene scene = PlainScene();
  scene.plain = 0;
  scene.rows = 0;
  scene.stray = 150;
  const test::SurveyWorld world = test::MakeSurveyWorld(scene, 9);
  const Survey survey = Solved(test::Photograph(world, 9));
  EXPECT_EQ(survey.verdict, Verdict::kGood);
  EXPECT_EQ(survey.plain.targets, 0);
  EXPECT_GT(survey.plain.points, 3000);
  EXPECT_EQ(LeftOver(survey, "no two other pictures") + LeftOver(survey, "by chance"),
            survey.plain.points);
}

TEST(SurveyPlain, RefusesMorePointsThanCanBeToldApart) {
  test::SurveyScene scene = PlainScene();
  scene.stray = 5000;
  const test::SurveyWorld world = test::MakeSurveyWorld(scene, 10);
  const Survey survey = Solved(test::Photograph(world, 10));
  EXPECT_EQ(survey.verdict, Verdict::kGood);
  EXPECT_TRUE(survey.plain.refused);
  EXPECT_THAT(survey.plain.reason, HasSubstr("up to 2000"));
  EXPECT_EQ(survey.plain.targets, 0);
}

}  // namespace
}  // namespace trammel::part_alignment
