#include "part_alignment/report/part_metrology_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/json_text.h"
#include "base/measured_json.h"
#include "base/rejection.h"
#include "document/interval_text.h"
#include "document/json_number.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::AxisBudget;
using part_alignment::Budget;
using part_alignment::CameraCalibration;
using part_alignment::kCameraParameters;
using part_alignment::PartFit;
using part_alignment::PartFitInput;

Json List(const Eigen::Vector3d& v) {
  return Json::array({Number(v.x()), Number(v.y()), Number(v.z())});
}

Json Matrix(const Eigen::MatrixXd& m) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index k = 0; k < m.cols(); ++k) row.push_back(Number(m(i, k)));
    rows.push_back(std::move(row));
  }
  return rows;
}

const char* ParameterName(int i) {
  return part_alignment::kCameraParameterNames[static_cast<std::size_t>(i)];
}

std::string Notices(const std::vector<std::string>& notices) {
  std::string text;
  for (const std::string& notice : notices) text += fmt::format("notice    {}\n", notice);
  return text;
}

std::string Verdicts(Verdict verdict, const std::string& reason) {
  return fmt::format("verdict   {}{}{}\n", VerdictWords(verdict), reason.empty() ? "" : ": ",
                     reason);
}

// The point with the least stock allowance, and where it is in the ideal part; empty without
// points.
std::string LeastWords(const PartFitInput& input, const PartFit& fit) {
  if (fit.stock_allowances.empty()) return {};
  const auto least = std::min_element(
      fit.stock_allowances.begin(), fit.stock_allowances.end(),
      [](const auto& a, const auto& b) { return a.stock_allowance_mm < b.stock_allowance_mm; });
  const auto& point = input.points[least->point];
  const Eigen::Vector3d at =
      geometry::RotationFromAngles(fit.ideal_from_measured.angles_rad) * (fit.scale * point.at_mm) +
      fit.ideal_from_measured.translation_mm;
  return fmt::format("{} ({}), {:.3f} mm at x {:.1f}, y {:.1f}, z {:.1f} of the ideal part",
                     point.id, point.surface, least->stock_allowance_mm, at.x(), at.y(), at.z());
}

}  // namespace

std::string ToJson(const CameraCalibration& calibration) {
  const bool good = calibration.verdict == Verdict::kGood;
  const auto values = part_alignment::ParametersOf(calibration.camera);
  Json parameters = Json::object();
  for (int i = 0; i < kCameraParameters; ++i) {
    parameters[ParameterName(i)] = {
        {"value", good ? Number(values[i]) : Json(nullptr)},
        {"standard_uncertainty",
         good ? Number(std::sqrt(calibration.covariance(i, i))) : Json(nullptr)}};
  }
  Json planes = Json::array();
  for (const auto& plane : calibration.cross_validation) {
    planes.push_back({{"distance_mm", plane.distance_mm},
                      {"views", plane.views},
                      {"rms_px", Number(plane.rms_px)},
                      {"rms_sigma", Number(plane.rms_sigma)}});
  }
  Json residuals = Json::array();
  for (const auto& residual : calibration.residuals) {
    residuals.push_back({{"column_px", Number(residual.column_px)},
                         {"row_px", Number(residual.row_px)},
                         {"sigma_px", Number(residual.sigma_px)},
                         {"used", residual.used}});
  }
  return JsonText({{"format", 1},
                   {"verdict", ToString(calibration.verdict)},
                   {"reason", calibration.reason},
                   {"check", CheckJson(calibration.check)},
                   {"parameters", parameters},
                   {"covariance", good ? Matrix(calibration.covariance) : Json(nullptr)},
                   {"residual_rms_px", Number(calibration.residual_rms_px)},
                   {"residual_rms_sigma", Number(calibration.residual_rms_sigma)},
                   {"degrees_of_freedom", calibration.degrees_of_freedom},
                   {"distance_mm", good ? Json::array({Number(calibration.nearest_mm),
                                                       Number(calibration.farthest_mm)})
                                        : Json(nullptr)},
                   {"cross_validation", planes},
                   {"residuals", residuals},
                   {"notices", calibration.notices}});
}

std::string ToJson(const PartFitInput& input, const PartFit& fit) {
  const bool good = fit.verdict == Verdict::kGood;
  Json stock_allowances = Json::array();
  for (const auto& stock_allowance : fit.stock_allowances) {
    const auto& point = input.points[stock_allowance.point];
    stock_allowances.push_back({{"point", point.id},
                                {"surface", point.surface},
                                {"overstock_mm", Number(stock_allowance.stock_allowance_mm)},
                                {"wanted_mm", Number(stock_allowance.wanted_mm)},
                                {"least_mm", Number(stock_allowance.least_mm)},
                                {"binding", stock_allowance.binding}});
  }
  Json targets = Json::array();
  for (const auto& target : fit.targets) {
    targets.push_back({{"id", target.id}, {"ideal_mm", List(target.ideal_mm)}});
  }
  std::set<std::string> bar_ends;
  for (const part_alignment::ScaleBar& bar : input.bars) bar_ends.insert({bar.from, bar.to});
  const geometry::Pose& pose = fit.ideal_from_measured;
  return JsonText(
      {{"format", 1},
       {"verdict", ToString(fit.verdict)},
       {"reason", fit.reason},
       {"check", CheckJson(fit.check)},
       {"unchecked", fit.unchecked},
       {"targets", good ? targets : Json(nullptr)},
       {"targets_covariance_mm2", good ? Matrix(fit.covariance) : Json(nullptr)},
       {"bar_ends", bar_ends},
       {"ideal_from_measured", good ? Json{{"translation_mm", List(pose.translation_mm)},
                                           {"angles_rad", List(pose.angles_rad)}}
                                    : Json(nullptr)},
       {"scale", good ? Number(fit.scale) : Json(nullptr)},
       {"scale_standard_uncertainty", good ? Number(fit.scale_sigma) : Json(nullptr)},
       {"least_overstock_mm", good ? Number(fit.least_mm) : Json(nullptr)},
       {"mean_overstock_mm", good ? Number(fit.mean_mm) : Json(nullptr)},
       {"uneven_mm", good ? Number(fit.uneven_mm) : Json(nullptr)},
       {"facet_error_mm", good ? Number(fit.facet_error_mm) : Json(nullptr)},
       {"overstocks", stock_allowances},
       {"notices", fit.notices}});
}

std::string ToJson(const Budget& budget) {
  Json axes = Json::object();
  for (std::size_t i = 0; i < 3; ++i) {
    const AxisBudget& axis = budget.axes[i];
    axes[std::string(1, "xyz"[i])] = {
        {"u_out_mm", Number(axis.u_out_mm)},
        {"u_ip_mm", Number(axis.u_ip_mm)},
        {"u_it_mm", Number(axis.u_it_mm)},
        {"combined_mm", Number(axis.combined_mm)},
        {"expanded_mm", Number(axis.expanded_mm)},
        {"degrees_of_freedom", Number(axis.degrees_of_freedom)},
        {"coverage_factor95", Number(axis.coverage_factor)},
        {"at_mm", List(axis.at_mm)},
        {"simulated_mm", budget.trials > 0 ? Number(axis.simulated_mm) : Json(nullptr)},
        {"simulated_expanded_mm",
         budget.trials > 0 ? Number(axis.simulated_expanded_mm) : Json(nullptr)}};
  }
  return JsonText({{"format", 1}, {"trials", budget.trials}, {"axes", axes}});
}

std::vector<ParameterWords> CalibratedParameters(
    const part_alignment::Camera& camera, const part_alignment::CameraCovariance& covariance) {
  std::vector<ParameterWords> words;
  const auto values = part_alignment::ParametersOf(camera);
  for (int i = 0; i < kCameraParameters; ++i) {
    const auto [lo, hi] = NormalInterval95(values[i], std::sqrt(covariance(i, i)));
    words.push_back({ParameterName(i), fmt::format("{:.8g}", values[i]),
                     fmt::format("95 %: {:.8g} to {:.8g}", lo, hi)});
  }
  return words;
}

std::string CalibrationText(const CameraCalibration& calibration) {
  std::string text = Verdicts(calibration.verdict, calibration.reason);
  text += fmt::format("check     {}\n", CheckWords(calibration.check));
  if (calibration.verdict == Verdict::kGood) {
    for (const ParameterWords& parameter :
         CalibratedParameters(calibration.camera, calibration.covariance)) {
      text += fmt::format("  {:<20} {:>16} ({})\n", parameter.name, parameter.value,
                          parameter.interval);
    }
    text += fmt::format(
        "residuals {:.4f} px root mean square, {:.2f} of what was stated\n"
        "range     {:.0f} … {:.0f} mm from the camera\n",
        calibration.residual_rms_px, calibration.residual_rms_sigma, calibration.nearest_mm,
        calibration.farthest_mm);
    for (const auto& plane : calibration.cross_validation) {
      text +=
          fmt::format("held out  {:>6.0f} mm: {} views foretold to {:.4f} px, {:.2f} of expected\n",
                      plane.distance_mm, plane.views, plane.rms_px, plane.rms_sigma);
    }
  }
  return text + Notices(calibration.notices);
}

std::string PartFitText(const PartFitInput& input, const PartFit& fit) {
  std::string text = Verdicts(fit.verdict, fit.reason);
  if (fit.check.observations > 0) text += fmt::format("check     {}\n", CheckWords(fit.check));
  for (const std::string& unchecked : fit.unchecked) {
    text += fmt::format("unchecked {}\n", unchecked);
  }
  if (fit.verdict == Verdict::kGood) {
    text += fmt::format(
        "allowance at least {:.3f} mm, mean {:.3f} mm, uneven by {:.3f} mm (root mean square)\n",
        fit.least_mm, fit.mean_mm, fit.uneven_mm);
    text += fmt::format("least at  {}\n", LeastWords(input, fit));
    for (const auto& stock_allowance : fit.stock_allowances) {
      if (!stock_allowance.binding) continue;
      const auto& point = input.points[stock_allowance.point];
      text += fmt::format("rests on  {} ({}): {:.3f} mm\n", point.id, point.surface,
                          stock_allowance.stock_allowance_mm);
    }
    if (fit.scale_sigma > 0) {
      constexpr int kDecimals = 7;
      text += fmt::format("scale     {}\n",
                          WithInterval(fit.scale, NormalInterval95(fit.scale, fit.scale_sigma),
                                       {.least_decimals = kDecimals}));
    }
    for (std::size_t i = 0; i < fit.targets.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(3 * i);
      const Eigen::Vector3d& at = fit.targets[i].ideal_mm;
      const Eigen::Vector3d half =
          kNormal95 * fit.covariance.diagonal().segment<3>(row).cwiseSqrt();
      text +=
          fmt::format("target    {:<8} {:>11.4f} {:>11.4f} {:>11.4f} mm ({})\n", fit.targets[i].id,
                      at.x(), at.y(), at.z(), WithinText({half.data(), 3}, kMillimetres));
    }
  }
  return text + Notices(fit.notices);
}

std::string BudgetText(const Budget& budget) {
  std::string text =
      "Largest over the box, µm       u_out     u_ip     u_it  combined   95 % within   "
      "simulated\n";
  for (std::size_t i = 0; i < 3; ++i) {
    const AxisBudget& axis = budget.axes[i];
    text += fmt::format(
        "  {} at {:>6.0f} {:>6.0f} {:>6.0f}  {:>8.1f} {:>8.1f} {:>8.1f} {:>9.1f} {:>13.1f}   {}\n",
        "XYZ"[i], axis.at_mm.x(), axis.at_mm.y(), axis.at_mm.z(), kUmPerMm * axis.u_out_mm,
        kUmPerMm * axis.u_ip_mm, kUmPerMm * axis.u_it_mm, kUmPerMm * axis.combined_mm,
        kUmPerMm * axis.coverage_factor * axis.combined_mm,
        budget.trials > 0 ? fmt::format("{:.1f}", kUmPerMm * axis.simulated_expanded_mm) : "none");
  }
  text += "u and combined: standard uncertainties; 95 % within: Student's factor times combined\n";
  if (budget.trials > 0) {
    text +=
        fmt::format("simulated: half of the symmetric 95 % interval of {} trials\n", budget.trials);
  }
  return text;
}

}  // namespace trammel::report
