#include "report/alignment_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace trammel::report {
namespace {

using part_alignment::Alignment;
using part_alignment::AlignmentResidual;

constexpr double kCoverage = 2;
constexpr double kPerMille = 1e3;
constexpr double kPercent = 100;

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

// Each of the values with its own uncertainty, times `scale`.
std::string Values(const Alignment& alignment, std::initializer_list<std::string> parameters,
                   std::initializer_list<double> values, double scale, const char* unit) {
  std::string text;
  auto parameter = parameters.begin();
  for (const double value : values) {
    text += fmt::format("{}{:.4f} ± {:.4f}", text.empty() ? "" : ", ", value * scale,
                        Expanded(alignment, *parameter++) * scale);
  }
  return fmt::format("{} {}\n", text, unit);
}

std::string Clamping(const AlignmentOutput& output) {
  const Alignment& alignment = output.alignment;
  const part_alignment::Clamping& clamping = alignment.clamping;
  std::string text;
  if (output.solved.clamp_angle) {
    text += "clamping   angle " +
            Values(alignment, {"clamp_angle_rad"}, {clamping.angle_rad}, kPerMille, "mm/m");
  }
  if (output.solved.clamp_eccentricity) {
    text += "clamping   eccentricity " +
            Values(alignment, {"clamp_eccentricity_x_mm", "clamp_eccentricity_y_mm"},
                   {clamping.eccentricity_mm.x(), clamping.eccentricity_mm.y()}, 1, "mm");
  }
  if (output.solved.clamp_tilt) {
    text += "clamping   tilt " + Values(alignment, {"clamp_tilt_x_rad", "clamp_tilt_y_rad"},
                                        {clamping.tilt_rad.x(), clamping.tilt_rad.y()}, kPerMille,
                                        "mm/m");
  }
  if (output.solved.focal_length) {
    text += "camera     focal length " +
            Values(alignment, {"focal_length_mm"}, {alignment.focal_length_mm}, 1, "mm");
  }
  if (output.solved.camera_offset) {
    const Eigen::Vector3d& mm = alignment.camera_offset_mm;
    text += "camera     offset " +
            Values(alignment, {"camera_offset_x_mm", "camera_offset_y_mm", "camera_offset_z_mm"},
                   {mm.x(), mm.y(), mm.z()}, 1, "mm");
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
    if (name == "clamp_eccentricity_mm") {
      add("clamp eccentricity", inputs.clamp_eccentricity_mm.value_or(0));
    }
    if (name == "camera_offset_mm") add("camera in its taper", inputs.camera_offset_mm.value_or(0));
  }
  if (text.empty()) return {};
  return fmt::format("not stated {} (k = 1): usual sizes, in the figures above\n", text);
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
      "region\n           (k = 2)            simulated     stated\n",
      simulated.trials, simulated.failed, kPercent * simulated.inside95);
  for (std::size_t i = 0; i < simulated.parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    std::string name = simulated.parameters[i];
    const bool angle = name.ends_with("_rad");
    const double scale = angle ? kPerMille : 1;
    const double stated = Expanded(alignment, name);
    const double expanded = kCoverage * std::sqrt(simulated.covariance(k, k));
    name.resize(name.rfind('_'));
    text += fmt::format("  {:<24} ± {:>8.4f} ± {:>8.4f} {}\n", name, expanded * scale,
                        stated * scale, angle ? "mm/m" : "mm");
  }
  return text;
}

}  // namespace

std::string ObservabilityText(const part_alignment::Observability& told,
                              const std::string& reason) {
  if (told.unknowns == 0) return {};
  std::string text = fmt::format("views tell {} of {} unknowns", told.rank, told.unknowns);
  if (std::isfinite(told.weakest_sigma_mm)) {
    text += fmt::format("; the weakest direction to {:.4f} mm (k = 1)", told.weakest_sigma_mm);
  }
  text += "\n";
  const bool said = reason.find(told.words) != std::string::npos;
  if (!said) text += fmt::format("           {}\n", told.words);
  if (!told.advice.empty()) text += fmt::format("to add     {}\n", told.advice);
  return text;
}

std::string AlignmentText(const AlignmentOutput& output) {
  const Alignment& alignment = output.alignment;
  std::string text = fmt::format("verdict    {}\n", ToString(alignment.verdict));
  if (!alignment.reason.empty()) text += fmt::format("reason     {}\n", alignment.reason);
  if (alignment.verdict == Verdict::kGood) {
    text += Pose(alignment) + Clamping(output) + UsualInputs(alignment);
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
