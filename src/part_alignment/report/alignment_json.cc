#include "part_alignment/report/alignment_json.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "base/measured_json.h"
#include "document/interval_text.h"
#include "document/json_number.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::Alignment;
using part_alignment::AlignmentResidual;
using part_alignment::Observability;

constexpr int kFormat = 1;

template <class Vector>
Json List(const Vector& values) {
  Json list = Json::array();
  for (Eigen::Index i = 0; i < values.size(); ++i) list.push_back(Number(values(i)));
  return list;
}

Json Rows(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) rows.push_back(List(matrix.row(i)));
  return rows;
}

Json Id(const AlignmentOutput& output, const std::string& id) {
  return output.numeric_ids.contains(id) ? Json::parse(id) : Json(id);
}

// One number for each parameter, under its name.
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

// As they counted, k = 1, whatever the verdict.
Json Inputs(const Alignment& alignment) {
  const part_alignment::InputUncertainty& inputs = alignment.inputs;
  return {{"machine_mm", Number(inputs.machine_mm.value_or(0))},
          {"target_mm", Number(inputs.target_mm.value_or(0))},
          {"clamp_angle_rad", Number(inputs.clamp_angle_rad)},
          {"clamp_eccentricity_mm", Number(inputs.clamp_eccentricity_mm.value_or(0))},
          {"clamp_tilt_rad", Number(inputs.clamp_tilt_rad)},
          {"focal_length_mm", Number(inputs.focal_length_mm)},
          {"camera_offset_mm", Number(inputs.camera_offset_mm.value_or(0))},
          {"not_stated", alignment.usual_inputs}};
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

}  // namespace

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

}  // namespace trammel::report
