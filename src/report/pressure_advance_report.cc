#include "report/pressure_advance_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "base/check.h"
#include "report/html.h"
#include "report/report_style.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kMsPerS = 1000;

std::string Card(std::string_view heading, const std::string& body, std::string_view extra = "") {
  const std::string title = heading.empty() ? "" : fmt::format("<h2>{}</h2>\n", heading);
  return fmt::format("<section class=\"card{}\">\n{}{}</section>\n", extra, title, body);
}

std::string VerdictText(Verdict verdict) {
  switch (verdict) {
    case Verdict::kGood:
      return "good";
    case Verdict::kCannotTell:
      return "cannot tell";
    case Verdict::kRefused:
      return "refused";
  }
  return "refused";
}

std::string PlusMinus(const Quantity& quantity) {
  const double u = quantity.standard_uncertainty;
  return SecondsText(quantity.value, u) + " ± " + SecondsText(u, u) + " s";
}

std::string IntervalText(const Quantity& quantity) {
  const double u = quantity.standard_uncertainty;
  return SecondsText(quantity.interval95.lo, u) + " … " + SecondsText(quantity.interval95.hi, u) +
         " s";
}

std::string Facts(const ReportOptions& options) {
  std::string out = "<p class=\"facts\">";
  out += EscapeHtml(options.source);
  for (const auto& [name, value] : options.facts) {
    out += fmt::format(" · {}: {}", EscapeHtml(name), EscapeHtml(value));
  }
  return out + "</p>\n";
}

std::string Head(const pa::Analysis& analysis) {
  const Measured& answer = analysis.pressure_advance;
  std::string body = fmt::format("<p class=\"verdict\">{}</p>\n", VerdictText(answer.verdict()));
  if (answer.good()) {
    const Quantity& quantity = answer.quantity();
    const double u = quantity.standard_uncertainty;
    body += fmt::format("<p class=\"value\">{} s <small>± {} s</small></p>\n",
                        SecondsText(quantity.value, u), SecondsText(u, u));
    body += fmt::format(
        "<p>95 % interval {}. <span class=\"quiet\">± is the standard uncertainty (k = 1); "
        "method: {}.</span></p>\n",
        IntervalText(quantity),
        analysis.method == pa::Method::kResponse ? "response of all lines"
                                                 : "deviation (Abbott's paper)");
    return Card("", body, " head good");
  }
  body += "<p class=\"value\">No value</p>\n";
  body += fmt::format("<p class=\"reason\">{}</p>\n", EscapeHtml(answer.reason()));
  body += answer.verdict() == Verdict::kCannotTell
              ? "<p class=\"quiet\">The recording is sound, but it does not determine the pressure "
                "advance. A guess would be worse than the value in use.</p>\n"
              : "<p class=\"quiet\">What was recorded is not fit to be measured.</p>\n";
  return Card("", body, " head " + std::string(ToString(answer.verdict())));
}

std::string Next(const Measured& answer, bool has_figures) {
  if (!answer.good()) {
    return Card("What to do next",
                fmt::format("<p>Keep the pressure advance that is in use. Follow the advice above, "
                            "then print or record again{}.</p>\n",
                            has_figures ? "; the figures below show what was seen" : ""));
  }
  const std::string value =
      SecondsText(answer.quantity().value, answer.quantity().standard_uncertainty);
  return Card(
      "What to do next",
      fmt::format(
          "<p>Try it at once (Klipper):</p>\n<pre>SET_PRESSURE_ADVANCE ADVANCE={0}</pre>\n"
          "<p>Keep it, in <code>printer.cfg</code>:</p>\n"
          "<pre>[extruder]\npressure_advance: {0}</pre>\n"
          "<p class=\"quiet\">Marlin: <code>M900 K{0}</code> · RepRapFirmware: <code>M572 D0 "
          "S{0}</code>. It holds for this filament, nozzle and temperature. A slicer that sets "
          "pressure advance itself overwrites it: set the same value there.</p>\n",
          value));
}

std::string Notices(const std::vector<std::string>& notices) {
  if (notices.empty()) {
    return "";
  }
  std::string body = "<ul>\n";
  for (const std::string& notice : notices) {
    body += "<li>" + EscapeHtml(notice) + "</li>\n";
  }
  return Card("Worth knowing", body + "</ul>\n");
}

std::string MeasuredRow(std::string_view name, const Measured& measured, bool answer_good) {
  if (measured.good() && answer_good) {
    return fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>good</td><td class=\"text\"></td></tr>\n", name,
        PlusMinus(measured.quantity()), IntervalText(measured.quantity()));
  }
  // A part that is sound is still no answer where the whole is not.
  return fmt::format(
      "<tr><td>{}</td><td>–</td><td>–</td><td>{}</td><td class=\"text\">{}</td></tr>\n", name,
      measured.good() ? "not shown" : VerdictText(measured.verdict()),
      measured.good() ? "readable alone, but the whole is not to be trusted"
                      : EscapeHtml(measured.reason()));
}

std::string Parts(const pa::Analysis& analysis) {
  const bool good = analysis.pressure_advance.good();
  std::string body =
      "<div class=\"wide\"><table>\n<tr><th></th><th>pressure advance</th><th>95 % interval</th>"
      "<th>verdict</th><th></th></tr>\n";
  body += MeasuredRow("speeding up", analysis.response.acceleration.pressure_advance, good);
  body += MeasuredRow("slowing down", analysis.response.deceleration.pressure_advance, good);
  body += "</table></div>\n";
  const pa::DeviationResult& deviation = analysis.deviation;
  if (good && deviation.best_s && std::isfinite(*deviation.best_s)) {
    body += fmt::format(
        "<p class=\"quiet\">For comparison, the score of Abbott's paper is lowest "
        "at {:.4f} s",
        *deviation.best_s);
    if (deviation.cubic_minimum_s && std::isfinite(*deviation.cubic_minimum_s)) {
      body += fmt::format("; its cubic has its minimum at {:.4f} s", *deviation.cubic_minimum_s);
    }
    if (deviation.r_squared && std::isfinite(*deviation.r_squared)) {
      body += fmt::format(" (R² = {:.2f})", *deviation.r_squared);
    }
    body += ".</p>\n";
  }
  return Card("Each speed change alone", body);
}

std::string ExcessCell(const pa::TransitionResult& result, std::size_t line) {
  if (line >= result.excess_s.size() || line >= result.sigma_s.size() ||
      !(result.sigma_s[line] > 0) || !std::isfinite(result.excess_s[line]) ||
      !std::isfinite(result.sigma_s[line])) {
    return "<td>–</td>";
  }
  return fmt::format("<td>{:+.1f} ± {:.1f}</td>", result.excess_s[line] * kMsPerS,
                     result.sigma_s[line] * kMsPerS);
}

std::string Lines(const pa::Analysis& analysis) {
  if (analysis.lines.empty()) {
    return "";
  }
  std::string body =
      "<div class=\"wide\"><table>\n<tr><th>printed with (s)</th><th>speeding up (ms)</th>"
      "<th>slowing down (ms)</th><th>deviation (px)</th><th>used</th><th></th></tr>\n";
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    const pa::LineResult& line = analysis.lines[i];
    const auto& scores = analysis.deviation.score_px;
    const bool scored = i < scores.size() && scores[i] && std::isfinite(*scores[i]);
    body += fmt::format(
        "<tr{}><td>{:.4f}</td>{}{}<td>{}</td><td>{}</td><td class=\"text\">{}</td></tr>\n",
        line.used ? "" : " class=\"unused\"",
        std::isfinite(line.pressure_advance_s) ? line.pressure_advance_s : 0.0,
        ExcessCell(analysis.response.acceleration, i),
        ExcessCell(analysis.response.deceleration, i),
        scored ? fmt::format("{:.1f}", *scores[i]) : "–", line.used ? "yes" : "no",
        EscapeHtml(line.reason));
  }
  body +=
      "</table></div>\n<p class=\"quiet\">Speeding up, slowing down: surplus filament ± 1 σ, "
      "as the time by which the line's pressure advance was too low (negative: too "
      "high).</p>\n";
  return Card("Line by line", body);
}

std::string Picture(const Figure& figure) {
  const std::string data =
      figure.picture ? "data:image/png;base64," + Base64(figure.canvas.ToPng(figure.png_scale))
                     : "data:image/svg+xml;base64," + Base64(figure.canvas.ToSvg());
  std::string alt = figure.name;
  std::replace(alt.begin(), alt.end(), '_', ' ');
  return fmt::format(
      "<figure><div class=\"wide\"><img src=\"{}\" alt=\"{}\" width=\"{:.0f}\" height=\"{:.0f}\"/>"
      "</div><figcaption>{}</figcaption></figure>\n",
      data, EscapeHtml(alt), figure.canvas.width_px(), figure.canvas.height_px(),
      EscapeHtml(figure.caption));
}

}  // namespace

std::string SecondsText(double seconds, double standard_uncertainty_s) {
  int decimals = 4;
  if (standard_uncertainty_s > 0 && standard_uncertainty_s < 0.95e-4) {
    decimals = std::min(6, static_cast<int>(std::ceil(-std::log10(standard_uncertainty_s))));
  }
  return fmt::format("{:.{}f}", seconds, decimals);
}

std::string PressureAdvanceReport(const ReportInput& input, const std::vector<Figure>& figures,
                                  const ReportOptions& options) {
  TRAMMEL_CHECK(input.analysis != nullptr, "no analysis");
  const pa::Analysis& analysis = *input.analysis;
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'\"/>\n<title>Pressure advance</title>\n<style>";
  page += kReportStyle;
  page += "</style>\n</head>\n<body>\n<main>\n<h1>Pressure advance</h1>\n";
  page += Facts(options);
  page += Head(analysis);
  page += Next(analysis.pressure_advance, !figures.empty());
  page += Notices(analysis.notices);
  page += Parts(analysis);
  for (const Figure& figure : figures) {
    page += Card("", Picture(figure));
  }
  page += Lines(analysis);
  page +=
      "<footer>Made by trammel. This page stands alone: nothing is loaded from "
      "elsewhere.</footer>\n</main>\n</body>\n</html>\n";
  return page;
}

std::string PressureAdvanceReport(const ReportInput& input, const ReportOptions& options) {
  return PressureAdvanceReport(input, PressureAdvanceFigures(input), options);
}

}  // namespace trammel::report
