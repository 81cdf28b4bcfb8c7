#include "part_alignment/camera/camera_convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>
#include <limits>

#include "part_alignment/camera/camera.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

// Pixels of about 2000 are known to 5e-13 in double; the lens is inverted to a little more.
constexpr double kSamePx = 1e-9;
constexpr double kPitch_mm = 0.003;

OpenCvCamera SomeCamera() {
  OpenCvCamera camera;
  camera.width_px = 1280;
  camera.height_px = 720;
  camera.fx_px = camera.fy_px = 1502.25;
  camera.cx_px = 642.5;
  camera.cy_px = 355.75;
  camera.k1 = -0.281;
  camera.k2 = 0.0925;
  camera.p1 = 0.00113;
  camera.p2 = -0.00047;
  return camera;
}

struct Seen {
  Vector3d camera_mm;
  Vector2d pixel;
};

// OpenCV's published formula in 40 decimal digits, computed apart.
const Seen kSeenByOpenCv[] = {{{0, 0, 500}, {642.5, 355.75}},
                              {{120, -85, 610}, {933.102069094181, 149.976457012004}},
                              {{-190, 110, 433}, {26.071908297535, 712.960741366227}},
                              {{250, 140, 700}, {1155.094920875918, 643.153829035147}}};

TEST(CameraConvert, AnOpenCvCameraSeesWhatOpenCvSees) {
  const auto converted = Must(FromOpenCv(SomeCamera(), kPitch_mm, {}));
  EXPECT_LT(converted.largest_error_px, kSamePx);
  for (const Seen& seen : kSeenByOpenCv) {
    const auto pixel = Must(Project(converted.camera, seen.camera_mm));
    EXPECT_NEAR(pixel.x(), seen.pixel.x(), kSamePx);
    EXPECT_NEAR(pixel.y(), seen.pixel.y(), kSamePx);
  }
  EXPECT_FALSE(Project(converted.camera, {0, 0, -500})) << "OpenCV's cameras look along +z";
}

// Rational lenses of eight coefficients (mrcal's LENSMODEL_OPENCV8) have no exact counterpart.
TEST(CameraConvert, EightCoefficientsAreFittedAndTheErrorIsSaid) {
  OpenCvCamera camera = SomeCamera();
  camera.k3 = -0.011;
  camera.k4 = 0.021;
  camera.k5 = -0.0031;
  camera.k6 = 0.0004;
  const Seen apart[] = {{{120, -85, 610}, {932.749986675485, 150.225848725247}},
                        {{-190, 110, 433}, {29.379397006675, 711.045879481988}}};
  ConvertOptions options;
  options.max_error_px = 0.02;
  const auto converted = Must(FromOpenCv(camera, kPitch_mm, options));
  EXPECT_GT(converted.largest_error_px, 0);
  for (const Seen& seen : apart) {
    EXPECT_LE((*ProjectOpenCv(camera, seen.camera_mm) - seen.pixel).norm(), kSamePx);
    // Between the observations of the fit it may be a little worse than on them.
    EXPECT_LE((*Project(converted.camera, seen.camera_mm) - seen.pixel).norm(),
              1.1 * converted.largest_error_px + kSamePx);
  }
  camera.k3 = 0.9;
  EXPECT_THAT(FromOpenCv(camera, kPitch_mm, options), FailsWith("off by up to"));
}

TEST(CameraConvert, TheOtherDirectionIsFittedAndComesBack) {
  ConvertOptions options;
  options.convention = CameraConvention::kBrownIdealToDistorted;
  options.max_error_px = 2;
  const Camera camera = TableOneCamera();
  const auto other = Must(ConvertConvention(camera, options));
  EXPECT_EQ(other.camera.convention, CameraConvention::kBrownIdealToDistorted);
  EXPECT_EQ(other.camera.taper_from_camera.angles_rad, camera.taper_from_camera.angles_rad);
  std::cout << "Table 1 turned round: " << other.largest_error_px << " px at most, "
            << other.rms_error_px << " px root mean square\n";
  const Vector3d seen_mm(60, -45, -300);
  EXPECT_LE((*Project(other.camera, seen_mm) - *Project(camera, seen_mm)).norm(),
            1.1 * other.largest_error_px);
  options.convention = CameraConvention::kBrownMeasuredToIdeal;
  const auto back = Must(ConvertConvention(other.camera, options));
  EXPECT_LE((*Project(back.camera, seen_mm) - *Project(camera, seen_mm)).norm(),
            1.1 * (other.largest_error_px + back.largest_error_px));
}

TEST(CameraConvert, WhatIsNoCameraIsNamed) {
  const auto complaint = [](const OpenCvCamera& camera, double pitch_mm = kPitch_mm) {
    return ErrorOf(FromOpenCv(camera, pitch_mm, {}));
  };
  OpenCvCamera camera = SomeCamera();
  camera.fy_px *= 1.02;
  EXPECT_THAT(complaint(camera), HasSubstr("not square"));
  camera = SomeCamera();
  camera.k1 = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(complaint(camera), HasSubstr("k1"));
  camera = SomeCamera();
  camera.fx_px = 0;
  EXPECT_THAT(complaint(camera), HasSubstr("fx"));
  camera = SomeCamera();
  camera.width_px = 0;
  EXPECT_THAT(complaint(camera), HasSubstr("0 x 720"));
  camera = SomeCamera();
  camera.k1 = -30;
  EXPECT_THAT(complaint(camera), HasSubstr("folds"));
  EXPECT_THAT(complaint(SomeCamera(), 0), HasSubstr("pitch"));
}

TEST(CameraParameters, DerivativesAgreeWithDifferences) {
  const Vector3d taper_mm(70, -55, -650);
  for (const auto convention :
       {CameraConvention::kBrownMeasuredToIdeal, CameraConvention::kBrownIdealToDistorted}) {
    Camera camera = TableOneCamera();
    camera.convention = convention;
    const auto at = Must(ProjectFromTaper(camera, taper_mm));
    const CameraVector parameters = ParametersOf(camera);
    for (int i = 0; i < kCameraParameters; ++i) {
      // A step that moves the picture by 0.01 px: its square is 1e-7 of it in the worst lens here.
      const double step = 0.01 / at.by_parameter.col(i).norm();
      CameraVector more = parameters;
      CameraVector less = parameters;
      more[i] += step;
      less[i] -= step;
      const Vector2d slope = (ProjectFromTaper(WithParameters(camera, more), taper_mm)->pixel -
                              ProjectFromTaper(WithParameters(camera, less), taper_mm)->pixel) /
                             (2 * step);
      EXPECT_LT((slope - at.by_parameter.col(i)).norm(), 1e-7 * at.by_parameter.col(i).norm())
          << kCameraParameterNames[static_cast<std::size_t>(i)];
    }
  }
}

}  // namespace
}  // namespace trammel::part_alignment
