#include "part_alignment/report/alignment_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/measured_json.h"
#include "document/interval_text.h"
#include "document/json_number.h"
#include "part_alignment/pose/pose_problem.h"
#include "part_alignment/report/answer_page.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::Alignment;
using part_alignment::AlignmentResidual;
using part_alignment::Observability;

constexpr int kFormat = 1;

Json Id(const AlignmentOutput& output, const std::string& id) {
  return output.numeric_ids.contains(id) ? Json::parse(id) : Json(id);
}

// Returns one number for each parameter, under its name.
template <class Vector>
Json ByParameter(const Alignment& alignment, const Vector& values) {
  Json json = Json::object();
  const auto count = static_cast<Eigen::Index>(alignment.parameters.size());
  for (Eigen::Index i = 0; i < count && i < values.size(); ++i) {
    json[alignment.parameters[static_cast<std::size_t>(i)]] = Number(values(i));
  }
  return json;
}

Json Simulated(const AlignmentOutput& output) {
  if (!output.simulated) return nullptr;
  const part_alignment::MonteCarloUncertainty& simulated = *output.simulated;
  const auto named = [&](const Eigen::VectorXd& values) {
    return ByParameter(output.alignment, values);
  };
  return {{"trials", simulated.trials},
          {"failed", simulated.failed},
          {"standard_uncertainty", named(simulated.covariance.diagonal().cwiseSqrt())},
          {"mean_error", named(simulated.mean_error)},
          {"error_low95", named(simulated.low95)},
          {"error_high95", named(simulated.high95)},
          {"share_in_linear_region95", Number(simulated.inside95)}};
}

void AddValues(const AlignmentOutput& output, Json& json) {
  const Alignment& alignment = output.alignment;
  const bool good = alignment.verdict == Verdict::kGood;
  const auto if_told = [good](bool solved, Json value) {
    return good && solved ? std::move(value) : Json(nullptr);
  };
  const Eigen::Vector3d& angles_rad = alignment.machine_from_part.angles_rad;
  const part_alignment::Clamping& clamping = alignment.clamping;
  const part_alignment::Unknowns& solved = output.solved;
  json["part_mm"] = if_told(true, List(alignment.machine_from_part.translation_mm));
  json["part_angles_rad"] = if_told(true, List(angles_rad));
  json["part_angles_mm_per_m"] = if_told(true, List(Eigen::Vector3d(angles_rad * kPerMille.scale)));
  json["clamp_angle_rad"] = if_told(solved.clamp_angle, Number(clamping.angle_rad));
  json["clamp_eccentricity_mm"] =
      if_told(solved.clamp_eccentricity, List(clamping.eccentricity_mm));
  json["clamp_tilt_rad"] = if_told(solved.clamp_tilt, List(clamping.tilt_rad));
  json["focal_length_mm"] = if_told(solved.focal_length, Number(alignment.focal_length_mm));
  json["camera_offset_mm"] = if_told(solved.camera_offset, List(alignment.camera_offset_mm));
  json["covariance_order"] = alignment.parameters;
  json["covariance"] = if_told(true, Rows(alignment.covariance));
  json["standard_uncertainty"] = if_told(
      true, ByParameter(alignment,
                        Eigen::VectorXd(alignment.covariance.diagonal().cwiseMax(0).cwiseSqrt())));
}

// Writes the inputs as they counted, k = 1, whatever the verdict.
Json Inputs(const Alignment& alignment) {
  Json json = Json::object();
  for (const part_alignment::UncertainInput& input : part_alignment::kUncertainInputs) {
    json[input.name] = Number((alignment.inputs.*input.size).value_or(0));
  }
  json["not_stated"] = alignment.usual_inputs;
  return json;
}

Json Weakest(const Alignment& alignment) {
  const Observability& told = alignment.observability;
  return {{"components", ByParameter(alignment, told.weakest)},
          {"standard_uncertainty_mm", Number(told.weakest_sigma_mm)},
          {"words", told.words},
          {"advice", told.advice}};
}

Json Residuals(const AlignmentOutput& output) {
  Json list = Json::array();
  for (const AlignmentResidual& residual : output.alignment.residuals) {
    list.push_back({{"view", residual.view},
                    {"target", Id(output, residual.target)},
                    {"column_px", Number(residual.column_px)},
                    {"row_px", Number(residual.row_px)},
                    {"sigma_px", Number(residual.sigma_px)},
                    {"weight", Number(residual.weight)}});
  }
  return list;
}

constexpr double kPercent = 100;

std::string Parameters(const AlignmentOutput& output) {
  constexpr std::size_t kPose = 6;
  std::string text = "part\n";
  const auto all = SolvedParameters(output);
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::string name = NameOf(all[i].name);
    const std::string words = WithInterval(all[i].value, all[i].interval95(), all[i].style());
    if (i < kPose) {
      text += fmt::format("  {:<8} {}\n", name, words);
      continue;
    }
    if (name.starts_with("clamp ")) name.erase(0, 6);
    if (name.starts_with("camera offset")) name.replace(0, 13, "camera's place");
    text += fmt::format("{:<10} {} {}\n", i == kPose ? "clamping" : "", name, words);
  }
  return text;
}

// Lists the usual inputs in the stated uncertainty, which nobody stated.
std::string UsualInputs(const Alignment& alignment) {
  std::string text;
  for (const part_alignment::UncertainInput& input : part_alignment::kUncertainInputs) {
    if (std::ranges::find(alignment.usual_inputs, input.name) == alignment.usual_inputs.end()) {
      continue;
    }
    text += fmt::format("{}{} {:.4f} mm", text.empty() ? "" : ", ", input.words,
                        (alignment.inputs.*input.size).value_or(0));
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

// Describes each parameter's scatter beside the covariance's value.
std::string SimulatedText(const AlignmentOutput& output) {
  const part_alignment::MonteCarloUncertainty& simulated = *output.simulated;
  std::string text = fmt::format(
      "simulated  {} measurements, {} more without a solution; {:.1f} % lie in the linear 95 % "
      "region\n           95 % within        simulated     stated\n",
      simulated.trials, simulated.failed, kPercent * simulated.inside95);
  for (const SolvedParameter& stated : SolvedParameters(output)) {
    const auto found = std::ranges::find(simulated.parameters, stated.name);
    if (found == simulated.parameters.end()) continue;
    const auto k = std::distance(simulated.parameters.begin(), found);
    const double scale = kNormal95 * stated.style().scale;
    text += fmt::format(
        "  {:<24} {:>10.4f} {:>10.4f} {}\n", stated.name.substr(0, stated.name.rfind('_')),
        scale * std::sqrt(simulated.covariance(k, k)), scale * stated.sigma, stated.style().unit);
  }
  return text;
}

}  // namespace

std::vector<SolvedParameter> SolvedParameters(const AlignmentOutput& output) {
  const Alignment& alignment = output.alignment;
  const part_alignment::Theta values = part_alignment::ThetaOf(
      {part_alignment::SolvedCamera(output.measurement, alignment), output.solved, {}},
      alignment.machine_from_part, alignment.clamping);
  const std::vector<std::string> names = part_alignment::ParameterNames(output.solved);
  std::vector<SolvedParameter> all;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const bool known = i < alignment.covariance.rows();
    all.push_back({names[static_cast<std::size_t>(i)], values[i],
                   known ? std::sqrt(std::max(0.0, alignment.covariance(i, i))) : NAN});
  }
  return all;
}

std::string NameOf(std::string parameter) {
  parameter.resize(parameter.rfind('_'));
  std::replace(parameter.begin(), parameter.end(), '_', ' ');
  return parameter;
}

Json JsonOf(const AlignmentOutput& output) {
  const Alignment& alignment = output.alignment;
  Json json = {{"format", kFormat},
               {"verdict", ToString(alignment.verdict)},
               {"reason", alignment.reason},
               {"unknowns", output.unknowns}};
  AddValues(output, json);
  json["input_uncertainty"] = Inputs(alignment);
  json["simulated"] = Simulated(output);
  json["rank"] = alignment.observability.rank;
  json["rank_wanted"] = alignment.observability.unknowns;
  json["weakest_direction"] = Weakest(alignment);
  json["check"] = CheckJson(alignment.check);
  json["residual_rms_sigma"] = Number(alignment.residual_rms_sigma);
  json["residuals"] = Residuals(output);
  json["iterations"] = alignment.iterations;
  json["notices"] = alignment.notices;
  json["targets"] = Json::array();
  for (const part_alignment::PartTarget& target : output.measurement.targets) {
    json["targets"].push_back({{"id", Id(output, target.id)}, {"ideal_mm", List(target.ideal_mm)}});
  }
  return json;
}

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
  std::string text = fmt::format("verdict    {}\n", VerdictText(alignment.verdict));
  if (!alignment.reason.empty()) text += fmt::format("reason     {}\n", alignment.reason);
  if (alignment.verdict == Verdict::kGood) {
    text += Parameters(output) + UsualInputs(alignment);
  }
  if (alignment.check.observations > 0) {
    text += fmt::format("check      {}\n", CheckText(alignment.check));
  }
  if (output.simulated) text += SimulatedText(output);
  text += ObservabilityText(alignment.observability, alignment.reason);
  text += Residuals(alignment);
  for (const std::string& notice : alignment.notices) {
    text += fmt::format("notice     {}\n", notice);
  }
  return text;
}

}  // namespace trammel::report
