#include "casting_world.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "geometry/euler.h"
#include "part_alignment/files/stl_file.h"
#include "part_alignment/mesh/solid_mesh.h"

namespace trammel {

using Eigen::Vector3d;

namespace {

constexpr double kSigma_mm = 0.05;

Vector3d InMeasurement(const sim::Casting& casting, const Vector3d& ideal_mm) {
  return casting.rotation.transpose() * (ideal_mm - casting.translation_mm);
}

}  // namespace

CastingWorld MakeCastingWorld(const Vector3d& half_mm, const sim::CastingTraits& traits,
                              std::uint64_t seed) {
  CastingWorld world;
  world.part = sim::DrawFreeform(half_mm, seed);
  world.casting = sim::DrawCasting(world.part, traits, seed);
  for (std::size_t i = 0; i < world.casting.measured_mm.size(); ++i) {
    world.input.points.push_back(
        {fmt::format("p{}", i), world.casting.measured_mm[i], kSigma_mm, "casting"});
  }
  for (const Vector3d& sign :
       {Vector3d(-1, -1, 1), Vector3d(1, -1, 1), Vector3d(1, 1, 1), Vector3d(-1, 1, 1)}) {
    world.targets_mm.emplace_back(half_mm.cwiseProduct(sign));
    world.input.points.push_back({fmt::format("T{}", world.targets_mm.size()),
                                  InMeasurement(world.casting, world.targets_mm.back()), kSigma_mm,
                                  ""});
  }
  world.options.min_stock_allowance_mm = traits.min_mm - world.options.guard_sigmas * kSigma_mm;
  return world;
}

part_alignment::IdealSurface MeshSurface(const std::vector<sim::Facet>& facets, double wanted_mm,
                                         const std::string& unit) {
  const double mm = files::LengthUnitOf(unit)->mm;
  auto mesh = files::ParseStl(sim::BinaryStl(facets, 1 / mm), "part.stl", mm);
  EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().message);
  auto solid = part_alignment::MakeSolid(std::move(*mesh), false);
  EXPECT_TRUE(solid) << (solid ? "" : solid.error().message);
  part_alignment::IdealSurface surface;
  surface.id = "casting";
  surface.kind = part_alignment::SurfaceKind::kMesh;
  surface.stock_allowance_mm = wanted_mm;
  surface.mesh = std::make_shared<part_alignment::MeshDistance>(std::move(*solid));
  return surface;
}

PlacementError ErrorOf(const CastingWorld& world, const part_alignment::PartFit& fit) {
  const Eigen::Matrix3d rotation = geometry::RotationFromAngles(fit.ideal_from_measured.angles_rad);
  const Vector3d middle = InMeasurement(world.casting, Vector3d::Zero());
  return {(rotation * middle + fit.ideal_from_measured.translation_mm).norm(),
          Eigen::AngleAxisd(rotation * world.casting.rotation.transpose()).angle()};
}

double LeastExactStock_mm(const CastingWorld& world, const part_alignment::PartFit& fit) {
  const Eigen::Matrix3d rotation = geometry::RotationFromAngles(fit.ideal_from_measured.angles_rad);
  double least = 1e9;
  for (const Vector3d& measured : world.casting.measured_mm) {
    const Vector3d at = rotation * measured + fit.ideal_from_measured.translation_mm;
    least = std::min(least, sim::StockAt(world.part, at));
  }
  return least;
}

}  // namespace trammel
