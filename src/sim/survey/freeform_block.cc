#include "sim/survey/freeform_block.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace trammel::sim {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

double Lift(const BlockHill& hill, double x_mm, double y_mm) {
  const double square = (Vector2d(x_mm, y_mm) - hill.at_mm).squaredNorm();
  return hill.height_mm * std::exp(-0.5 * square / (hill.width_mm * hill.width_mm));
}

}  // namespace

FreeformBlock DrawBlock(std::uint64_t seed) {
  Random random(seed);
  FreeformBlock block;
  constexpr int kHills = 7;
  for (int i = 0; i < kHills; ++i) {
    BlockHill hill;
    hill.at_mm = {random.Uniform(-0.9, 0.9) * block.half_length_mm,
                  random.Uniform(-0.9, 0.9) * block.half_width_mm};
    const bool steep = i % 2 == 0;
    hill.height_mm = steep ? random.Uniform(60, 120) : random.Uniform(20, 80);
    hill.width_mm = steep ? random.Uniform(80, 140) : random.Uniform(200, 400);
    block.hills.push_back(hill);
  }
  return block;
}

double TopAt(const FreeformBlock& block, double x_mm, double y_mm) {
  double z = 0;
  for (const BlockHill& hill : block.hills) z += Lift(hill, x_mm, y_mm);
  return z;
}

Vector3d TopPoint(const FreeformBlock& block, double x_mm, double y_mm) {
  return {x_mm, y_mm, TopAt(block, x_mm, y_mm)};
}

Vector3d TopNormal(const FreeformBlock& block, double x_mm, double y_mm) {
  Vector2d slope = Vector2d::Zero();
  for (const BlockHill& hill : block.hills) {
    slope += Lift(hill, x_mm, y_mm) / (hill.width_mm * hill.width_mm) *
             (hill.at_mm - Vector2d(x_mm, y_mm));
  }
  return Vector3d(-slope.x(), -slope.y(), 1).normalized();
}

bool IsOpenTo(const FreeformBlock& block, const Vector3d& at_mm, const Vector3d& eye_mm) {
  double highest = 0;
  for (const BlockHill& hill : block.hills) highest += std::max(0.0, hill.height_mm);
  constexpr double kStep_mm = 8;
  const Vector3d step = kStep_mm * (eye_mm - at_mm).normalized();
  const int most = static_cast<int>((eye_mm - at_mm).norm() / kStep_mm);
  Vector3d place = at_mm;
  for (int i = 0; i < most; ++i) {
    place += step;
    if (place.z() > highest && step.z() >= 0) return true;
    const bool within = std::abs(place.x()) < block.half_length_mm &&
                        std::abs(place.y()) < block.half_width_mm && place.z() > -block.depth_mm;
    if (within && place.z() < TopAt(block, place.x(), place.y())) return false;
  }
  return true;
}

}  // namespace trammel::sim
