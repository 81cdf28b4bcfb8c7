#include "part_alignment/repeated.h"

#include <fmt/format.h>

#include <cmath>

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
      const Eigen::Matrix3d rotation = geometry::RotationFromAngles(pose.angles_rad);
      for (std::size_t i = 0; i < targets.size(); ++i) {
        at[i][c].emplace_back(rotation * targets[i].ideal_mm + pose.translation_mm);
      }
    }
  }
  RepeatedAlignments repeated;
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
