#include "pressure_advance/report/pressure_advance_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "base/check.h"
#include "document/html.h"
#include "document/interval_text.h"
#include "document/page.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kMsPerS = 1000;

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
  if (answer.good()) {
    const Quantity& quantity = answer.quantity();
    return HeadCard(
        Verdict::kGood,
        AnswerLine(ValueText(quantity.value, quantity.interval95, kSeconds),
                   IntervalText(quantity.interval95, kSeconds)) +
            fmt::format("<p class=\"quiet\">The true value lies in this interval 95 times in 100. "
                        "Method: {}.</p>\n",
                        analysis.method == pa::Method::kResponse ? "response of all lines"
                                                                 : "deviation (Abbott's paper)"));
  }
  std::string body = "<p class=\"value\">No value</p>\n";
  body += fmt::format("<p class=\"reason\">{}</p>\n", EscapeHtml(answer.reason()));
  body += answer.verdict() == Verdict::kCannotTell
              ? "<p class=\"quiet\">The recording is sound, but it does not determine the pressure "
                "advance. A guess would be worse than the value in use.</p>\n"
              : "<p class=\"quiet\">What was recorded is not fit to be measured.</p>\n";
  return HeadCard(answer.verdict(), body);
}

// What sets the value in another firmware than Klipper, which printed the lines.
std::string NextIn(const gcode::PrintedBy& printed_by, const std::string& value_s) {
  const bool marlin = printed_by.dialect == gcode::Dialect::kMarlin;
  const auto lines = PressureAdvanceCommands(printed_by.dialect, value_s, {{}, printed_by.drive});
  return Card("What to do next",
              fmt::format("<p>Try it at once ({}):</p>\n<pre>{}</pre>\n"
                          "<p>Keep it: {}.</p>\n"
                          "<p class=\"quiet\">It holds for this filament, nozzle and temperature. "
                          "A slicer that sets pressure advance itself overwrites it: set the same "
                          "value there.</p>\n",
                          marlin ? "Marlin" : "RepRapFirmware", EscapeHtml(lines.front()),
                          marlin ? "<code>M500</code>, where the printer has an EEPROM, or the "
                                   "same line in the slicer's start G-code"
                                 : "the same line in <code>config.g</code>"));
}

std::string Next(const pa::Analysis& analysis, bool has_figures) {
  const Measured& answer = analysis.pressure_advance;
  if (!answer.good()) {
    return Card(
        "What to do next",
        fmt::format(
            "<p>Keep the pressure advance that is in use. Put right what the reason above names, "
            "then print or record again{}.</p>\n",
            has_figures ? "; the figures below show what was seen" : ""));
  }
  const std::string value =
      SecondsText(answer.quantity().value, answer.quantity().standard_uncertainty);
  if (analysis.printed_by && analysis.printed_by->dialect != gcode::Dialect::kKlipper) {
    return NextIn(*analysis.printed_by, value);
  }
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

void AddPart(Table& table, const std::string& name, const Measured& part, bool answer_good) {
  // A part that is sound is still no answer where the whole is not.
  if (part.good() && answer_good) {
    const Quantity& quantity = part.quantity();
    table.Row({name, ValueText(quantity.value, quantity.interval95, kSeconds),
               IntervalText(quantity.interval95, kSeconds), ""});
  } else if (part.good()) {
    table.Row({name, "not shown", "", "readable alone, but the whole is not to be trusted"});
  } else {
    table.Row({name, VerdictWords(part.verdict()), "", EscapeHtml(part.reason())});
  }
}

double Width(const Quantity& quantity) { return quantity.interval95.hi - quantity.interval95.lo; }

/// Why the two changes of speed together may be known better, or worse, than each.
std::string WhyTogether(const pa::Analysis& analysis, const Quantity& both) {
  const Measured& a = analysis.response.acceleration.pressure_advance;
  const Measured& d = analysis.response.deceleration.pressure_advance;
  if (!a.good() || !d.good() || analysis.method != pa::Method::kResponse) return "";
  if (Width(both) < std::min(Width(a.quantity()), Width(d.quantity()))) {
    return "<p class=\"quiet\">The changes of speed together are known better than each alone: "
           "filament that slips at speed moves the two values in opposite directions, so that it "
           "nearly cancels in their combination.</p>\n";
  }
  return "<p class=\"quiet\">The changes of speed together are known no better than the better one "
         "alone: the two come from the same lines, and where they disagree the interval holds "
         "both readings.</p>\n";
}

void AddTold(Table& table, const std::string& name, const Quantity& quantity,
             const IntervalStyle& style, const std::string& words) {
  table.Row({name, ValueText(quantity.value, quantity.interval95, style),
             IntervalText(quantity.interval95, style), words});
}

/// The law that the answer was weighed with; none where it was not.
const pa::LearntLaw* LawOf(const pa::Analysis& analysis) {
  const pa::ResponseResult& response = analysis.response;
  const bool counts = analysis.pressure_advance.good() && response.pressure_advance.good() &&
                      response.law && analysis.method == pa::Method::kResponse;
  return counts ? &*response.law : nullptr;
}

std::string Parts(const pa::Analysis& analysis) {
  const bool good = analysis.pressure_advance.good();
  const pa::LearntLaw* const law = LawOf(analysis);
  Table table({{""}, {"pressure advance"}, {"interval"}, {"", true}});
  if (law != nullptr) {
    const char* const of = analysis.repeats ? " in the fit of all patterns' lines" : "";
    const auto counts = [of](double share) {
      return fmt::format("counts {:.0f} %{}", 100 * share, of);
    };
    AddTold(table, "shape of the lines", law->pressure_advance_s, kSeconds, counts(law->weight));
    AddTold(table, "changes of speed", law->crossings_s, kSeconds, counts(1 - law->weight));
  }
  const std::string part = law != nullptr ? "… " : "";
  AddPart(table, part + "speeding up", analysis.response.acceleration.pressure_advance, good);
  AddPart(table, part + "slowing down", analysis.response.deceleration.pressure_advance, good);
  std::string body = table.Html();
  if (good) {
    body += WhyTogether(analysis,
                        law != nullptr ? law->crossings_s : analysis.pressure_advance.quantity());
  }
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
  return Card(law != nullptr ? "What the answer is made of" : "Each speed change alone", body);
}

/// What whole lines told of the extruder.
std::string LawCard(const pa::Analysis& analysis) {
  const pa::LearntLaw* const learnt = LawOf(analysis);
  if (learnt == nullptr) return "";
  const pa::LearntLaw& law = *learnt;
  Table told({{""}, {"value"}, {"interval"}, {"", true}});
  const auto& segments = analysis.motion.segments;
  if (segments.size() == 3) {
    AddTold(told, fmt::format("lag at {:.4g} mm/s", segments[0].speed_mm_s), law.slow_lag_s,
            kMilliseconds, "of a small change of speed");
    AddTold(told, fmt::format("lag at {:.4g} mm/s", segments[1].speed_mm_s), law.fast_lag_s,
            kMilliseconds, "of a small change of speed");
    AddTold(told, fmt::format("slip at {:.4g} mm/s", segments[1].speed_mm_s), law.slip, kPercent,
            "of the flow");
  }
  told.Row({"scatter of the lag", fmt::format("{:.1f} ms", law.lag_scatter_s * kMsPerS), "1 σ",
            fmt::format("from line to line, of {} lines", law.lines)});
  return Card(
      "What the shape of the lines tells",
      told.Html() +
          fmt::format("<p class=\"quiet\">An extruder that stores filament by a law was fitted to "
                      "all readings of all lines: its lag, how that changes with the flow, and "
                      "slip. On lines of that law the changes of speed are read {:.1f} ms too {}, "
                      "which was taken off.</p>\n",
                      std::abs(law.correction_s) * kMsPerS, law.correction_s < 0 ? "low" : "high"));
}

std::string Patterns(const pa::Analysis& analysis) {
  if (!analysis.repeats) return "";
  const pa::Repeats& repeats = *analysis.repeats;
  Table table({{""}, {"pressure advance"}, {"interval"}, {"", true}});
  for (std::size_t i = 0; i < repeats.pattern_s.size(); ++i) {
    AddPart(table, fmt::format("pattern {}", i + 1), repeats.pattern_s[i],
            analysis.pressure_advance.good());
  }
  std::string body = table.Html();
  if (repeats.scatter_s > 0) {
    body += fmt::format(
        "<p class=\"quiet\">They scatter by {:.4f} s from pattern to pattern (standard deviation), "
        "{} than their intervals explain. The answer's interval holds what patterns may differ "
        "by.</p>\n",
        repeats.scatter_s, repeats.disagree ? "more" : "no more");
  }
  return Card("Each pattern alone", body);
}

std::string ExcessCell(const pa::TransitionResult& result, std::size_t line) {
  if (line >= result.excess_s.size() || line >= result.sigma_s.size() ||
      !(result.sigma_s[line] > 0) || !std::isfinite(result.excess_s[line]) ||
      !std::isfinite(result.sigma_s[line])) {
    return "–";
  }
  const double value = result.excess_s[line] * kMsPerS;
  const Interval interval = NormalInterval95(value, result.sigma_s[line] * kMsPerS);
  return fmt::format("{:+.1f} ({:+.1f} to {:+.1f})", value, interval.lo, interval.hi);
}

std::string Lines(const pa::Analysis& analysis) {
  if (analysis.lines.empty()) return "";
  const auto& scores = analysis.deviation.score_px;
  const bool scored = std::any_of(scores.begin(), scores.end(),
                                  [](const auto& score) { return score && std::isfinite(*score); });
  std::vector<Table::Column> columns = {
      {"printed with (s)"}, {"speeding up (ms)"}, {"slowing down (ms)"}};
  if (scored) columns.push_back({"deviation (px)"});
  columns.push_back({"", true});
  Table table(columns);
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    const pa::LineResult& line = analysis.lines[i];
    std::vector<std::string> cells = {
        fmt::format("{:.4f}", std::isfinite(line.pressure_advance_s) ? line.pressure_advance_s : 0),
        ExcessCell(analysis.response.acceleration, i),
        ExcessCell(analysis.response.deceleration, i)};
    if (scored) {
      const bool has = i < scores.size() && scores[i] && std::isfinite(*scores[i]);
      cells.push_back(has ? fmt::format("{:.1f}", *scores[i]) : "–");
    }
    cells.push_back(line.used ? EscapeHtml(line.reason) : "not used: " + EscapeHtml(line.reason));
    table.Row(cells, !line.used);
  }
  return Card("Line by line",
              "<p class=\"quiet\">By how much the line's pressure advance was too low (negative: "
              "too high), in ms, with the 95 % interval of the reading.</p>\n" +
                  table.Html());
}

std::string PageOf(const AnalysisRun& input, const std::vector<Figure>& figures,
                   const ReportOptions& options, const PhotoDetail& detail) {
  const pa::Analysis& analysis = input.analysis;
  std::string page = PageBegin("Pressure advance", "Pressure advance");
  page += Facts(options);
  page += Head(analysis);
  page += Next(analysis, !figures.empty());
  page += ListCard("Worth knowing", analysis.notices);
  page += Parts(analysis);
  page += Patterns(analysis);
  for (const Figure& figure : figures) page += Card("", FigureHtml(figure, detail));
  page += LawCard(analysis);
  page += Lines(analysis);
  return page + PageEnd();
}

}  // namespace

std::string SecondsText(double seconds, double standard_uncertainty_s) {
  int decimals = 4;
  if (standard_uncertainty_s > 0 && standard_uncertainty_s < 0.95e-4) {
    decimals = std::min(6, static_cast<int>(std::ceil(-std::log10(standard_uncertainty_s))));
  }
  return fmt::format("{:.{}f}", seconds, decimals);
}

std::string PressureAdvanceReport(const AnalysisRun& input, const std::vector<Figure>& figures,
                                  const ReportOptions& options) {
  return FittingPage(
      [&](std::size_t step) { return PageOf(input, figures, options, kPhotoSteps[step]); });
}

std::string PressureAdvanceReport(const AnalysisRun& input, const ReportOptions& options) {
  return PressureAdvanceReport(input, PressureAdvanceFigures(input), options);
}

}  // namespace trammel::report
