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
  // Computed by hand: a = 0.2, b = 0.1, q = 0.05, 1 + k1 q + k2 q^2 = 0.995575.
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

struct Scene {
  std::vector<HandShot> shots = WalkAround({}, 5);
  SurveyPart part = DrawSurveyPart({}, shots, 5);
};

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

}  // namespace
}  // namespace trammel::sim
