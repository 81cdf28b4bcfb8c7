#include "sim/survey/survey_pictures.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trammel::sim {
namespace {

using Eigen::Vector3d;

// Looks down at the origin from 2 m, rows along -y.
HandShot FromAbove() { return {{0, 0, 2000}, {1, 0, 0}, {0, -1, 0}, {0, 0, -1}}; }

TEST(HandCamera, ShowsAPointWhereTheNumbersOfItsLensPutIt) {
  const HandLens lens;
  const auto seen = SeenAt(lens, FromAbove(), {400, -200, 0}, 0);
  ASSERT_TRUE(seen);
  // By hand: a = 0.2, b = 0.1, q = 0.05, 1 + k1 q + k2 q^2 = 0.995575.
  constexpr double kRounding_px = 1e-9;
  EXPECT_NEAR(seen->x(), 1999.5 + 14.2 + 2773 * (0.2 * 0.995575 - 2e-4 * 0.13 + 6e-4 * 0.02),
              kRounding_px);
  EXPECT_NEAR(seen->y(), 1499.5 - 9.7 + 2773 * (0.1 * 0.995575 + 3e-4 * 0.07 - 4e-4 * 0.02),
              kRounding_px);
  EXPECT_FALSE(SeenAt(lens, FromAbove(), {0, 0, 2500}, 0));
  EXPECT_FALSE(SeenAt(lens, FromAbove(), {3000, 0, 0}, 0));
}

TEST(HandCamera, ShowsADiscFromAboveRoundAndATiltedOneShort) {
  const HandLens plain{4000, 3000, 2773, 0, 0, 0, 0, 0, 0};
  const auto above = DiscSeenAt(plain, FromAbove(), {0, 0, 0}, Vector3d::UnitZ(), 5, 0);
  ASSERT_TRUE(above);
  // 64 corners take a part of (2 pi / 64)^2 / 6 from the radius.
  constexpr double kCorners_px = 0.015;
  EXPECT_NEAR(above->major_px, 2773 * 5 / 2000.0, kCorners_px);
  EXPECT_NEAR(above->minor_px, 2773 * 5 / 2000.0, kCorners_px);
  const Vector3d tilted(0, std::sin(1.0), std::cos(1.0));
  const auto aslant = DiscSeenAt(plain, FromAbove(), {0, 0, 0}, tilted, 5, 0);
  ASSERT_TRUE(aslant);
  EXPECT_NEAR(aslant->minor_px / aslant->major_px, std::cos(1.0), 1e-4);
  EXPECT_NEAR(aslant->angle_rad, 0, 1e-9);
  // a^2 sin(tilt) cos(tilt) / f of the image's middle from the centre's image, a the semi-major.
  const double off = aslant->centre_px.y() - 1499.5;
  const double a = 2773 * 5 / 2000.0;
  EXPECT_NEAR(std::abs(off), a * a * std::sin(1.0) * std::cos(1.0) / 2773, 1e-4);
}

TEST(FreeformBlock, AHillHidesWhatLiesBehindIt) {
  FreeformBlock block;
  block.hills = {{{0, 0}, 100, 80}};
  const Vector3d behind = TopPoint(block, -300, 0);
  EXPECT_FALSE(IsOpenTo(block, behind, {2500, 0, 300}));
  EXPECT_TRUE(IsOpenTo(block, behind, {2500, 0, 2500}));
  EXPECT_TRUE(IsOpenTo(block, behind, {-2500, 0, 300}));
  EXPECT_FALSE(IsOpenTo(block, {-1000, 0, -100}, {2500, 0, 300}));  // through the body
}

TEST(FreeformBlock, NormalsAreThoseOfDifferences) {
  const FreeformBlock block = DrawBlock(3);
  constexpr double kStep_mm = 1e-3;
  for (const double x : {-700.0, 30.0, 910.0}) {
    const Vector3d along = TopPoint(block, x + kStep_mm, 50) - TopPoint(block, x - kStep_mm, 50);
    const Vector3d across = TopPoint(block, x, 50 + kStep_mm) - TopPoint(block, x, 50 - kStep_mm);
    EXPECT_NEAR(TopNormal(block, x, 50).dot(along.normalized()), 0, 1e-7);
    EXPECT_NEAR(TopNormal(block, x, 50).dot(across.normalized()), 0, 1e-7);
  }
}

TEST(SurveyPart, GlintsObeyTheLawOfReflection) {
  const FreeformBlock block = DrawBlock(4);
  const Vector3d lamp(900, -400, 2500);
  const Vector3d eye(-1500, 700, 1700);
  const auto glints = GlintsOf(block, lamp, eye);
  ASSERT_FALSE(glints.empty());
  for (const Vector3d& glint : glints) {
    const Vector3d half = ((lamp - glint).normalized() + (eye - glint).normalized()).normalized();
    EXPECT_NEAR(half.dot(TopNormal(block, glint.x(), glint.y())), 1, 1e-6);
  }
}

struct Scene {
  std::vector<HandShot> shots = WalkAround({}, 5);
  SurveyPart part = DrawSurveyPart({}, shots, 5);
};

TEST(SurveyPart, HasItsTargetsAndPairsAFewMillimetresApart) {
  const Scene scene;
  int plain = 0;
  int in_pairs = 0;
  for (const SurveyMark& mark : scene.part.marks) {
    if (mark.code > 0) continue;
    ++plain;
    for (const SurveyMark& other : scene.part.marks) {
      const double apart = (mark.at_mm - other.at_mm).norm();
      if (&other != &mark && other.code == 0 && apart < 12) ++in_pairs;
    }
  }
  EXPECT_EQ(plain, 300);
  EXPECT_EQ(scene.part.marks.size(), 364U);
  EXPECT_GE(in_pairs, 20);
}

TEST(SurveyPictures, ShowWhatIsAskedForWithItsNoise) {
  const Scene scene;
  SurveyPictureTraits traits;
  traits.sigma_px = 0.1;
  const auto shows = TakeSurveyPictures(scene.part, {}, scene.shots, traits, 5);
  ASSERT_EQ(shows.size(), 100U);
  double squares = 0;
  double spurious = 0;
  int marks = 0;
  for (std::size_t i = 0; i < shows.size(); ++i) {
    for (const SurveySpot& spot : shows[i].spots) {
      if (spot.kind == SpotKind::kMerged) continue;
      if (spot.kind != SpotKind::kMark) {
        ++spurious;
        continue;
      }
      const SurveyMark& mark = scene.part.marks[spot.mark];
      const auto true_px =
          DiscSeenAt({}, scene.shots[i], mark.at_mm, mark.normal, mark.radius_mm, 0);
      ASSERT_TRUE(true_px);
      squares += (spot.seen.centre_px - true_px->centre_px).squaredNorm();
      ++marks;
    }
  }
  ASSERT_GT(marks, 5000);
  EXPECT_NEAR(std::sqrt(squares / (2.0 * marks)), 0.1, 0.003);  // 4 sigmas of 5000 pairs
  EXPECT_NEAR(spurious / 100, 20, 4);
  const auto supports = SupportOf(scene.part, scene.shots, shows);
  int by_four = 0;
  for (const MarkSupport& support : supports) by_four += support.pictures >= 4 ? 1 : 0;
  EXPECT_GT(by_four, 330);
}

TEST(SurveyPictures, AMovedMarkStandsElsewhereFromThen) {
  const Scene scene;
  SurveyPictureTraits traits;
  traits.sigma_px = 0;
  traits.missed = 0;
  traits.move = MarkMove{70, 50, {0, 0, 5}};
  const auto moved = TakeSurveyPictures(scene.part, {}, scene.shots, traits, 5);
  traits.move.reset();
  const auto still = TakeSurveyPictures(scene.part, {}, scene.shots, traits, 5);
  const auto places = [](const std::vector<SurveyShow>& shows, std::size_t picture) {
    for (const SurveySpot& spot : shows[picture].spots) {
      if (spot.kind == SpotKind::kMark && spot.mark == 70) return spot.seen.centre_px;
    }
    return Eigen::Vector2d(-1, -1);
  };
  int differ = 0;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const bool same = (places(moved, i) - places(still, i)).norm() < 1e-9;
    if (i < 50) EXPECT_TRUE(same) << i;
    if (i >= 50 && !same) ++differ;
  }
  EXPECT_GT(differ, 5);
}

}  // namespace
}  // namespace trammel::sim
