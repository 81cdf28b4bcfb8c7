#include "part_alignment/survey/lens.h"

#include <gtest/gtest.h>

#include "part_alignment/camera/camera_convert.h"

namespace trammel::part_alignment {
namespace {

Lens Bent() {
  Lens lens = PlainLens(2773, 4000, 3000);
  lens.tail<7>() +=
      (Eigen::Matrix<double, 7, 1>() << 12, -9, -0.09, 0.03, -0.004, 3e-4, -2e-4).finished();
  return lens;
}

TEST(Lens, ProjectsAsOpenCvDoes) {
  const Lens lens = Bent();
  const OpenCvCamera other{
      4000,      3000,      lens[kFocal], lens[kFocal], lens[kColumn], lens[kRow],
      lens[kK1], lens[kK2], lens[kP1],    lens[kP2],    lens[kK3],     0,
      0,         0};
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.6, -0.4, 1.1),
                                    Eigen::Vector3d(-700, 500, 900)}) {
    const auto projection = ProjectLens(lens, at);
    const auto expected = ProjectOpenCv(other, at);
    ASSERT_TRUE(projection && expected);
    EXPECT_LT((projection->pixel - *expected).norm(), 1e-9);
  }
}

TEST(Lens, DerivativesAreThoseOfFiniteDifferences) {
  const Lens lens = Bent();
  const Eigen::Vector3d at(0.6, -0.4, 1.1);
  const auto projection = ProjectLens(lens, at);
  ASSERT_TRUE(projection);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(i);
    const Eigen::Vector2d slope =
        (ProjectLens(lens, at + step)->pixel - ProjectLens(lens, at - step)->pixel) / (2 * kStep);
    EXPECT_LT((slope - projection->by_point.col(i)).norm(), 1e-4) << i;
  }
  for (int i = 0; i < kLensParameters; ++i) {
    const Lens step = kStep * Lens::Unit(i);
    const Eigen::Vector2d slope =
        (ProjectLens(lens + step, at)->pixel - ProjectLens(lens - step, at)->pixel) / (2 * kStep);
    EXPECT_LT((slope - projection->by_lens.col(i)).norm(), 1e-4) << kLensParameterNames.at(i);
  }
}

TEST(Lens, ObservationLineGoesThroughWhatIsProjected) {
  const Lens lens = Bent();
  const Eigen::Vector3d at(0.6, -0.4, 1.1);
  const auto line = ObservationLine(lens, ProjectLens(lens, at)->pixel);
  ASSERT_TRUE(line);
  EXPECT_LT((*line - at.normalized()).norm(), 1e-12);
}

TEST(Lens, HasNoPixelBehindTheCameraAndNoLineBeyondAFold) {
  EXPECT_FALSE(ProjectLens(Bent(), {0, 0, -1}));
  EXPECT_FALSE(ProjectLens(Bent(), {0, 0, 0}));
  EXPECT_FALSE(ProjectLens(Bent(), {10, 0, 1}));
  Lens folded = PlainLens(1000, 4000, 3000);
  folded[kK1] = -1;  // the picture ends at r = 0.38 focal lengths
  EXPECT_FALSE(ObservationLine(folded, {3999, 1500}));
}

}  // namespace
}  // namespace trammel::part_alignment
