#include "tap/report/comparison_report.h"

#include <fmt/format.h>

#include "document/html.h"
#include "document/interval_text.h"
#include "document/page.h"
#include "tap/report/comparison_text.h"

namespace trammel::report {
namespace {

const IntervalStyle kMicrometres{.unit = "µm", .scale = kUmPerMm, .least_decimals = 2};
const IntervalStyle kOffsetMicrometres{
    .unit = "µm", .scale = kUmPerMm, .least_decimals = 2, .signs = true};
const IntervalStyle kRatio{.least_decimals = 2};

std::string Cell(const Measured& measured, const IntervalStyle& style) {
  if (!measured.good()) return "–";
  const Quantity& quantity = measured.quantity();
  return ValueCell(ValueText(quantity.value, quantity.interval95, style),
                   IntervalText(quantity.interval95, style));
}

std::string Head(const tap::MethodComparison& comparison) {
  if (!comparison.ratio.good()) {
    return HeadCard(comparison.ratio.verdict(), "<p class=\"value\">No comparison</p>\n" +
                                                    fmt::format("<p class=\"reason\">{}</p>\n",
                                                                EscapeHtml(comparison.because)));
  }
  const Quantity& ratio = comparison.ratio.quantity();
  const std::string answer =
      AnswerLine(
          "Scatter of contact / two-line " + ValueText(ratio.value, ratio.interval95, kRatio),
          IntervalText(ratio.interval95, kRatio)) +
      fmt::format("<p class=\"quiet\">{}.</p>\n", EscapeHtml(comparison.because));
  const bool told = comparison.better != tap::Repeats::kCannotTell;
  return HeadCard(told ? Verdict::kGood : Verdict::kCannotTell, answer);
}

std::string Scatters(const tap::MethodComparison& comparison) {
  Table table({{"", true}, {"contact"}, {"two-line"}, {"contact / two-line"}});
  table.Row({"scatter about the mean", Cell(comparison.contact.deviation_mm, kMicrometres),
             Cell(comparison.two_line.deviation_mm, kMicrometres), Cell(comparison.ratio, kRatio)});
  table.Row({"scatter back-to-back", Cell(comparison.contact.back_to_back_mm, kMicrometres),
             Cell(comparison.two_line.back_to_back_mm, kMicrometres),
             Cell(comparison.back_to_back_ratio, kRatio)});
  table.Row({"taps read", fmt::format("{} of {}", comparison.contact.good, comparison.taps),
             fmt::format("{} of {}", comparison.two_line.good, comparison.taps), ""});
  if (comparison.difference_mm.good()) {
    table.Row({"contact less two-line, mean", Cell(comparison.difference_mm, kOffsetMicrometres),
               "", ""});
  }
  return Card(fmt::format("{} taps that both read, at {} place{}", comparison.used,
                          comparison.places, comparison.places == 1 ? "" : "s"),
              table.Html());
}

}  // namespace

std::string ComparisonReport(const tap::MethodComparison& comparison,
                             const std::vector<std::string>& files) {
  std::string page = PageBegin("Tap methods", "Two methods on the same taps");
  std::string named;
  for (const std::string& file : files) named += (named.empty() ? "" : ", ") + file;
  page += fmt::format("<p class=\"facts\">{}</p>\n", EscapeHtml(named));
  page += Head(comparison);
  page += Scatters(comparison);
  page += ListCard("Worth knowing", ComparisonNotices(comparison));
  if (const auto figure = ComparisonFigure(comparison)) page += Card("", FigureHtml(*figure));
  return page + PageEnd();
}

}  // namespace trammel::report
