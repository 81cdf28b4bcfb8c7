#include "part_alignment/pose/measurement.h"

#include <gtest/gtest.h>

#include "part_alignment/pose/alignment_test_support.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

// The numbers come from a program of its own (numpy, fixed-point inversion) written from the paper,
// printed with 12 and 10 digits.
TEST(Measurement, TheWholeChainIsThatOfAnIndependentProgram) {
  View view;
  view.spindle_mm = {120, -30, -230};
  Clamping clamping;
  clamping.angle_rad = 0.0123;
  const Camera camera = CameraOf({});
  const Vector3d point =
      CameraFromPart(camera, clamping, view, {{100, -50, -700}, {0.02, -0.015, 0.4}}, {25, -10, 5});
  EXPECT_LT((point - Vector3d(7.370029958113, -19.644551796912, -144.658310686771)).norm(), 3e-12);
  const auto pixel = Project(camera, point);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 1144.1885212726, 1e-9);
  EXPECT_NEAR(pixel->y(), 1379.0316892935, 1e-9);
}

}  // namespace
}  // namespace trammel::part_alignment
