// Square markers from drawn pictures to the part's place, as align measure goes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "machine/camera/raw_picture.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/procedure/align_measure.h"
#include "support/target_picture.h"

namespace trammel::procedure {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using machine::CapturedFrame;
using part_alignment::Camera;
using part_alignment::Measurement;
using ::testing::HasSubstr;

constexpr std::uint64_t kSeed = 31;
constexpr std::uint32_t kMono8 = 0x01080001;  // PFNC
constexpr double kSide_mm = 40;
constexpr double kDistance_mm = 300;

/// Four markers on a part that lies askew, seen from two places each by a camera without
/// distortion: 0.4 mm per pixel.
struct Shop {
  Shop() {
    Camera& camera = plan.camera;
    camera.width_px = 460;
    camera.height_px = 380;
    camera.pixel_pitch_mm = 0.02;
    camera.focal_length_mm = 15;
    camera.looks_along = part_alignment::LooksAlong::kPlusZ;
    // Down: the camera's axes along X, -Y, -Z of the spindle.
    camera.taper_from_camera.angles_rad = {3.141592653589793, 0, 0};
    truth.angles_rad = {0.03, -0.02, 0.05};
    truth.translation_mm = {10, 20, 30};
    options.squares = part_alignment::MakeSquareBook({5, 6, 7, 13}).value();
    options.id_prefix = "M";
    constexpr double kAt_mm[4][2] = {{-150, -100}, {150, -110}, {140, 120}, {-160, 105}};
    for (std::size_t i = 0; i < 4; ++i) {
      plan.targets.push_back({"M" + std::to_string(options.squares.ids[i]),
                              {kAt_mm[i][0], kAt_mm[i][1], 5.0 * static_cast<double>(i)}});
      for (const double aside_mm : {-50.0, 50.0}) {
        part_alignment::View view;
        view.spindle_mm =
            truth.translation_mm +
            Vector3d(kAt_mm[i][0] + aside_mm, kAt_mm[i][1] + 0.6 * aside_mm, kDistance_mm);
        plan.views.push_back(view);
      }
    }
    shop.take_picture = [this] { return Picture(); };
    shop.keep_picture = [](std::size_t, const CapturedFrame&) -> Result<void> { return {}; };
    shop.keep_observations = [](const Measurement&) -> Result<void> { return {}; };
    shop.tell = [](const std::string&) {};
  }

  /// The marker as a homography: its plane is the part's XY, its upper edge along X.
  [[nodiscard]] test::DrawnTarget Marker(std::size_t i, const part_alignment::View& view) const {
    const auto seen = [&](double x, double y) {
      return part_alignment::CameraFromPart(plan.camera, {}, view, truth,
                                            plan.targets[i].ideal_mm + Vector3d(x, y, 0));
    };
    const double module_mm = kSide_mm / 7;
    Matrix3d axes;
    axes.col(2) = seen(0, 0);
    axes.col(0) = module_mm * (seen(1, 0) - axes.col(2));
    axes.col(1) = module_mm * (seen(0, -1) - axes.col(2));
    const double focal_px = plan.camera.focal_length_mm / plan.camera.pixel_pitch_mm;
    Matrix3d lens;
    lens << focal_px, 0, 0.5 * (plan.camera.width_px - 1), 0, focal_px,
        0.5 * (plan.camera.height_px - 1), 0, 0, 1;
    const Matrix3d h = lens * axes / axes(2, 2);
    test::DrawnTarget marker;
    marker.modules = 7;
    marker.word = part_alignment::SquareWord(options.squares.ids[i]);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) marker.h[r][c] = h(r, c);
    }
    return marker;
  }

  Result<CapturedFrame> Picture() {
    const std::size_t view = next++;
    const auto page = test::Expose(test::Draw(plan.camera.width_px, plan.camera.height_px,
                                              {Marker(view / 2, plan.views[view])}, {}),
                                   1, noise);
    auto png = machine::ToPicture({kMono8, page.width, page.height, 0, page.samples}, 0);
    if (!png) return tl::unexpected(png.error());
    CapturedFrame frame;
    frame.image = std::move(*png);
    frame.width_px = page.width;
    frame.height_px = page.height;
    return frame;
  }

  Measurement plan;
  geometry::Pose truth;
  MeasureOptions options;
  MeasurementHooks shop;
  Random noise{kSeed};
  std::size_t next = 0;
};

// 100 px of side and a noise of 1 grey level: 0.002 px, 0.8 um. Of eight views that is 0.4 um
// across, and, at 300 mm with levers of 100 mm, 2 um in depth and 10 urad over 300 mm; five times
// that.
constexpr double kAcross_mm = 0.002;
constexpr double kDepth_mm = 0.01;
constexpr double kAngle_rad = 5e-5;

TEST(MeasurePart, FindsThePartBySquareMarkers) {
  Shop made;
  const auto outcome = MeasurePart(made.plan, made.options, made.shop);
  ASSERT_TRUE(outcome) << outcome.error().message;
  for (std::size_t i = 0; i < made.plan.views.size(); ++i) {
    ASSERT_EQ(outcome->measurement.views[i].observations.size(), 1U) << "view " << i;
    EXPECT_EQ(outcome->measurement.views[i].observations[0].target, made.plan.targets[i / 2].id);
  }
  const auto alignment = part_alignment::Solve(outcome->measurement, {});
  ASSERT_TRUE(alignment) << alignment.error().message;
  ASSERT_EQ(alignment->verdict, Verdict::kGood) << alignment->reason;
  const auto& pose = alignment->machine_from_part;
  const Vector3d off_mm = pose.translation_mm - made.truth.translation_mm;
  EXPECT_LT(off_mm.head<2>().norm(), kAcross_mm) << "seed " << kSeed;
  EXPECT_LT(std::abs(off_mm.z()), kDepth_mm) << "seed " << kSeed;
  EXPECT_LT((pose.angles_rad - made.truth.angles_rad).norm(), kAngle_rad) << "seed " << kSeed;
}

TEST(MeasurePart, NamesTargetsThatNoMarkerStandsFor) {
  Shop made;
  made.plan.targets[2].id = "M8";
  const auto outcome = MeasurePart(made.plan, made.options, made.shop);
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().message, HasSubstr("target M8 of the plan is none of the markers"));
}

}  // namespace
}  // namespace trammel::procedure
