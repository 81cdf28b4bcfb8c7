#include "report/tap_report.h"

#include <fmt/format.h>

#include <cmath>

#include "report/html.h"
#include "report/report_style.h"
#include "report/tap_style.h"
#include "report/tap_text.h"
#include "tap/finding.h"

namespace trammel::report {
namespace {

constexpr std::size_t kMostTaps = 40;

std::string Card(std::string_view heading, const std::string& body, std::string_view extra = "") {
  const std::string title = heading.empty() ? "" : fmt::format("<h2>{}</h2>\n", heading);
  return fmt::format("<section class=\"card{}\">\n{}{}</section>\n", extra, title, body);
}

std::string Picture(const Figure& figure) {
  return fmt::format(
      "<figure><div class=\"wide\"><img src=\"data:image/svg+xml;base64,{}\" alt=\"{}\" "
      "width=\"{:.0f}\" height=\"{:.0f}\"/></div><figcaption>{}</figcaption></figure>\n",
      Base64(figure.canvas.ToSvg()), figure.name, figure.canvas.width_px(),
      figure.canvas.height_px(), EscapeHtml(figure.caption));
}

std::string HeadOfOne(const PlottedTap& tap) {
  const tap::TapAnalysis& contact = tap.contact;
  std::string body =
      fmt::format("<p class=\"verdict\">{}</p>\n", contact.verdict == Verdict::kCannotTell
                                                       ? "cannot tell"
                                                       : std::string(ToString(contact.verdict)));
  if (contact.verdict == Verdict::kGood) {
    body += fmt::format(
        "<p class=\"value\">{:.5f} mm <small>± {:.2f} µm</small></p>\n<p>95 % interval {:.5f} … "
        "{:.5f} mm. <span class=\"quiet\">± is the standard uncertainty (k = 1). Quality {:.0f} of "
        "100.</span></p>\n",
        contact.contact_z_mm, contact.standard_uncertainty_mm * kUmPerMm, contact.interval95_mm.lo,
        contact.interval95_mm.hi, contact.quality);
  } else {
    body += fmt::format("<p class=\"reason\">{}</p>\n", EscapeHtml(tap::Explain(contact.reason)));
  }
  for (const tap::Finding& notice : contact.Notices()) {
    body += fmt::format("<p class=\"quiet\">{}</p>\n", EscapeHtml(tap::Explain(notice)));
  }
  return Card("", body, fmt::format(" head {}", ToString(contact.verdict)));
}

std::string HeadOfMany(const TapReportInput& input) {
  const tap::Ensemble& ensemble = input.ensemble;
  std::string body;
  if (std::isfinite(ensemble.standard_deviation_mm)) {
    body = fmt::format(
        "<p class=\"value\">σ {:.2f} µm <small>range {:.2f} µm, mean step {:.2f} µm</small></p>\n",
        ensemble.standard_deviation_mm * kUmPerMm, ensemble.range_mm * kUmPerMm,
        ensemble.mean_step_mm * kUmPerMm);
  }
  body += "<pre>" + EscapeHtml(EnsembleText(ensemble, {})) + "</pre>\n";
  return Card("", body, ensemble.good == ensemble.taps ? " head good" : " head cannot_tell");
}

std::string HeightCell(const tap::TapAnalysis& analysis) {
  if (analysis.verdict != Verdict::kGood)
    return fmt::format("<td>{}</td>", ToString(analysis.verdict));
  return fmt::format("<td>{:.5f} ± {:.2f} µm</td>", analysis.contact_z_mm,
                     analysis.standard_uncertainty_mm * kUmPerMm);
}

std::string Table(std::span<const PlottedTap> taps) {
  std::string body =
      "<div class=\"wide\"><table>\n<tr><th>tap</th><th>contact (mm)</th><th>two-line (mm)</th>"
      "<th>quality</th><th></th></tr>\n";
  for (const PlottedTap& tap : taps) {
    const bool good = tap.contact.verdict == Verdict::kGood;
    body += fmt::format(
        "<tr{}><td class=\"text\">{}</td>{}{}<td>{}</td><td class=\"text\">{}</td></tr>\n",
        good ? "" : " class=\"unused\"", EscapeHtml(tap.recording.name), HeightCell(tap.contact),
        HeightCell(tap.two_line),
        std::isfinite(tap.contact.quality) ? fmt::format("{:.0f}", tap.contact.quality) : "–",
        good ? "" : EscapeHtml(tap::Explain(tap.contact.reason)));
  }
  return Card("Tap by tap", body + "</table></div>\n");
}

}  // namespace

std::string TuningText(const tap::Tuning& tuning) {
  const tap::TapTraits& traits = tuning.traits;
  std::string text = fmt::format(
      "taps              {} good, {:.0f} samples/s\npress             {:.0f} gf over {:.1f} "
      "µm "
      "({:.0f} gf/mm), noise {:.2f} gf\nuncertainty       {:.2f} µm claimed, {:.2f} µm by noise "
      "alone (docs/tap.md)\n",
      traits.taps, traits.sample_rate_hz, traits.press_force_g, traits.press_depth_mm * kUmPerMm,
      traits.stiffness_g_mm, traits.noise_g, traits.claimed_uncertainty_mm * kUmPerMm,
      tuning.predicted_uncertainty_mm * kUmPerMm);
  for (const tap::Advice& advice : tuning.advice) {
    std::string what;
    if (!std::isfinite(advice.advised)) {
      what = "no advice";
    } else if (!std::isfinite(advice.present)) {
      what = fmt::format("{:.3g} {}", advice.advised, advice.unit);
    } else if (advice.change) {
      what =
          fmt::format("{:.3g} {} instead of {:.3g}", advice.advised, advice.unit, advice.present);
    } else {
      what = fmt::format("keep {:.3g} {}", advice.present, advice.unit);
    }
    text += fmt::format("{:<20}{}\n    {}\n", advice.what, what, advice.because);
  }
  return text;
}

std::string NoiseText(const tap::NoiseSpectrum& noise) {
  if (noise.frequency_hz.empty()) return "noise             no stretch is long enough to say\n";
  std::string text =
      fmt::format("noise             {:.2f} gf over {} stretches; {}\n", noise.noise_g,
                  noise.stretches, noise.lines.empty() ? "no lines stand out" : "lines:");
  for (const tap::NoiseLine& line : noise.lines) {
    text += fmt::format("    {:6.1f} Hz  {:5.2f} gf  {}\n", line.frequency_hz, line.amplitude_g,
                        tap::Describe(line));
  }
  return text;
}

std::vector<Figure> TapFigures(const TapReportInput& input, std::size_t most_taps) {
  std::vector<Figure> figures;
  if (auto figure = SeriesFigure(input.taps, input.ensemble)) figures.push_back(std::move(*figure));
  if (auto figure = MeshFigure(input.taps, input.ensemble)) figures.push_back(std::move(*figure));
  for (std::size_t i = 0; i < std::min(input.taps.size(), most_taps); ++i) {
    figures.push_back(TapFigure(input.taps[i]));
    if (auto figure = BeforeAfterFigure(input.taps[i])) figures.push_back(std::move(*figure));
  }
  if (auto figure = NoiseFigure(input.noise)) figures.push_back(std::move(*figure));
  return figures;
}

std::string TapReport(const TapReportInput& input) {
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'\"/>\n<title>Tap</title>\n<style>";
  page += kReportStyle;
  page += "</style>\n</head>\n<body>\n<main>\n<h1>Contact height from a load cell</h1>\n";
  const bool one = input.taps.size() == 1;
  if (one) {
    page += fmt::format("<p class=\"facts\">{}</p>\n", EscapeHtml(input.taps[0].recording.name));
    page += HeadOfOne(input.taps[0]);
  } else {
    page += HeadOfMany(input);
  }
  for (const Figure& figure : TapFigures(input, kMostTaps)) page += Card("", Picture(figure));
  if (input.taps.size() > kMostTaps) {
    page += fmt::format("<p class=\"quiet\">The first {} taps are drawn.</p>\n", kMostTaps);
  }
  if (input.tuning) {
    page += Card("How to tap better", "<pre style=\"white-space:pre-wrap\">" +
                                          EscapeHtml(TuningText(*input.tuning)) + "</pre>\n");
  }
  if (!one) page += Table(input.taps);
  page +=
      "<footer>Made by trammel. This page stands alone: nothing is loaded from "
      "elsewhere.</footer>\n</main>\n</body>\n</html>\n";
  return page;
}

}  // namespace trammel::report
