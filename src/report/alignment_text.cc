#include "report/alignment_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trammel::report {
namespace {

using part_alignment::Alignment;
using part_alignment::AlignmentResidual;

constexpr double kCoverage = 2;
constexpr double kPerMille = 1e3;

// Expanded, of the parameter with this name; NaN where there is none.
double Expanded(const Alignment& alignment, const std::string& parameter) {
  const auto found = std::find(alignment.parameters.begin(), alignment.parameters.end(), parameter);
  const auto i = static_cast<Eigen::Index>(found - alignment.parameters.begin());
  if (found == alignment.parameters.end() || i >= alignment.covariance.rows()) return NAN;
  return kCoverage * std::sqrt(std::max(0.0, alignment.covariance(i, i)));
}

std::string Pose(const Alignment& alignment) {
  const Eigen::Vector3d& mm = alignment.machine_from_part.translation_mm;
  const Eigen::Vector3d& rad = alignment.machine_from_part.angles_rad;
  std::string text = "part       (± expanded, k = 2)\n";
  const auto length = [&](const char* name, double value) {
    text += fmt::format("  {:<6} {:>14.4f} ± {:.4f} mm\n", name, value,
                        Expanded(alignment, std::string(name) + "_mm"));
  };
  const auto angle = [&](const char* name, double value) {
    text += fmt::format("  {:<6} {:>14.4f} ± {:.4f} mm/m\n", name, value * kPerMille,
                        Expanded(alignment, std::string(name) + "_rad") * kPerMille);
  };
  length("x", mm.x());
  length("y", mm.y());
  length("z", mm.z());
  angle("alpha", rad.x());
  angle("beta", rad.y());
  angle("gamma", rad.z());
  return text;
}

std::string Clamping(const AlignmentOutput& output) {
  const Alignment& alignment = output.alignment;
  const part_alignment::Clamping& clamping = alignment.clamping;
  std::string text;
  if (output.solved.clamp_angle) {
    text += fmt::format("clamping   angle {:.4f} ± {:.4f} mm/m\n", clamping.angle_rad * kPerMille,
                        Expanded(alignment, "clamp_angle_rad") * kPerMille);
  }
  if (output.solved.clamp_eccentricity) {
    text += fmt::format("clamping   eccentricity {:.4f}, {:.4f} mm\n", clamping.eccentricity_mm.x(),
                        clamping.eccentricity_mm.y());
  }
  if (output.solved.clamp_tilt) {
    text += fmt::format("clamping   tilt {:.4f}, {:.4f} mm/m\n", clamping.tilt_rad.x() * kPerMille,
                        clamping.tilt_rad.y() * kPerMille);
  }
  if (output.solved.focal_length) {
    text += fmt::format("camera     focal length {:.5f} mm\n", alignment.focal_length_mm);
  }
  if (output.solved.camera_offset) {
    const Eigen::Vector3d& mm = alignment.camera_offset_mm;
    text += fmt::format("camera     offset {:.4f}, {:.4f}, {:.4f} mm\n", mm.x(), mm.y(), mm.z());
  }
  return text;
}

std::string Residuals(const Alignment& alignment) {
  double largest = 0;
  const AlignmentResidual* worst = nullptr;
  for (const AlignmentResidual& residual : alignment.residuals) {
    const double size = std::hypot(residual.column_px, residual.row_px);
    if (size >= largest && residual.weight > 0) {
      largest = size;
      worst = &residual;
    }
  }
  if (worst == nullptr) return {};
  return fmt::format(
      "residuals  {} observations, {:.2f} of their sigmas; largest {:.3f} px, target "
      "{} in view {}\n",
      alignment.residuals.size(), alignment.residual_rms_sigma, largest, worst->target,
      worst->view);
}

}  // namespace

std::string AlignmentText(const AlignmentOutput& output) {
  const Alignment& alignment = output.alignment;
  std::string text = fmt::format("verdict    {}\n", ToString(alignment.verdict));
  if (!alignment.reason.empty()) text += fmt::format("reason     {}\n", alignment.reason);
  if (alignment.verdict == Verdict::kGood) text += Pose(alignment) + Clamping(output);
  const part_alignment::Observability& told = alignment.observability;
  text += fmt::format("views tell {} of {} unknowns; the weakest direction to {:.4f} mm (k = 1)\n",
                      told.rank, told.unknowns, told.weakest_sigma_mm);
  if (!told.words.empty()) text += fmt::format("           {}\n", told.words);
  if (!told.advice.empty()) text += fmt::format("to add     {}\n", told.advice);
  text += Residuals(alignment);
  for (const std::string& notice : alignment.notices) {
    text += fmt::format("notice     {}\n", notice);
  }
  return text;
}

}  // namespace trammel::report
