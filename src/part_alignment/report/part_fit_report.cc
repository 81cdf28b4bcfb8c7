#include "part_alignment/report/part_fit_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/json_text.h"
#include "base/measured_json.h"
#include "document/interval_text.h"
#include "document/json_number.h"
#include "part_alignment/report/answer_page.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::AxisBudget;
using part_alignment::Budget;
using part_alignment::PartFit;
using part_alignment::PartFitInput;

// Describes the point with the minimum stock allowance, and its place in the ideal part; empty
// without points.
std::string LeastText(const PartFitInput& input, const PartFit& fit) {
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

std::string ToJson(const PartFitInput& input, const PartFit& fit) {
  const bool good = fit.verdict == Verdict::kGood;
  Json stock_allowances = Json::array();
  for (const auto& stock_allowance : fit.stock_allowances) {
    const auto& point = input.points[stock_allowance.point];
    stock_allowances.push_back({{"point", point.id},
                                {"surface", point.surface},
                                {"overstock_mm", Number(stock_allowance.stock_allowance_mm)},
                                {"wanted_mm", Number(stock_allowance.wanted_mm)},
                                {"least_mm", Number(stock_allowance.min_mm)},
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
       {"targets_covariance_mm2", good ? Rows(fit.covariance) : Json(nullptr)},
       {"bar_ends", bar_ends},
       {"ideal_from_measured", good ? Json{{"translation_mm", List(pose.translation_mm)},
                                           {"angles_rad", List(pose.angles_rad)}}
                                    : Json(nullptr)},
       {"scale", good ? Number(fit.scale) : Json(nullptr)},
       {"scale_standard_uncertainty", good ? Number(fit.scale_sigma) : Json(nullptr)},
       {"least_overstock_mm", good ? Number(fit.min_mm) : Json(nullptr)},
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

std::string PartFitText(const PartFitInput& input, const PartFit& fit) {
  std::string text = VerdictLine(fit.verdict, fit.reason);
  if (fit.check.observations > 0) text += fmt::format("check     {}\n", CheckText(fit.check));
  text += Lines("unchecked", fit.unchecked);
  if (fit.verdict == Verdict::kGood) {
    text += fmt::format(
        "allowance at least {:.3f} mm, mean {:.3f} mm, uneven by {:.3f} mm (root mean square)\n",
        fit.min_mm, fit.mean_mm, fit.uneven_mm);
    text += fmt::format("least at  {}\n", LeastText(input, fit));
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
                                       {.min_decimals = kDecimals}));
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
  return text + Lines("notice", fit.notices);
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

std::string PartFitPage(const part_alignment::PartFitInput& input,
                        const part_alignment::PartFit& fit, std::span<const Figure> figures) {
  const bool good = fit.verdict == Verdict::kGood;
  AnswerPage page;
  page.title = "The ideal part in the raw one";
  page.verdict = fit.verdict;
  page.value = good ? fmt::format("{:.3f} mm", fit.min_mm) : "No place for the ideal part";
  if (good) page.detail = "stock allowance at least";
  page.reason = fit.reason;
  page.unchecked = fit.unchecked;
  page.next = good
                  ? "Name the file of --out as targets of the observations: the work offset is "
                    "then the ideal part's."
                  : "Put right what the reason above names and fit again. No targets were written.";
  page.notices = fit.notices;
  page.text = PartFitText(input, fit);
  return AnswerPageHtml(page, figures);
}

}  // namespace trammel::report
