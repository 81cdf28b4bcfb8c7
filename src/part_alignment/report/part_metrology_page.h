// The pages of a camera's calibration and of a part fit.
#pragma once

#include <fmt/format.h>

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "document/figure.h"
#include "part_alignment/camera/calibrate.h"
#include "part_alignment/part_fit/part_fit.h"
#include "part_alignment/report/answer_page.h"

namespace trammel::report {

// Pages of AnswerPageHtml.

/// Names what to do next with a calibrated camera, or without one.
/// @param again  what to do where it is not good, as an order: "measure another grid"
[[nodiscard]] std::string CameraWords(bool good, double nearest_mm, double farthest_mm,
                                      std::string_view again);

/// Begins the page of a camera's calibration, by a measuring machine or by the machine itself.
template <class Calibration>
AnswerPage PageOfCalibration(std::string title, const Calibration& calibration,
                             std::string_view again) {
  const bool good = calibration.verdict == Verdict::kGood;
  AnswerPage page;
  page.title = std::move(title);
  page.verdict = calibration.verdict;
  page.value = good ? fmt::format("{:.4f} px", calibration.residual_rms_px) : "No calibration";
  if (good) page.detail = "residual, root mean square";
  page.reason = calibration.reason;
  page.next = CameraWords(good, calibration.nearest_mm, calibration.farthest_mm, again);
  page.notices = calibration.notices;
  return page;
}

/// @param date  of the grid, as its file says it.
[[nodiscard]] std::string CalibrationPage(const std::string& date,
                                          const part_alignment::CameraCalibration& calibration,
                                          std::span<const Figure> figures);
[[nodiscard]] std::string PartFitPage(const part_alignment::PartFitInput& input,
                                      const part_alignment::PartFit& fit,
                                      std::span<const Figure> figures);

}  // namespace trammel::report
