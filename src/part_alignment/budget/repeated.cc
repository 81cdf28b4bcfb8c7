#include "part_alignment/budget/repeated.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "geometry/decompositions.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

Result<void> SameTargets(std::span<const Measurement> measurements) {
  for (std::size_t m = 1; m < measurements.size(); ++m) {
    const auto& first = measurements[0].targets;
    const auto& other = measurements[m].targets;
    bool same = first.size() == other.size();
    for (std::size_t i = 0; same && i < first.size(); ++i) {
      same = first[i].id == other[i].id && first[i].ideal_mm == other[i].ideal_mm;
    }
    if (!same) {
      return Fail(
          fmt::format("measurement {} has other targets than the first: repeats are of one "
                      "part",
                      m + 1));
    }
  }
  return {};
}

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// A pose against another close to it, as a small motion in the part's own frame.
Vector6 MotionBetween(const geometry::Pose& from, const geometry::Pose& to) {
  const Eigen::Matrix3d rotation = geometry::RotationFromAngles(from.angles_rad);
  const Eigen::Matrix3d turn = rotation.transpose() * geometry::RotationFromAngles(to.angles_rad);
  Vector6 motion;
  motion << rotation.transpose() * (to.translation_mm - from.translation_mm),
      (turn(2, 1) - turn(1, 2)) / 2, (turn(0, 2) - turn(2, 0)) / 2, (turn(1, 0) - turn(0, 1)) / 2;
  return motion;
}

// Without what rounding leaves where nothing scatters: its correlations would be no ones, and would
// be taken out of the others with it.
Matrix6 Counting(Matrix6 covariance) {
  constexpr double kRounding_mm = 1e-9;
  constexpr double kRounding_rad = 1e-12;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double rounding = i < 3 ? kRounding_mm : kRounding_rad;
    if (covariance(i, i) > rounding * rounding) continue;
    covariance.row(i).setZero();
    covariance.col(i).setZero();
  }
  return covariance;
}

// SplitScatter's sum of all components, for six numbers with their correlations.
Matrix6 SplitMotion(const std::vector<std::vector<Vector6>>& motions) {
  const auto c = static_cast<double>(motions.size());
  const auto m = static_cast<double>(motions[0].size());
  Vector6 mean = Vector6::Zero();
  std::vector<Vector6> of_calibration(motions.size(), Vector6::Zero());
  std::vector<Vector6> of_measurement(motions[0].size(), Vector6::Zero());
  for (std::size_t i = 0; i < motions.size(); ++i) {
    for (std::size_t j = 0; j < motions[i].size(); ++j) {
      of_calibration[i] += motions[i][j] / m;
      of_measurement[j] += motions[i][j] / c;
      mean += motions[i][j] / (c * m);
    }
  }
  Matrix6 between_c = Matrix6::Zero();
  Matrix6 between_m = Matrix6::Zero();
  Matrix6 rest = Matrix6::Zero();
  const auto square = [](const Vector6& v) -> Matrix6 { return v * v.transpose(); };
  for (std::size_t i = 0; i < motions.size(); ++i) {
    between_c += m * square(of_calibration[i] - mean) / (c - 1);
    for (std::size_t j = 0; j < motions[i].size(); ++j) {
      rest += square(motions[i][j] - of_calibration[i] - of_measurement[j] + mean) /
              ((c - 1) * (m - 1));
    }
  }
  for (const Vector6& of : of_measurement) between_m += c * square(of - mean) / (m - 1);
  const Matrix6 root_c = geometry::CovarianceRoot(Counting((between_c - rest) / m));
  const Matrix6 root_m = geometry::CovarianceRoot(Counting((between_m - rest) / c));
  return root_c * root_c.transpose() + root_m * root_m.transpose() + rest;
}

}  // namespace

Result<RepeatedAlignments> RepeatAlignments(std::span<const Camera> cameras,
                                            std::span<const Measurement> measurements,
                                            const SolveOptions& options) {
  if (cameras.size() < 2 || measurements.size() < 2) {
    return Fail(fmt::format("{} calibrations with {} measurements; two or more of each are needed",
                            cameras.size(), measurements.size()));
  }
  if (const auto same = SameTargets(measurements); !same) return tl::unexpected(same.error());
  const auto& targets = measurements[0].targets;
  // By target, calibration and measurement.
  std::vector<std::vector<std::vector<Vector3d>>> at(
      targets.size(), std::vector<std::vector<Vector3d>>(cameras.size()));
  std::vector<std::vector<Vector6>> motions(cameras.size());
  std::optional<geometry::Pose> first;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    for (std::size_t m = 0; m < measurements.size(); ++m) {
      Measurement measurement = measurements[m];
      measurement.camera = cameras[c];
      const auto solved = Solve(measurement, options);
      if (!solved) return tl::unexpected(solved.error());
      if (solved->verdict != Verdict::kGood) {
        return Fail(
            fmt::format("calibration {} with measurement {}: {}", c + 1, m + 1, solved->reason),
            ErrorKind::kMeasurement);
      }
      const geometry::Pose& pose = solved->machine_from_part;
      if (!first) first = pose;
      motions[c].push_back(MotionBetween(*first, pose));
      const Eigen::Matrix3d rotation = geometry::RotationFromAngles(pose.angles_rad);
      for (std::size_t i = 0; i < targets.size(); ++i) {
        at[i][c].emplace_back(rotation * targets[i].ideal_mm + pose.translation_mm);
      }
    }
  }
  RepeatedAlignments repeated;
  repeated.motion_covariance = SplitMotion(motions);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const auto split = SplitScatter(at[i]);
    if (!split) return tl::unexpected(split.error());
    repeated.single_mm += split->single_mm.cwiseAbs2() / static_cast<double>(targets.size());
    repeated.joint_mm += split->joint_mm.cwiseAbs2() / static_cast<double>(targets.size());
    repeated.targets.push_back({targets[i].id, *split});
  }
  repeated.single_mm = repeated.single_mm.cwiseSqrt();
  repeated.joint_mm = repeated.joint_mm.cwiseSqrt();
  return repeated;
}

}  // namespace trammel::part_alignment
