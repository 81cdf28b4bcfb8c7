#include "part_alignment/pose/contributions.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "part_alignment/pose/pose_uncertainty.h"

namespace trammel::part_alignment {
namespace {

/// Without the observations that the answer left out.
Measurement Kept(Measurement measurement, const Alignment& alignment) {
  for (const AlignmentResidual& residual : alignment.residuals) {
    if (residual.weight != 0 || residual.view >= measurement.views.size()) continue;
    std::erase_if(measurement.views[residual.view].observations,
                  [&](const Observation& seen) { return seen.target == residual.target; });
  }
  return measurement;
}

std::optional<Eigen::Vector3d> Sigma(const Measurement& measurement, const SolveOptions& options,
                                     const Alignment& alignment) {
  const auto told =
      PropagateLinearly(measurement, options, {alignment.machine_from_part, alignment.clamping});
  if (!told || told->covariance.rows() < 3) return std::nullopt;
  return Eigen::Vector3d(told->covariance.diagonal().head<3>().cwiseMax(0).cwiseSqrt());
}

struct Input {
  std::string name;
  double size = 0;
  bool counts = false;
  std::function<void(SolveOptions&)> make_exact;
};

std::vector<Input> InputsOf(const SolveOptions& options) {
  const InputUncertainty& in = options.inputs;
  const Unknowns& unknowns = options.unknowns;
  const double machine = in.machine_mm.value_or(0);
  const double target = in.target_mm.value_or(0);
  const double eccentricity = in.clamp_eccentricity_mm.value_or(0);
  const double camera_offset = in.camera_offset_mm.value_or(0);
  return {{"machine_mm", machine, machine > 0, [](SolveOptions& o) { o.inputs.machine_mm = 0; }},
          {"target_mm", target, target > 0, [](SolveOptions& o) { o.inputs.target_mm = 0; }},
          {"clamp_angle_rad", in.clamp_angle_rad, in.clamp_angle_rad > 0 && !unknowns.clamp_angle,
           [](SolveOptions& o) { o.inputs.clamp_angle_rad = 0; }},
          {"clamp_eccentricity_mm", eccentricity, eccentricity > 0 && !unknowns.clamp_eccentricity,
           [](SolveOptions& o) { o.inputs.clamp_eccentricity_mm = 0; }},
          {"clamp_tilt_rad", in.clamp_tilt_rad, in.clamp_tilt_rad > 0 && !unknowns.clamp_tilt,
           [](SolveOptions& o) { o.inputs.clamp_tilt_rad = 0; }},
          {"focal_length_mm", in.focal_length_mm, in.focal_length_mm > 0 && !unknowns.focal_length,
           [](SolveOptions& o) { o.inputs.focal_length_mm = 0; }},
          {"camera_offset_mm", camera_offset, camera_offset > 0 && !unknowns.camera_offset,
           [](SolveOptions& o) { o.inputs.camera_offset_mm = 0; }},
          {"targets", 0, options.target_covariance.has_value(),
           [](SolveOptions& o) { o.target_covariance.reset(); }},
          {"camera", 0, options.camera_covariance.has_value(),
           [](SolveOptions& o) { o.camera_covariance.reset(); }}};
}

}  // namespace

std::vector<Contribution> ContributionsOf(const Measurement& measurement,
                                          const SolveOptions& stated, const Alignment& alignment) {
  if (alignment.verdict != Verdict::kGood) return {};
  SolveOptions options = stated;
  options.inputs = alignment.inputs;
  const Measurement kept = Kept(measurement, alignment);
  const auto all = Sigma(kept, options, alignment);
  if (!all) return {};
  std::vector<Contribution> parts;
  SolveOptions exact = options;
  for (const Input& input : InputsOf(options)) {
    if (!input.counts) continue;
    SolveOptions without = options;
    input.make_exact(without);
    input.make_exact(exact);
    const auto sigma = Sigma(kept, without, alignment);
    if (!sigma) continue;
    const bool usual = std::find(alignment.usual_inputs.begin(), alignment.usual_inputs.end(),
                                 input.name) != alignment.usual_inputs.end();
    parts.push_back({input.name, input.size, usual, *sigma});
  }
  std::stable_sort(parts.begin(), parts.end(), [](const Contribution& a, const Contribution& b) {
    return a.sigma_mm.norm() < b.sigma_mm.norm();
  });
  parts.insert(parts.begin(), Contribution{"all", 0, false, *all});
  if (const auto pixels = Sigma(kept, exact, alignment)) {
    parts.push_back({"pixels", 0, false, *pixels});
  }
  return parts;
}

}  // namespace trammel::part_alignment
