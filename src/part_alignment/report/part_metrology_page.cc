#include "part_alignment/report/part_metrology_page.h"

#include <fmt/format.h>

#include "part_alignment/report/part_metrology_text.h"

namespace trammel::report {

std::string CameraWords(bool good, double nearest_mm, double farthest_mm, std::string_view again) {
  if (!good) {
    return fmt::format("Put right what the reason above names and {}. No camera file was written.",
                       again);
  }
  return fmt::format(
      "Name the file of --out as camera of the observations, and look at targets from {:.0f} to "
      "{:.0f} mm: outside that range the lens is extrapolated.",
      nearest_mm, farthest_mm);
}

std::string CalibrationPage(const std::string& date,
                            const part_alignment::CameraCalibration& calibration,
                            std::span<const Figure> figures) {
  AnswerPage page =
      PageOfCalibration("Camera calibration of " + date, calibration, "measure another grid");
  page.text = CalibrationText(calibration);
  return AnswerPageHtml(page, figures);
}

std::string PartFitPage(const part_alignment::PartFitInput& input,
                        const part_alignment::PartFit& fit, std::span<const Figure> figures) {
  const bool good = fit.verdict == Verdict::kGood;
  AnswerPage page;
  page.title = "The ideal part in the raw one";
  page.verdict = fit.verdict;
  page.value = good ? fmt::format("{:.3f} mm", fit.least_mm) : "No place for the ideal part";
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
