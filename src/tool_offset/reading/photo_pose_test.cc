#include "tool_offset/reading/photo_pose.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

namespace trammel::tool_offset {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kWidth_mm = 120;
constexpr double kHeight_mm = 130;
constexpr PageView kPicture{nullptr, 4032, 3024, 3, 0};
// 48 mm on film over the picture's diagonal of 5040 px.
constexpr double kFilm_mm = 48;
constexpr double kFocal_px = kFilm_mm / 43.27 * 5040;
/// Rounding of the arithmetic, in mm and px.
constexpr double kExact = 1e-6;

/// A pinhole over the sheet's middle, turned in its plane and tilted.
struct Pinhole {
  double tilt_rad = 12 * kDegree;
  double tilt_to_rad = 0.7;
  double distance_mm = 350;

  [[nodiscard]] PagePoint Seen(double u_mm, double v_mm, double height_mm = 0) const {
    // Along the way that the sheet falls, and across; picture axes, y down.
    const double c = std::cos(tilt_to_rad);
    const double s = std::sin(tilt_to_rad);
    const double along = u_mm * c + v_mm * s;
    const double across = v_mm * c - u_mm * s;
    const double x = along * std::cos(tilt_rad) + height_mm * std::sin(tilt_rad);
    const double depth = distance_mm + along * std::sin(tilt_rad) - height_mm * std::cos(tilt_rad);
    const double right = x * c - across * s;
    const double up = x * s + across * c;
    return {(kPicture.width - 1) / 2.0 + kFocal_px * right / depth,
            (kPicture.height - 1) / 2.0 - kFocal_px * up / depth};
  }
  [[nodiscard]] PageMap Map() const {
    const double u = kWidth_mm / 2;
    const double v = kHeight_mm / 2;
    return *MapOfCorners({Seen(-u, -v), Seen(u, -v), Seen(u, v), Seen(-u, v)}, kWidth_mm,
                         kHeight_mm);
  }
};

TEST(PhotoPose, FindsFootHeightAndTiltOfAPinhole) {
  const Pinhole pinhole;
  const PhotoPose pose = FindPose(kPicture, pinhole.Map(), {kFilm_mm, {}});
  EXPECT_TRUE(pose.focal_stated);
  EXPECT_NEAR(pose.focal_px, kFocal_px, kExact);
  EXPECT_NEAR(pose.tilt_rad, pinhole.tilt_rad, kExact);
  EXPECT_NEAR(pose.height_mm, pinhole.distance_mm * std::cos(pinhole.tilt_rad), kExact);
  // The lens is above the sheet's middle along its own axis: its foot lies where the sheet rises.
  const double foot_mm = -pinhole.distance_mm * std::sin(pinhole.tilt_rad);
  EXPECT_NEAR(pose.foot.u_mm, foot_mm * std::cos(pinhole.tilt_to_rad), kExact);
  EXPECT_NEAR(pose.foot.v_mm, foot_mm * std::sin(pinhole.tilt_to_rad), kExact);
  EXPECT_NEAR(pose.aim.u_mm, 0, kExact);
  EXPECT_NEAR(pose.aim.v_mm, 0, kExact);
}

TEST(PhotoPose, LeversAreWhatHeightAndColourDo) {
  constexpr double kHigher_mm = 0.05;
  constexpr double kFurther_px = 0.5;
  /// Of second order: the height over the distance, the shift over the picture.
  constexpr double kSecondOrder_mm = 3e-5;
  const Pinhole pinhole;
  const PageMap map = pinhole.Map();
  const PhotoPose pose = FindPose(kPicture, map, {kFilm_mm, {}});
  const SheetPoint at{35, -20};
  const RadialLever u = LeverAt(pose, map, Axis::kX, at);
  const RadialLever v = LeverAt(pose, map, Axis::kY, at);
  const PagePoint high = pinhole.Seen(at.u_mm, at.v_mm, kHigher_mm);
  const PagePoint by_lever =
      pinhole.Seen(at.u_mm + kHigher_mm * u.height, at.v_mm + kHigher_mm * v.height);
  EXPECT_LT(Length(high - by_lever) / Length(map.u_px_mm), kSecondOrder_mm);
  const PagePoint place = pinhole.Seen(at.u_mm, at.v_mm);
  const PagePoint out = place + (kFurther_px / pose.corner_px) * (place - pose.centre);
  const PagePoint by_colour =
      pinhole.Seen(at.u_mm + kFurther_px * u.colour_mm_px, at.v_mm + kFurther_px * v.colour_mm_px);
  EXPECT_LT(Length(out - by_colour) / Length(map.u_px_mm), kSecondOrder_mm);
  const RadialLever further = LeverAt(pose, map, Axis::kX, {at.u_mm + 10, at.v_mm});
  EXPECT_NEAR(further.height - u.height, 10 * u.height_per_mm, kExact);
}

TEST(PhotoPose, KnowsTheSizesThatCamerasStore) {
  for (const auto& [width_px, height_px] : {std::pair{4032, 3024},
                                            {3024, 4032},
                                            {4000, 2252},
                                            {6000, 4000},
                                            {3024, 3024},
                                            {9248, 6936}}) {
    EXPECT_TRUE(IsStoredSize(width_px, height_px)) << width_px;
  }
  for (const auto& [width_px, height_px] :
       {std::pair{4031, 3024}, {3600, 3024}, {2873, 2155}, {1, 1}, {4032, 4}}) {
    EXPECT_FALSE(IsStoredSize(width_px, height_px)) << width_px;
  }
}

TEST(PhotoPose, ACroppedPictureHasItsAxisAnywhereAboutTheMiddle) {
  constexpr double kAnywhere = 0.2;  // of the way to the corner
  const Pinhole pinhole;
  const PhotoPose stored = FindPose(kPicture, pinhole.Map(), {kFilm_mm, {}});
  PageView cut = kPicture;
  --cut.width;
  const PhotoPose cropped = FindPose(cut, pinhole.Map(), {kFilm_mm, {}});
  EXPECT_TRUE(stored.as_stored);
  EXPECT_LT(stored.centre_uncertainty_px, 20);
  EXPECT_FALSE(cropped.as_stored);
  EXPECT_GT(cropped.centre_uncertainty_px, kAnywhere * cropped.corner_px);
  EXPECT_GT(cropped.focal_uncertainty, stored.focal_uncertainty);
}

TEST(PhotoPose, SteepTiltsTellAFocalLengthThatIsNotStated) {
  Pinhole pinhole;
  pinhole.tilt_rad = 30 * kDegree;
  const PhotoPose steep = FindPose(kPicture, pinhole.Map(), {});
  EXPECT_FALSE(steep.focal_stated);
  EXPECT_NEAR(steep.focal_px / kFocal_px, 1, 0.05);
  pinhole.tilt_rad = 0;
  const PhotoPose level = FindPose(kPicture, pinhole.Map(), {});
  EXPECT_GT(level.focal_uncertainty, 0.3);  // nothing but what phones usually have
  EXPECT_LT(steep.focal_uncertainty, 0.1);
}

}  // namespace
}  // namespace trammel::tool_offset
