#include "part_alignment/report/board_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/measured_json.h"
#include "document/interval_text.h"
#include "document/json_number.h"
#include "part_alignment/report/answer_page.h"
#include "part_alignment/report/part_metrology_page.h"
#include "part_alignment/report/part_metrology_text.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::BoardCalibration;
using part_alignment::BoardViewResult;
using part_alignment::kCameraParameters;
using part_alignment::NullDirection;

Json NullJson(const BoardCalibration& calibration) {
  Json list = Json::array();
  for (const NullDirection& direction : calibration.null_directions) {
    list.push_back(
        {{"what", direction.what},
         {"taken_from", direction.taken_from},
         {"closed_by", direction.closed_by},
         {"standard_uncertainty", direction.sigma ? Number(*direction.sigma) : Json(nullptr)},
         {"unit", direction.unit}});
  }
  return list;
}

Json ViewsJson(const BoardCalibration& calibration) {
  Json list = Json::array();
  for (const BoardViewResult& view : calibration.views) {
    Json entry = {
        {"picture", view.picture}, {"used", view.used}, {"observations", view.observations}};
    if (view.used) {
      entry["rms_px"] = Number(view.rms_px);
      entry["off_mm"] = {Number(view.off_mm.x()), Number(view.off_mm.y()), Number(view.off_mm.z())};
    } else {
      entry["reason"] = view.reason;
    }
    list.push_back(std::move(entry));
  }
  return list;
}

Json MarksJson(const BoardCalibration& calibration) {
  Json list = Json::array();
  for (const auto& mark : calibration.marks) {
    list.push_back(
        {{"id", mark.id},
         {"machine_mm", {Number(mark.at_mm.x()), Number(mark.at_mm.y()), Number(mark.at_mm.z())}},
         {"observations", mark.observations},
         {"rms_px", Number(mark.rms_px)}});
  }
  return list;
}

Json ParametersJson(const BoardCalibration& calibration, bool good) {
  const auto values = part_alignment::ParametersOf(calibration.camera);
  Json parameters = Json::object();
  for (int i = 0; i < kCameraParameters; ++i) {
    parameters[part_alignment::kCameraParameterNames[static_cast<std::size_t>(i)]] = {
        {"value", good ? Number(values[i]) : Json(nullptr)},
        {"standard_uncertainty",
         good ? Number(std::sqrt(calibration.covariance(i, i))) : Json(nullptr)}};
  }
  return parameters;
}

// In the unit that people use for it.
std::string SigmaWords(const NullDirection& direction) {
  if (!direction.sigma) return {};
  if (direction.unit == "mm") {
    return fmt::format("within {:.3g} um", kUmPerMm * kNormal95 * *direction.sigma);
  }
  if (direction.unit == "rad") {
    return fmt::format("within {:.3g} mm/m", 1e3 * kNormal95 * *direction.sigma);
  }
  return fmt::format("within {:.3g} ppm", 1e6 * kNormal95 * *direction.sigma);
}

std::string TakenWords(const NullDirection& direction) {
  return direction.taken_from.empty() ? "nothing: there is no answer" : direction.taken_from;
}

std::string PrintWords(const BoardCalibration& calibration) {
  const auto& print = *calibration.print;
  return fmt::format(
      "{:.3f} % to the right and {:.3f} % upwards of what it was meant to be, bent "
      "by {:.2f} mm ({} marks)",
      100 * print.scale_right, 100 * print.scale_up, print.bend_mm, print.marks);
}

}  // namespace

std::string ToJson(const BoardCalibration& calibration) {
  const bool good = calibration.verdict == Verdict::kGood;
  Json covariance = nullptr;
  if (good) {
    covariance = Json::array();
    for (const auto& row : calibration.covariance.rowwise()) {
      Json numbers = Json::array();
      for (const double number : row) numbers.push_back(Number(number));
      covariance.push_back(std::move(numbers));
    }
  }
  Json print = nullptr;
  if (calibration.print) {
    print = {{"scale_right", Number(calibration.print->scale_right)},
             {"scale_up", Number(calibration.print->scale_up)},
             {"bend_mm", Number(calibration.print->bend_mm)},
             {"marks", calibration.print->marks}};
  }
  const auto pair = [&](const Eigen::Vector2d& v) {
    return good ? Json::array({Number(v.x()), Number(v.y())}) : Json(nullptr);
  };
  return JsonText({{"format", 1},
                   {"verdict", ToString(calibration.verdict)},
                   {"reason", calibration.reason},
                   {"parameters", ParametersJson(calibration, good)},
                   {"covariance", covariance},
                   {"residual_rms_px", Number(calibration.residual_rms_px)},
                   {"residual_rms_sigma", Number(calibration.residual_rms_sigma)},
                   {"repeatability_mm", Number(calibration.repeatability_mm)},
                   {"degrees_of_freedom", calibration.degrees_of_freedom},
                   {"check", CheckJson(calibration.check)},
                   {"unchecked", calibration.unchecked},
                   {"distance_mm", good ? Json::array({Number(calibration.nearest_mm),
                                                       Number(calibration.farthest_mm)})
                                        : Json(nullptr)},
                   {"lean_rad", pair(calibration.lean_rad)},
                   {"lean_standard_uncertainty_rad", pair(calibration.lean_sigma_rad)},
                   {"not_seen", NullJson(calibration)},
                   {"sheet", print},
                   {"marks", MarksJson(calibration)},
                   {"views", ViewsJson(calibration)},
                   {"notices", calibration.notices}});
}

std::string BoardCalibrationText(const BoardCalibration& calibration) {
  std::string text = fmt::format("verdict   {}{}{}\n", VerdictWords(calibration.verdict),
                                 calibration.reason.empty() ? "" : ": ", calibration.reason);
  if (calibration.check.observations > 0) {
    text += fmt::format("check     {}\n", CheckWords(calibration.check));
  }
  if (!calibration.unchecked.empty()) {
    text += fmt::format("unchecked {}\n", calibration.unchecked);
  }
  if (calibration.verdict == Verdict::kGood) {
    for (const auto& [name, value, interval] :
         CalibratedParameters(calibration.camera, calibration.covariance)) {
      text += fmt::format("  {:<20} {:>16} ({})\n", name, value, interval);
    }
    text += fmt::format(
        "residuals {:.4f} px root mean square, {:.2f} of what was stated; places {:.1f} um\n"
        "range     {:.0f} … {:.0f} mm from the camera\n",
        calibration.residual_rms_px, calibration.residual_rms_sigma,
        kUmPerMm * calibration.repeatability_mm, calibration.nearest_mm, calibration.farthest_mm);
  }
  if (calibration.print) text += fmt::format("sheet     {}\n", PrintWords(calibration));
  for (const NullDirection& direction : calibration.null_directions) {
    const std::string sigma = SigmaWords(direction);
    text +=
        fmt::format("not seen  {}: taken from {}{}{}; closed by {}\n", direction.what,
                    TakenWords(direction), sigma.empty() ? "" : ", ", sigma, direction.closed_by);
  }
  for (const std::string& notice : calibration.notices) {
    text += fmt::format("notice    {}\n", notice);
  }
  return text;
}

std::string BoardCalibrationPage(const std::string& date, const BoardCalibration& calibration) {
  AnswerPage page = PageOfCalibration("Camera calibration on the machine, " + date, calibration,
                                      "take the pictures anew");
  if (!calibration.unchecked.empty()) page.unchecked = {calibration.unchecked};
  page.text = BoardCalibrationText(calibration);
  return AnswerPageHtml(page, {});
}

}  // namespace trammel::report
