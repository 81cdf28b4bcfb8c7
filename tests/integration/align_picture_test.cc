// Drawn pictures, found targets, solved part: against the truth of the virtual spindle.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "align_scene.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/targets/eccentricity.h"
#include "part_alignment/targets/ring_finder.h"
#include "sim/spindle/spindle_files.h"
#include "sim/spindle/spindle_world.h"
#include "support/matchers.h"

namespace trammel {
namespace {

// TRAMMEL_PICTURES_SEED, else one of development.
std::uint64_t Seed() {
  const char* text = std::getenv("TRAMMEL_PICTURES_SEED");
  return text == nullptr ? 73 : std::strtoull(text, nullptr, 10);
}

// Discs of 19 px, contrast 175, noise of 1.7 grey levels: 0.003 px per axis. Through this geometry,
// k = 1: 0.1 um in X and Y, 1.4 um in Z, 2 urad in alpha and beta, 2 urad in the clamp angle. Four
// sigmas, more where only three targets are seen.
constexpr double kCentre_px = 0.02;
constexpr double kAcross_mm = 0.001;
constexpr double kDepth_mm = 0.006;
constexpr double kAngle_rad = 10e-6;
constexpr double kClampAngle_rad = 15e-6;
// Before the correction for eccentricity: 2 k1 (19 px)² (600 px) = 0.013 px by the lens, and f /
// pitch (2 / 300)² sin cos of 18 degrees = 0.04 px by the tilt.
constexpr double kUncorrected_px = 0.08;

struct Scene {
  sim::SpindleWorld world;
  sim::SpindleName name;
  std::vector<sim::RingPattern> patterns;
  std::vector<std::vector<sim::HiddenWedge>> hidden;
  sim::SpindlePicture like;
  part_alignment::CodeBook book;
};

// The laboratory at 300 mm with a camera that is clamped at an angle and nowhere else. The part
// lies askew by these angles.
Scene MakeScene(const sim::Triple& askew_rad = {}) {
  constexpr double kDistance_mm = 300;
  Scene scene;
  sim::SpindleSetup setup = sim::LaboratoryScene(kDistance_mm);
  setup.part.angles_rad = askew_rad;
  setup.stops = sim::StationsFor(setup, kDistance_mm, sim::JoggedLevers());
  setup.lens = setup.stated_lens = sim::AsRealCamera(setup.lens);
  setup.spread.eccentricity_mm = 0;
  scene.name = {Seed(), 1};
  scene.world = sim::DrawSpindleWorld(setup, scene.name);
  scene.book = part_alignment::MakeCodeBook(14).value();
  for (const sim::SpindleTarget& target : setup.part.targets) {
    sim::RingPattern pattern;
    pattern.bits = scene.book.bits;
    pattern.word = scene.book.words.at(static_cast<std::size_t>(target.id - 1));
    scene.patterns.push_back(pattern);
  }
  scene.hidden.resize(setup.part.targets.size());
  scene.like.clutter = sim::ShopClutter();
  scene.like.light.vignetting = 0.3;
  scene.like.light.gradient = 0.2;
  return scene;
}

// One picture after the other; what is found, in place of what the world says was seen.
part_alignment::Measurement SeenInPictures(const Scene& scene) {
  auto measured = test::MeasurementOf(scene.world, scene.name, 1, true);
  part_alignment::FinderWorkspace workspace;
  const Random noise = sim::PicturesOf(scene.name);
  for (std::size_t stop = 0; stop < measured.views.size(); ++stop) {
    const auto page = sim::TakePicture(
        sim::PictureAt(scene.world, stop, scene.patterns, scene.hidden, scene.like),
        noise.Fork(stop));
    EXPECT_TRUE(page) << (page ? "" : page.error().message);
    const auto found = part_alignment::FindTargets(page->view(), scene.book, {}, workspace);
    EXPECT_TRUE(found) << (found ? "" : found.error().message);
    const auto exact = measured.views[stop].observations;
    measured.views[stop].observations.clear();
    for (const part_alignment::FoundTarget& target : found->targets) {
      const std::string id = std::to_string(target.number.value_or(0));
      EXPECT_EQ(id, exact.front().target) << "a code that is not there, stop " << stop;
      if (id != exact.front().target) continue;
      EXPECT_NEAR(target.disc.column_px, exact.front().column_px, kUncorrected_px);
      EXPECT_NEAR(target.disc.row_px, exact.front().row_px, kUncorrected_px);
      measured.views[stop].observations.push_back(
          {id, target.disc.column_px, target.disc.row_px,
           std::max(target.sigma_column_px, target.sigma_row_px)});
    }
  }
  std::erase_if(measured.views, [](const auto& view) { return view.observations.empty(); });
  return measured;
}

// Takes the eccentricity out, by a first answer.
part_alignment::Measurement Corrected(const Scene& scene, part_alignment::Measurement measured) {
  const auto first = Must(part_alignment::Solve(measured, {}));
  for (part_alignment::View& view : measured.views) {
    for (part_alignment::Observation& seen : view.observations) {
      const auto target = std::find_if(measured.targets.begin(), measured.targets.end(),
                                       [&](const auto& t) { return t.id == seen.target; });
      const auto in_camera = [&](const Eigen::Vector3d& part_mm) {
        return part_alignment::CameraFromPart(measured.camera, first.clamping, view,
                                              first.machine_from_part, part_mm);
      };
      const Eigen::Vector3d centre_mm = in_camera(target->ideal_mm);
      const Eigen::Vector3d tip_mm = in_camera(target->ideal_mm + Eigen::Vector3d::UnitZ());
      const auto off = part_alignment::Eccentricity(measured.camera, centre_mm, tip_mm - centre_mm,
                                                    scene.patterns.front().dot_radius_mm);
      EXPECT_TRUE(off);
      if (!off) continue;
      seen.column_px -= off->x();
      seen.row_px -= off->y();
    }
  }
  return measured;
}

void ExpectTruth(const Scene& scene, const part_alignment::Measurement& found) {
  const auto measured = Corrected(scene, found);
  const auto exact = test::MeasurementOf(scene.world, scene.name, 1, true);
  for (const part_alignment::View& view : measured.views) {
    const auto same = std::find_if(exact.views.begin(), exact.views.end(), [&](const auto& other) {
      return other.spindle_mm == view.spindle_mm;
    });
    EXPECT_NEAR(view.observations[0].column_px, same->observations[0].column_px, kCentre_px);
    EXPECT_NEAR(view.observations[0].row_px, same->observations[0].row_px, kCentre_px);
  }
  const auto solved = part_alignment::Solve(measured, {});
  ASSERT_TRUE(solved) << solved.error().message;
  ASSERT_EQ(solved->verdict, Verdict::kGood) << solved->reason;
  const Eigen::VectorXd truth = test::TruthOf(scene.world);
  const Eigen::Vector3d off_mm = solved->machine_from_part.translation_mm - truth.head<3>();
  const Eigen::Vector3d turned = solved->machine_from_part.angles_rad - truth.segment<3>(3);
  const double clamped = solved->clamping.angle_rad - truth[6];
  fmt::print(
      "seed {}: off by ({:.2f}, {:.2f}, {:.2f}) um, ({:.2f}, {:.2f}, "
      "{:.2f}) urad, clamp "
      "angle {:.2f} urad\n",
      Seed(), 1000 * off_mm[0], 1000 * off_mm[1], 1000 * off_mm[2], 1e6 * turned[0],
      1e6 * turned[1], 1e6 * turned[2], 1e6 * clamped);
  EXPECT_LT(std::abs(off_mm[0]), kAcross_mm);
  EXPECT_LT(std::abs(off_mm[1]), kAcross_mm);
  EXPECT_LT(std::abs(off_mm[2]), kDepth_mm);
  for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(turned[i]), kAngle_rad);
  EXPECT_LT(std::abs(clamped), kClampAngle_rad);
}

TEST(AlignPicture, FromPicturesOfALitteredPartToItsPlace) {
  const Scene scene = MakeScene();
  const auto measured = SeenInPictures(scene);
  EXPECT_EQ(measured.views.size(), 8U);
  ExpectTruth(scene, measured);
}

TEST(AlignPicture, RetroreflectingTargetsUnderLeds) {
  Scene scene = MakeScene();
  scene.like.light = sim::RetroLight();
  const auto measured = SeenInPictures(scene);
  EXPECT_EQ(measured.views.size(), 8U);
  ExpectTruth(scene, measured);
}

TEST(AlignPicture, AHalfHiddenTargetIsLeftOutAndTheRestIsEnough) {
  Scene scene = MakeScene();
  scene.hidden[1] = {{0.3, 2.2, 0}};
  const auto measured = SeenInPictures(scene);
  EXPECT_EQ(measured.views.size(), 6U);
  ExpectTruth(scene, measured);
}

TEST(AlignPicture, TargetsSeenAt18DegreesAreCorrectedForTheirTilt) {
  const Scene scene = MakeScene({0.25, -0.2, 0.1});
  const auto measured = SeenInPictures(scene);
  EXPECT_EQ(measured.views.size(), 8U);
  ExpectTruth(scene, measured);
}

}  // namespace
}  // namespace trammel
