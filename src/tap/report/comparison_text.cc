#include "tap/report/comparison_text.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "document/interval_text.h"

namespace trammel::report {
namespace {

const IntervalStyle kMicrometres{.unit = "µm", .scale = kUmPerMm, .least_decimals = 2};
const IntervalStyle kOffsetMicrometres{
    .unit = "µm", .scale = kUmPerMm, .least_decimals = 2, .signs = true};
const IntervalStyle kRatio{.least_decimals = 2};

std::string Line(std::string_view name, std::string_view text) {
  return fmt::format("{:<18}{}\n", name, text);
}

std::string ScatterText(std::string_view method, const tap::MethodScatter& scatter) {
  return fmt::format("{}\n", method) +
         Line("  scatter", WithInterval(scatter.deviation_mm.quantity(), kMicrometres)) +
         Line("  back-to-back", WithInterval(scatter.back_to_back_mm.quantity(), kMicrometres)) +
         Line("  claimed", fmt::format("{:.2f} µm standard uncertainty of a tap",
                                       scatter.claimed_mm * kUmPerMm));
}

}  // namespace

std::vector<std::string> ComparisonNotices(const tap::MethodComparison& comparison) {
  std::vector<std::string> notices;
  if (comparison.unplaced > 0) {
    notices.push_back(fmt::format(
        "{} of the taps say no place on the bed: they are taken for repeats of one point; if they "
        "are not, the bed's shape is in the scatter",
        comparison.unplaced));
  }
  return notices;
}

std::string ComparisonText(const tap::MethodComparison& comparison) {
  const bool told = comparison.better != tap::Repeats::kCannotTell;
  std::string text =
      Line("better", fmt::format("{}{}", told ? "" : "cannot tell: ", comparison.because));
  text += Line("taps",
               fmt::format("{} compared, at {} place{}; of {} contact read {}, two-line {}",
                           comparison.used, comparison.places, comparison.places == 1 ? "" : "s",
                           comparison.taps, comparison.contact.good, comparison.two_line.good));
  if (comparison.ratio.good()) {
    text += ScatterText("contact", comparison.contact);
    text += ScatterText("two-line", comparison.two_line);
    text += "contact / two-line\n";
    text += Line("  scatter", WithInterval(comparison.ratio.quantity(), kRatio));
    text += Line("  back-to-back", WithInterval(comparison.back_to_back_ratio.quantity(), kRatio));
    text +=
        Line("difference", WithInterval(comparison.difference_mm.quantity(), kOffsetMicrometres) +
                               ", contact less two-line in the mean");
  }
  for (const std::string& notice : ComparisonNotices(comparison)) text += Line("note", notice);
  return text;
}

}  // namespace trammel::report
