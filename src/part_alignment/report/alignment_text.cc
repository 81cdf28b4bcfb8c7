#include "part_alignment/report/alignment_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/interval_text.h"

namespace trammel::report {
namespace {

using part_alignment::Alignment;
using part_alignment::AlignmentResidual;

constexpr double kPercent = 100;

// k = 1, of the parameter with this name; NaN where there is none.
double Sigma(const Alignment& alignment, const std::string& parameter) {
  const auto found = std::find(alignment.parameters.begin(), alignment.parameters.end(), parameter);
  const auto i = static_cast<Eigen::Index>(found - alignment.parameters.begin());
  if (found == alignment.parameters.end() || i >= alignment.covariance.rows()) return NAN;
  return std::sqrt(std::max(0.0, alignment.covariance(i, i)));
}

std::string ParameterText(const Alignment& alignment, const std::string& parameter, double value) {
  const IntervalStyle& style = parameter.ends_with("_rad") ? kPerMille : kMillimetres;
  return WithInterval(value, NormalInterval95(value, Sigma(alignment, parameter)), style);
}

std::string Pose(const Alignment& alignment) {
  const Eigen::Vector3d& mm = alignment.machine_from_part.translation_mm;
  const Eigen::Vector3d& rad = alignment.machine_from_part.angles_rad;
  std::string text = "part\n";
  const auto add = [&](const std::string& name, const char* unit, double value) {
    text += fmt::format("  {:<8} {}\n", name, ParameterText(alignment, name + unit, value));
  };
  add("x", "_mm", mm.x());
  add("y", "_mm", mm.y());
  add("z", "_mm", mm.z());
  add("alpha", "_rad", rad.x());
  add("beta", "_rad", rad.y());
  add("gamma", "_rad", rad.z());
  return text;
}

std::string Clamping(const AlignmentOutput& output) {
  const Alignment& alignment = output.alignment;
  const part_alignment::Clamping& clamping = alignment.clamping;
  std::string text;
  const auto add = [&](const char* what, const std::string& parameter, double value) {
    text += fmt::format("{:<10} {} {}\n", text.empty() ? "clamping" : "", what,
                        ParameterText(alignment, parameter, value));
  };
  if (output.solved.clamp_angle) add("angle", "clamp_angle_rad", clamping.angle_rad);
  if (output.solved.clamp_eccentricity) {
    add("eccentricity x", "clamp_eccentricity_x_mm", clamping.eccentricity_mm.x());
    add("eccentricity y", "clamp_eccentricity_y_mm", clamping.eccentricity_mm.y());
  }
  if (output.solved.clamp_tilt) {
    add("tilt x", "clamp_tilt_x_rad", clamping.tilt_rad.x());
    add("tilt y", "clamp_tilt_y_rad", clamping.tilt_rad.y());
  }
  if (output.solved.focal_length) {
    add("focal length", "focal_length_mm", alignment.focal_length_mm);
  }
  if (output.solved.camera_offset) {
    const Eigen::Vector3d& mm = alignment.camera_offset_mm;
    add("camera's place x", "camera_offset_x_mm", mm.x());
    add("camera's place y", "camera_offset_y_mm", mm.y());
    add("camera's place z", "camera_offset_z_mm", mm.z());
  }
  return text;
}

// What the stated figure holds although nobody stated it.
std::string UsualInputs(const Alignment& alignment) {
  const part_alignment::InputUncertainty& inputs = alignment.inputs;
  std::string text;
  for (const std::string& name : alignment.usual_inputs) {
    const auto add = [&](const char* words, double size_mm) {
      text += fmt::format("{}{} {:.4f} mm", text.empty() ? "" : ", ", words, size_mm);
    };
    if (name == "machine_mm") add("machine's repeatability", inputs.machine_mm.value_or(0));
    if (name == "target_mm") add("targets' places", inputs.target_mm.value_or(0));
    if (name == "clamp_eccentricity_mm") {
      add("clamp eccentricity", inputs.clamp_eccentricity_mm.value_or(0));
    }
    if (name == "camera_offset_mm") add("camera in its taper", inputs.camera_offset_mm.value_or(0));
  }
  if (text.empty()) return {};
  return fmt::format(
      "not stated {} (standard uncertainties): usual sizes, or what the residuals ask for; in the "
      "figures above\n",
      text);
}

std::string Residuals(const Alignment& alignment) {
  double largest = 0;
  int counted = 0;
  const AlignmentResidual* worst = nullptr;
  for (const AlignmentResidual& residual : alignment.residuals) {
    if (residual.weight == 0) continue;
    ++counted;
    const double size = std::hypot(residual.column_px, residual.row_px);
    if (size >= largest) {
      largest = size;
      worst = &residual;
    }
  }
  if (worst == nullptr) return {};
  return fmt::format(
      "residuals  {} of {} observations, {:.2f} of their sigmas; largest {:.3f} px, target "
      "{} in view {}\n",
      counted, alignment.residuals.size(), alignment.residual_rms_sigma, largest, worst->target,
      worst->view + 1);
}

// Each parameter's scatter beside what the covariance states for it.
std::string Simulated(const Alignment& alignment,
                      const part_alignment::MonteCarloUncertainty& simulated) {
  std::string text = fmt::format(
      "simulated  {} measurements, {} more without a solution; {:.1f} % lie in the linear 95 % "
      "region\n           95 % within        simulated     stated\n",
      simulated.trials, simulated.failed, kPercent * simulated.inside95);
  for (std::size_t i = 0; i < simulated.parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    std::string name = simulated.parameters[i];
    const bool angle = name.ends_with("_rad");
    const double scale = angle ? kPerMille.scale : 1;
    const double stated = kNormal95 * Sigma(alignment, name);
    const double expanded = kNormal95 * std::sqrt(simulated.covariance(k, k));
    name.resize(name.rfind('_'));
    text += fmt::format("  {:<24} {:>10.4f} {:>10.4f} {}\n", name, expanded * scale, stated * scale,
                        angle ? "mm/m" : "mm");
  }
  return text;
}

}  // namespace

std::string ObservabilityText(const part_alignment::Observability& told,
                              const std::string& reason) {
  if (told.unknowns == 0) return {};
  std::string text = fmt::format("views tell {} of {} unknowns", told.rank, told.unknowns);
  if (std::isfinite(told.weakest_sigma_mm)) {
    const double half_mm[] = {kNormal95 * told.weakest_sigma_mm};
    text += "; along the weakest direction " + WithinText(half_mm, kMillimetres);
  }
  text += "\n";
  const bool said = reason.find(told.words) != std::string::npos;
  if (!said) text += fmt::format("           {}\n", told.words);
  if (!told.advice.empty()) text += fmt::format("to add     {}\n", told.advice);
  return text;
}

std::string AlignmentText(const AlignmentOutput& output) {
  const Alignment& alignment = output.alignment;
  std::string text = fmt::format("verdict    {}\n", VerdictWords(alignment.verdict));
  if (!alignment.reason.empty()) text += fmt::format("reason     {}\n", alignment.reason);
  if (alignment.verdict == Verdict::kGood) {
    text += Pose(alignment) + Clamping(output) + UsualInputs(alignment);
  }
  if (alignment.check.observations > 0) {
    text += fmt::format("check      {}\n", CheckWords(alignment.check));
  }
  if (output.simulated) text += Simulated(alignment, *output.simulated);
  text += ObservabilityText(alignment.observability, alignment.reason);
  text += Residuals(alignment);
  for (const std::string& notice : alignment.notices) {
    text += fmt::format("notice     {}\n", notice);
  }
  return text;
}

}  // namespace trammel::report
