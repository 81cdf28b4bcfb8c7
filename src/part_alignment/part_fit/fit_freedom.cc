#include "part_alignment/part_fit/fit_freedom.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "geometry/decompositions.h"
#include "part_alignment/mesh/facet_error.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// How much of the normal matrix the triangles' own tilt could be.
Matrix6 TiltMatrix(const Problem& problem, const Linear& linear, const Motion& motion) {
  Matrix6 sum = Matrix6::Zero();
  if (!problem.has_mesh) return sum;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const SurfaceContact& contact = problem.contacts[i];
    if (contact.surface->kind != SurfaceKind::kMesh) continue;
    const double tilt_rad = FacetErrorOf(*contact.surface->mesh, linear.triangles[i]).tilt_rad;
    const Eigen::Vector3d from_middle = motion(contact.at_mm) - linear.middle_mm;
    Eigen::Matrix<double, 3, 6> displaced;
    displaced.leftCols<3>().setIdentity();
    for (int axis = 0; axis < 3; ++axis) {
      displaced.col(3 + axis) = Eigen::Vector3d::Unit(axis).cross(from_middle) / problem.size_mm;
    }
    sum += tilt_rad * tilt_rad * displaced.transpose() * displaced;
  }
  return sum;
}

std::string WordsOf(const Vector6& motion) {
  constexpr const char* kNames[] = {"a shift along x", "a shift along y", "a shift along z",
                                    "a turn about x",  "a turn about y",  "a turn about z"};
  std::string words;
  constexpr double kShare = 0.3;
  for (int i = 0; i < 6; ++i) {
    if (std::abs(motion[i]) > kShare)
      words += (words.empty() ? "" : " with ") + std::string(kNames[i]);
  }
  return words;
}

}  // namespace

std::string FreeMotions(const Problem& problem, const Linear& linear, const Motion& motion) {
  if (problem.contacts.empty()) return "everything";
  const Matrix6 normal = linear.by_motion.transpose() * linear.by_motion;
  const Matrix6 tilt = TiltMatrix(problem, linear, motion);
  const geometry::SymmetricEigen of = geometry::DecomposeSymmetric(normal);
  constexpr double kFree = 1e-8;
  std::string words;
  for (int i = 0; i < 6; ++i) {
    const Vector6 vector = of.vectors.col(i);
    const double by_tilt = vector.dot(tilt * vector);
    if (of.values[i] > std::max(kFree * of.values[5], by_tilt)) continue;
    words += (words.empty() ? "" : ", and ") + WordsOf(vector);
  }
  return words;
}

}  // namespace trammel::part_alignment
