#include "part_alignment/report/part_metrology_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "document/html.h"
#include "document/interval_text.h"
#include "document/page.h"
#include "part_alignment/report/part_metrology_text.h"

namespace trammel::report {
namespace {

using part_alignment::CameraCalibration;
using part_alignment::PartFit;
using part_alignment::PartFitInput;

std::string Quiet(std::string_view text) {
  return fmt::format("<p class=\"quiet\">{}</p>\n", EscapeHtml(text));
}

std::string HeadWithout(Verdict verdict, std::string_view what, std::string_view reason) {
  return HeadCard(verdict, fmt::format("<p class=\"value\">{}</p>\n<p class=\"reason\">{}</p>\n",
                                       EscapeHtml(what), EscapeHtml(reason)));
}

std::string FiguresAndEnd(std::span<const Figure> figures) {
  std::string html;
  for (const Figure& figure : figures) html += Card("", FigureHtml(figure));
  return html + PageEnd();
}

std::string CalibrationHead(const CameraCalibration& calibration) {
  if (calibration.verdict != Verdict::kGood) {
    return HeadWithout(calibration.verdict, "No calibration", calibration.reason);
  }
  const auto used = std::count_if(calibration.residuals.begin(), calibration.residuals.end(),
                                  [](const auto& residual) { return residual.used; });
  Table table({{""}, {"value"}, {"interval"}});
  for (const ParameterWords& parameter :
       CalibratedParameters(calibration.camera, calibration.covariance)) {
    table.Row({parameter.name, parameter.value, parameter.interval});
  }
  return HeadCard(
      Verdict::kGood,
      fmt::format("<p class=\"value\">{:.4f} px <small>residual, root mean square</small></p>\n",
                  calibration.residual_rms_px) +
          Quiet(fmt::format("Of {} views, {} used, {:.0f} … {:.0f} mm from the camera; {:.2f} of "
                            "what was stated for a view.",
                            calibration.residuals.size(), used, calibration.nearest_mm,
                            calibration.farthest_mm, calibration.residual_rms_sigma)) +
          table.Html());
}

std::string HeldOutCard(const CameraCalibration& calibration) {
  if (calibration.cross_validation.empty()) return "";
  Table table({{"distance"}, {"views"}, {"root mean square"}, {"of expected"}});
  for (const auto& plane : calibration.cross_validation) {
    table.Row({fmt::format("{:.0f} mm", plane.distance_mm), fmt::format("{}", plane.views),
               fmt::format("{:.4f} px", plane.rms_px), fmt::format("{:.2f}", plane.rms_sigma)});
  }
  return Card("Each plane, foretold by the others", table.Html());
}

std::string ScaleWords(const PartFit& fit) {
  constexpr int kDecimals = 7;
  return WithInterval(fit.scale, NormalInterval95(fit.scale, fit.scale_sigma),
                      {.least_decimals = kDecimals});
}

std::string FitHead(const PartFitInput& input, const PartFit& fit) {
  if (fit.verdict != Verdict::kGood) {
    return HeadWithout(fit.verdict, "No place for the ideal part", fit.reason);
  }
  std::string body = fmt::format(
      "<p class=\"value\">{:.3f} mm <small>stock allowance at least</small></p>\n", fit.least_mm);
  body += UncheckedHtml(fit.unchecked);
  body += Quiet(fmt::format("Mean {:.3f} mm; uneven by {:.3f} mm (root mean square).", fit.mean_mm,
                            fit.uneven_mm));
  if (const std::string least = LeastWords(input, fit); !least.empty()) {
    body += Quiet("Least at " + least + ".");
  }
  for (const auto& stock_allowance : fit.stock_allowances) {
    if (!stock_allowance.binding) continue;
    const auto& point = input.points[stock_allowance.point];
    body += Quiet(fmt::format("The placement rests on {} ({}): {:.3f} mm.", point.id, point.surface,
                              stock_allowance.stock_allowance_mm));
  }
  if (fit.scale_sigma > 0) body += Quiet("Scale of the points: " + ScaleWords(fit) + ".");
  return HeadCard(Verdict::kGood, body);
}

std::string TargetsCard(const PartFit& fit) {
  if (fit.verdict != Verdict::kGood || fit.targets.empty()) return "";
  Table table({{"target"}, {"x"}, {"y"}, {"z"}});
  for (std::size_t i = 0; i < fit.targets.size(); ++i) {
    std::vector<std::string> cells = {EscapeHtml(fit.targets[i].id)};
    for (int axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<Eigen::Index>(3 * i) + axis;
      const double at_mm = fit.targets[i].ideal_mm[axis];
      const Interval interval = NormalInterval95(at_mm, std::sqrt(fit.covariance(row, row)));
      cells.push_back(ValueCell(ValueText(at_mm, interval, kMillimetres),
                                IntervalText(interval, kMillimetres)));
    }
    table.Row(cells);
  }
  return Card("The targets in the ideal part", table.Html());
}

}  // namespace

std::string CalibratedCameraCard(bool good, double nearest_mm, double farthest_mm,
                                 std::string_view again) {
  return Card("What to do next",
              good ? fmt::format("<p>Name the file of <code>--out</code> as <code>camera</code> of "
                                 "the observations, and look at targets from {:.0f} to {:.0f} mm: "
                                 "outside that range the lens is extrapolated.</p>\n",
                                 nearest_mm, farthest_mm)
                   : fmt::format("<p>Put right what the reason above names and {}. No camera file "
                                 "was written.</p>\n",
                                 again));
}

std::string CalibrationPage(const std::string& date, const CameraCalibration& calibration,
                            std::span<const Figure> figures) {
  const std::string title = "Camera calibration of " + date;
  const bool good = calibration.verdict == Verdict::kGood;
  return PageBegin(title, title) + CalibrationHead(calibration) +
         CalibratedCameraCard(good, calibration.nearest_mm, calibration.farthest_mm,
                              "measure another grid") +
         ListCard("Worth knowing", calibration.notices) + HeldOutCard(calibration) +
         FiguresAndEnd(figures);
}

std::string PartFitPage(const PartFitInput& input, const PartFit& fit,
                        std::span<const Figure> figures) {
  constexpr std::string_view kTitle = "The ideal part in the raw one";
  return PageBegin(kTitle, kTitle) + FitHead(input, fit) +
         Card("What to do next",
              fit.verdict == Verdict::kGood
                  ? "<p>Name the file of <code>--out</code> as <code>targets</code> of the "
                    "observations: the work offset is then the ideal part's.</p>\n"
                  : fmt::format(
                        "<p>Put right what the reason above names and fit again{}. No targets were "
                        "written.</p>\n",
                        figures.empty() ? "" : "; the figure below shows every point")) +
         ListCard("Worth knowing", fit.notices) + TargetsCard(fit) + FiguresAndEnd(figures);
}

}  // namespace trammel::report
