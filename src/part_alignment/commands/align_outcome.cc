#include "part_alignment/commands/align_outcome.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "app/provenance.h"
#include "document/interval_text.h"
#include "part_alignment/files/alignment_result.h"

namespace trammel::app {
namespace {

using part_alignment::Alignment;

struct Parameter {
  std::string name;  ///< as in Alignment::parameters
  double value = 0;
};

/// Every one that was solved for.
std::vector<Parameter> ParametersOf(const report::AlignmentOutput& output) {
  const Alignment& alignment = output.alignment;
  const part_alignment::Unknowns& solved = output.solved;
  const part_alignment::Clamping& clamping = alignment.clamping;
  const Eigen::Vector3d& mm = alignment.machine_from_part.translation_mm;
  const Eigen::Vector3d& rad = alignment.machine_from_part.angles_rad;
  std::vector<Parameter> all{{"x_mm", mm.x()},       {"y_mm", mm.y()},      {"z_mm", mm.z()},
                             {"alpha_rad", rad.x()}, {"beta_rad", rad.y()}, {"gamma_rad", rad.z()}};
  const auto add = [&all](bool is_solved, std::vector<Parameter> more) {
    if (is_solved) std::move(more.begin(), more.end(), std::back_inserter(all));
  };
  add(solved.clamp_angle, {{"clamp_angle_rad", clamping.angle_rad}});
  add(solved.clamp_eccentricity, {{"clamp_eccentricity_x_mm", clamping.eccentricity_mm.x()},
                                  {"clamp_eccentricity_y_mm", clamping.eccentricity_mm.y()}});
  add(solved.clamp_tilt,
      {{"clamp_tilt_x_rad", clamping.tilt_rad.x()}, {"clamp_tilt_y_rad", clamping.tilt_rad.y()}});
  add(solved.focal_length, {{"focal_length_mm", alignment.focal_length_mm}});
  add(solved.camera_offset, {{"camera_offset_x_mm", alignment.camera_offset_mm.x()},
                             {"camera_offset_y_mm", alignment.camera_offset_mm.y()},
                             {"camera_offset_z_mm", alignment.camera_offset_mm.z()}});
  return all;
}

Measured MeasuredOf(const Alignment& alignment, const Parameter& parameter) {
  if (alignment.verdict == Verdict::kRefused) return Measured::Refused(alignment.reason);
  if (alignment.verdict == Verdict::kCannotTell) return Measured::CannotTell(alignment.reason);
  const auto found = std::ranges::find(alignment.parameters, parameter.name);
  TRAMMEL_CHECK(found != alignment.parameters.end(), "no variance of {}", parameter.name);
  const auto i = std::distance(alignment.parameters.begin(), found);
  const double sigma = std::sqrt(std::max(0.0, alignment.covariance(i, i)));
  return Measured::Good({parameter.value, sigma, report::NormalInterval95(parameter.value, sigma)});
}

}  // namespace

ResultFile ResultOf(const report::AlignmentOutput& output, std::string source) {
  measurement::Outcome outcome;
  outcome.provenance = ProvenanceOf(measurement::Instrument::kPartAlignment, {std::move(source)});
  constexpr std::size_t kPose = files::kPoseAnswers.size();
  for (const Parameter& parameter : ParametersOf(output)) {
    const std::size_t i = outcome.answers.size();
    const std::size_t unit = parameter.name.rfind('_');
    outcome.answers.push_back(
        {i < kPose ? std::string(files::kPoseAnswers.at(i)) : parameter.name.substr(0, unit),
         parameter.name.substr(unit + 1), MeasuredOf(output.alignment, parameter)});
  }
  outcome.notices = output.alignment.notices;
  return {std::move(outcome), report::JsonOf(output)};
}

}  // namespace trammel::app
