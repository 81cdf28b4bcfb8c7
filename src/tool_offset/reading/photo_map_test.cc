#include "tool_offset/reading/photo_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tool_offset/reading/photo_checks.h"

namespace trammel::tool_offset {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kHalf_mm = 75;

/// A sheet seen straight from above, and what the picture's file states.
struct Seen {
  int width_px = 2480;
  int height_px = 3508;
  double dpi_x = 300.5;  ///< measured on the sheet
  double dpi_y = 300.5;
  double aslant = 0;     ///< perspective
  double barrel_mm = 0;  ///< common to all four sides
  StatedOfPage stated = {};
};

PageMap MapOf(const Seen& seen) {
  PageMap map;
  map.half_width_mm = map.half_height_mm = kHalf_mm;
  map.u_px_mm = {seen.dpi_x / 25.4, 0};
  map.v_px_mm = {0, -seen.dpi_y / 25.4};
  map.lean_per_mm = {seen.aslant / (2 * kHalf_mm), 0};
  map.bend_mm[kLeft][2] = map.bend_mm[kBottom][2] = seen.barrel_mm;
  map.bend_mm[kRight][2] = map.bend_mm[kTop][2] = -seen.barrel_mm;
  return map;
}

KindSigns SignsOf(const Seen& seen) {
  return SignsOf({nullptr, seen.width_px, seen.height_px, 1, seen.width_px}, MapOf(seen),
                 seen.stated);
}

/// "scan", "photo" or "either".
std::string KindOf(const Seen& seen, bool for_photo = false) {
  const auto kind = KindBy(SignsOf(seen), seen.stated, for_photo);
  if (!kind) return "either";
  return *kind == PageKind::kScan ? "scan" : "photo";
}

TEST(PageKind, IsToldByResolutionPerspectiveSizeAndWhatTheFileStates) {
  const struct {
    const char* what;
    Seen seen;
    const char* kind;
    const char* of_sheet_for_photo = nullptr;
  } rows[] = {
      {"a scanner's own file", {2480, 3508, 150.8, 150.8, 0, 0, {150, 150, false}}, "scan", "scan"},
      {"finer", {2480, 3508, 4824, 4824, 0, 0, {4800, 4800, false}}, "scan", "scan"},
      {"a fax states rows and columns", {2480, 3508, 204, 196, 0, 0, {204, 196, false}}, "scan"},
      {"in a camera's size", {4032, 3024, 400.5, 400.5, 0, 0, {400, 400, false}}, "scan"},
      {"a scanner's resolution that is not stated", {}, "scan"},
      {"cropped", {2011, 1937}, "scan"},
      {"an editor's resolution", {2011, 1937, 300.5, 300.5, 0, 0, {72, 72, false}}, "scan"},
      {"a photo without the camera's data", {4032, 3024, 391, 392, 0.02}, "photo"},
      {"what JPEGs state of nothing", {4032, 3024, 391, 392, 0.02, 0, {72, 72, false}}, "photo"},
      {"straight from above", {4032, 3024, 391, 392, 0.001, 0, {72, 72, false}}, "photo"},
      {"by chance in a scanner's resolution", {4032, 3024, 396.5, 397, 0.001}, "either", "photo"},
      {"through a lens", {4032, 3024, 396.5, 397, 0.001, 0.2}, "photo"},
      {"cropped", {3011, 2777, 391, 392, 0.02}, "photo"},
      {"cropped, a little aslant", {3011, 2777, 391, 392, 0.005}, "photo"},
      {"cropped, straight from above", {3011, 2777, 391, 392, 0.001}, "either"},
      {"a camera's focal length", {3011, 2777, 300.5, 300.5, 0, 0, {{}, {}, true}}, "photo"},
      {"in a scanner's file", {2480, 3508, 300.5, 300.5, 0, 0, {300, 300, true}}, "either"},
      // Given the output of a scan app that makes pages square again, of the size of the paper.
      {"not flat", {1654, 2339, 201, 200, 0.005, 0, {200, 200, false}}, "either"},
      {"bent", {1654, 2339, 201, 200, 0.001, 0.2, {200, 200, false}}, "either"},
      {"far from flat", {1654, 2339, 201, 200, 0.02, 0, {200, 200, false}}, "photo"},
  };
  for (const auto& row : rows) {
    EXPECT_EQ(KindOf(row.seen), row.kind) << row.what;
    if (row.of_sheet_for_photo == nullptr) continue;
    EXPECT_EQ(KindOf(row.seen, true), row.of_sheet_for_photo) << row.what;
  }
}

TEST(PageKind, SqueezedPagesAreNamedAsSuch) {
  const Seen fax{2480, 3297, 300, 282, 0, 0, {300, 300, false}};
  EXPECT_EQ(KindOf(fax), "either");
  EXPECT_THAT(WhyNoKind(SignsOf(fax)),
              AllOf(HasSubstr("squeezed"), HasSubstr("--dpi 300 282"), Not(HasSubstr("photo"))));
  // Aslant by 20 degrees as well, but seen so.
  EXPECT_EQ(KindOf({4032, 3024, 400, 376, 0.1, 0, {}}), "photo");
}

TEST(PageKind, TheQuestionNamesWhatWasSeenAndHowToAnswer) {
  EXPECT_THAT(WhyNoKind(SignsOf(Seen{4032, 3024, 396.5, 397, 0.001, 0, {}})),
              AllOf(HasSubstr("cannot tell whether it is a scan or a photo"),
                    HasSubstr("396 x 397 dpi, which the file does not state"),
                    HasSubstr("cameras store"), HasSubstr("--photo"), HasSubstr("--dpi 397")));
}

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

TEST(PhotoPose, ACroppedPictureHasItsAxisAnywhereAboutTheMiddle) {
  constexpr double kAnywhere = 0.2;  // of the centre-corner distance
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
