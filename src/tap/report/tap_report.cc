#include "tap/report/tap_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/interval_text.h"
#include "document/page.h"
#include "tap/report/advice_report.h"
#include "tap/report/tap_text.h"
#include "tap/samples/finding.h"

namespace trammel::report {
namespace {

/// Maximum number of pictures: more only lengthen the page; the table has all taps.
constexpr std::size_t kMaxTaps = 12;

std::string Quiet(std::string_view text) {
  return fmt::format("<p class=\"quiet\">{}</p>\n", EscapeHtml(text));
}

std::string HeadOfOne(const PlottedTap& tap) {
  const tap::TapAnalysis& contact = tap.contact;
  std::string body;
  if (contact.verdict == Verdict::kGood) {
    body = AnswerLine("Contact at " + ValueText(contact.contact_mm.value,
                                                contact.contact_mm.interval95, kMillimetres),
                      IntervalText(contact.contact_mm.interval95, kMillimetres));
    body += Quiet(fmt::format(
        "The height, in the printer's own z, at which the nozzle lets go of the bed; the true one "
        "lies in the interval 95 times in 100. Quality {:.0f} of 100.",
        contact.quality));
  } else {
    body = "<p class=\"value\">No contact height</p>\n";
    body += fmt::format("<p class=\"reason\">{}</p>\n", EscapeHtml(tap::Explain(contact.reason)));
  }
  for (const tap::Finding& notice : contact.Notices()) body += Quiet(tap::Explain(notice));
  return HeadCard(contact.verdict, body);
}

/// Describes the lowest and the highest place of a mesh.
std::string HeightsOfPlaces(const tap::Ensemble& ensemble) {
  const auto [low, high] = std::minmax_element(
      ensemble.places.begin(), ensemble.places.end(),
      [](const tap::Place& a, const tap::Place& b) { return a.z_mm.value < b.z_mm.value; });
  return AnswerLine(
      fmt::format("Contact from {:.4f} to {:.4f} mm", low->z_mm.value, high->z_mm.value),
      fmt::format("at {} place{}", ensemble.places.size(), ensemble.places.size() == 1 ? "" : "s"));
}

std::string HeadOfMany(const TapReportInput& input) {
  const tap::Ensemble& ensemble = input.ensemble;
  std::string body;
  if (const auto height = HeightAtOnePlace(ensemble)) {
    body = AnswerLine("Contact at " + ValueText(height->value, height->interval95, kMillimetres),
                      IntervalText(height->interval95, kMillimetres));
    body += Quiet(fmt::format("Mean of {} taps at one place.", ensemble.used));
  } else if (!ensemble.places.empty()) {
    body = HeightsOfPlaces(ensemble);
  } else {
    body = "<p class=\"value\">No contact height</p>\n";
  }
  Table table({{""}, {"", true}});
  for (const EnsembleRow& row : EnsembleRows(ensemble)) {
    table.Row({EscapeHtml(row.name), EscapeHtml(row.words)});
  }
  body += table.Html();
  for (const std::size_t outlier : ensemble.outliers) {
    if (outlier >= input.taps.size()) continue;
    body += Quiet(fmt::format("Left out of it, too far from the others: {} at {:.4f} mm.",
                              input.taps[outlier].recording.name,
                              input.taps[outlier].contact.contact_mm.value));
  }
  const bool all = ensemble.good == ensemble.taps;
  return HeadCard(all ? Verdict::kGood : Verdict::kCannotTell, body,
                  fmt::format("{} of {} taps good", ensemble.good, ensemble.taps));
}

std::string HeightCell(const tap::TapAnalysis& analysis) {
  if (analysis.verdict != Verdict::kGood) return VerdictText(analysis.verdict);
  return ValueCell(
      ValueText(analysis.contact_mm.value, analysis.contact_mm.interval95, kMillimetres),
      IntervalText(analysis.contact_mm.interval95, kMillimetres));
}

std::string TableOf(std::span<const PlottedTap> taps) {
  Table table({{"tap", true}, {"contact"}, {"two-line"}, {"quality"}, {"", true}});
  for (const PlottedTap& tap : taps) {
    const bool good = tap.contact.verdict == Verdict::kGood;
    table.Row(
        {EscapeHtml(tap.recording.name), HeightCell(tap.contact), HeightCell(tap.two_line),
         std::isfinite(tap.contact.quality) ? fmt::format("{:.0f}", tap.contact.quality) : "–",
         good ? "" : EscapeHtml(tap::Explain(tap.contact.reason))},
        !good);
  }
  return Card("Tap by tap", table.Html());
}

}  // namespace

std::vector<Figure> TapFigures(const TapReportInput& input, std::size_t max_taps) {
  std::vector<Figure> figures;
  if (auto figure = SeriesFigure(input.taps, input.ensemble)) figures.push_back(std::move(*figure));
  if (auto figure = MeshFigure(input.ensemble)) figures.push_back(std::move(*figure));
  for (std::size_t i = 0; i < std::min(input.taps.size(), max_taps); ++i) {
    figures.push_back(TapFigure(input.taps[i]));
    // The first one's caption explains them all.
    if (i > 0) figures.back().caption = input.taps[i].recording.name + ", drawn as the first tap.";
  }
  if (auto figure = NoiseFigure(input.noise)) figures.push_back(std::move(*figure));
  return figures;
}

std::string TapReport(const TapReportInput& input) {
  std::string page = PageBegin("Tap", "Contact height from a load cell");
  const bool one = input.taps.size() == 1;
  if (one) {
    page += fmt::format("<p class=\"facts\">{}</p>\n", EscapeHtml(input.taps[0].recording.name));
    page += HeadOfOne(input.taps[0]);
  } else {
    page += HeadOfMany(input);
  }
  for (const Figure& figure : TapFigures(input, kMaxTaps)) page += Card("", FigureHtml(figure));
  if (input.taps.size() > kMaxTaps) {
    page += fmt::format("<p class=\"quiet\">The first {} taps are drawn.</p>\n", kMaxTaps);
  }
  page +=
      Card("How to tap better", "<pre style=\"white-space:pre-wrap\">" +
                                    EscapeHtml(AdviceText(input.advice, input.noise)) + "</pre>\n");
  if (!one) page += TableOf(input.taps);
  return page + PageEnd();
}

}  // namespace trammel::report
