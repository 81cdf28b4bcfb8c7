#include "part_alignment/survey/survey_discs.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "part_alignment/targets/eccentricity.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFocal_px = 1100;
constexpr double kRadius_mm = 15;

/// A disc of 15 mm at 1.2 m, in the middle of pictures from all around, up to 60 degrees oblique.
struct Discs {
  Network network;
  std::vector<std::optional<ImageEllipse>> discs;
  std::vector<Vector2d> centres;  ///< images of the disc's centre
};

Discs SeeDisc(int stations) {
  Discs seen;
  Network& network = seen.network;
  network.lens = PlainLens(kFocal_px, 1600, 1200);
  network.points.push_back({Vector3d(40, -30, 20), true});
  const Vector3d normal = Vector3d(0.2, -0.1, 1).normalized();
  Camera camera;
  camera.looks_along = LooksAlong::kPlusZ;
  camera.width_px = 1600;
  camera.height_px = 1200;
  camera.pixel_pitch_mm = 0.001;
  camera.focal_length_mm = 0.001 * kFocal_px;
  for (int i = 0; i < stations; ++i) {
    const double azimuth = 0.9 * i;
    const double lean = 0.4 + 0.08 * (i % 8);
    const Vector3d towards(std::cos(azimuth) * std::sin(lean), std::sin(azimuth) * std::sin(lean),
                           std::cos(lean));
    Station station;
    station.place = 1200 * towards;
    Eigen::Matrix3d rotation;
    const Vector3d right = towards.unitOrthogonal();
    rotation << right.transpose(), right.cross(towards).transpose(), -towards.transpose();
    station.rotation = rotation;
    station.placed = true;
    network.stations.push_back(station);
    const Vector3d at = station.FromObject(network.points[0].at);
    const auto disc = ImageOfDisc(camera, at, station.rotation * normal, kRadius_mm);
    EXPECT_TRUE(disc);
    seen.discs.push_back(disc);
    seen.centres.push_back(*Project(camera, at));
    network.observations.push_back(
        {std::size_t(i), 0, {disc->column_px, disc->row_px}, 0.01, true});
  }
  return seen;
}

TEST(CorrectDiscs, GivesTheImagesOfTheCentres) {
  Discs seen = SeeDisc(12);
  double before_px = 0;
  for (std::size_t i = 0; i < seen.centres.size(); ++i) {
    before_px = std::max(before_px, (seen.network.observations[i].pixel - seen.centres[i]).norm());
  }
  EXPECT_GT(before_px, 0.05);
  std::vector<bool> corrected;
  CorrectDiscs(seen.discs, corrected, seen.network);
  constexpr double kShare = 0.02;  // first order in the disc's size against its distance
  for (std::size_t i = 0; i < seen.centres.size(); ++i) {
    EXPECT_LT((seen.network.observations[i].pixel - seen.centres[i]).norm(), kShare * before_px)
        << i;
    EXPECT_GT(seen.network.observations[i].sigma_px, 0.01);
    EXPECT_LT(seen.network.observations[i].sigma_px, 0.01 + 0.1 * before_px);
  }
}

TEST(CorrectDiscs, WidensTheSigmaWhereTooFewImagesTellTheNormal) {
  Discs seen = SeeDisc(2);
  const Network before = seen.network;
  std::vector<bool> corrected;
  CorrectDiscs(seen.discs, corrected, seen.network);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(seen.network.observations[i].pixel, before.observations[i].pixel);
    EXPECT_GT(seen.network.observations[i].sigma_px,
              (seen.network.observations[i].pixel - seen.centres[i]).norm());
  }
}

}  // namespace
}  // namespace trammel::part_alignment
