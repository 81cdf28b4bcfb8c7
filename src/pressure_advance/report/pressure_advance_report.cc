#include "pressure_advance/report/pressure_advance_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "document/interval_text.h"
#include "document/page.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kMsPerS = 1000;

AnswerRow RowOf(std::string name, const Quantity& quantity, const IntervalStyle& style,
                std::string note) {
  return {std::move(name), ValueText(quantity.value, quantity.interval95, style),
          IntervalText(quantity.interval95, style), std::move(note)};
}

AnswerRow PartRow(std::string name, const Measured& part, bool answer_good) {
  if (!part.good()) return {std::move(name), VerdictText(part.verdict()), "", part.reason()};
  // A sound part is no answer if the whole is not.
  if (!answer_good) {
    return {std::move(name), "not shown", "", "readable alone, but the whole is not to be trusted"};
  }
  return RowOf(std::move(name), part.quantity(), kSeconds, "");
}

/// Returns the storage model weighted into the answer; null if there is none.
const pa::WeighedStorage* LawOf(const pa::Analysis& analysis) {
  const pa::ResponseResult& response = analysis.response;
  const bool counts =
      analysis.pressure_advance.good() && response.pressure_advance.good() && response.law;
  return counts ? &*response.law : nullptr;
}

void AddStorage(const pa::WeighedStorage& law, const pa::LineMotion& motion,
                std::vector<AnswerRow>& rows) {
  const auto& segments = motion.segments;
  if (segments.size() == 3) {
    const auto at = [](const char* what, const pa::Segment& segment) {
      return fmt::format("{} at {:.4g} mm/s", what, segment.speed_mm_s);
    };
    rows.push_back(RowOf(at("lag", segments[0]), law.slow_lag_s, kMilliseconds, ""));
    rows.push_back(RowOf(at("lag", segments[1]), law.fast_lag_s, kMilliseconds, ""));
    rows.push_back(RowOf(at("slip", segments[1]), law.slip, kPercent, "of the flow"));
  }
  rows.push_back({"scatter of the lag", fmt::format("{:.1f} ms", law.lag_scatter_s * kMsPerS), "",
                  fmt::format("1 σ, from line to line, of {} lines", law.lines)});
}

void AddScore(const pa::DeviationResult& deviation, std::vector<AnswerRow>& rows) {
  const auto finite = [](const std::optional<double>& value) {
    return value && std::isfinite(*value);
  };
  if (!finite(deviation.best_s)) return;
  std::string note = "lowest score of Abbott's paper";
  if (finite(deviation.cubic_minimum_s)) {
    note += fmt::format(", minimum of its cubic at {:.4f} s", *deviation.cubic_minimum_s);
  }
  if (finite(deviation.r_squared)) note += fmt::format(", R² = {:.2f}", *deviation.r_squared);
  rows.push_back({"deviation", fmt::format("{:.4f} s", *deviation.best_s), "", note});
}

}  // namespace

std::vector<AnswerRow> AnswerRows(const pa::Analysis& analysis) {
  std::vector<AnswerRow> rows;
  const bool good = analysis.pressure_advance.good();
  const pa::WeighedStorage* const law = LawOf(analysis);
  if (law != nullptr) {
    const char* const of = analysis.repeats ? " in the fit of all patterns' lines" : "";
    rows.push_back(RowOf("shape of the lines", law->pressure_advance_s, kSeconds,
                         fmt::format("counts {:.0f} %{}", 100 * law->weight, of)));
    rows.push_back(RowOf("changes of speed", law->crossings_s, kSeconds,
                         fmt::format("counts {:.0f} %{}, corrected by {:+.1f} ms",
                                     100 * (1 - law->weight), of, -law->correction_s * kMsPerS)));
  }
  if (analysis.corners) return rows;  // there is one way to read them
  const auto add_part = [&](const char* name, const Measured& part) {
    // Omits what was not measured: its reason is the answer's.
    const bool measured =
        good || part.good() || part.reason() != analysis.pressure_advance.reason();
    if (measured) rows.push_back(PartRow(name, part, good));
  };
  add_part("speeding up", analysis.response.acceleration.pressure_advance);
  add_part("slowing down", analysis.response.deceleration.pressure_advance);
  if (law != nullptr) AddStorage(*law, analysis.motion, rows);
  if (good) AddScore(analysis.deviation, rows);
  if (!analysis.repeats) return rows;
  const pa::Repeats& repeats = *analysis.repeats;
  for (std::size_t i = 0; i < repeats.pattern_s.size(); ++i) {
    rows.push_back(PartRow(fmt::format("pattern {}", i + 1), repeats.pattern_s[i], good));
  }
  if (repeats.scatter_s > 0) {
    rows.push_back({"scatter", fmt::format("{:.4f} s", repeats.scatter_s), "",
                    fmt::format("1 σ, from pattern to pattern, {} than their intervals explain",
                                repeats.disagree ? "more" : "no more")});
  }
  return rows;
}

std::string FlowSentence(const pa::FlowRatio& flow) {
  if (!flow.ratio.good()) return flow.ratio.reason();
  const Quantity& ratio = flow.ratio.quantity();
  const double missing = 1 - 1 / ratio.value;
  const std::string set = fmt::format("set the flow ratio to {}",
                                      NumberText(ratio.value, kFlowRatio.min_decimals, false));
  if (ratio.interval95.lo <= 1 && ratio.interval95.hi >= 1) {
    return fmt::format(
        "the printer lays what is commanded, as far as this scan tells ({:.1f} % too {}): "
        "a flow ratio of 1 is as good as {}",
        100 * std::abs(missing), missing < 0 ? "much" : "little",
        NumberText(ratio.value, kFlowRatio.min_decimals, false));
  }
  return fmt::format("the printer lays {:.1f} % too {}: {}", 100 * std::abs(missing),
                     missing < 0 ? "much" : "little", set);
}

std::string SlipSentence(const pa::FlowRatio& flow, const pa::LineMotion& motion) {
  if (!flow.areas || !flow.areas->slow || !flow.areas->fast || motion.segments.size() != 3)
    return "";
  const double less = 1 - flow.areas->fast->value / flow.areas->slow->value;
  return fmt::format("at {:.4g} mm/s the lines have {:.1f} % {} than at {:.4g} mm/s",
                     motion.segments[1].speed_mm_s, 100 * std::abs(less),
                     less < 0 ? "more" : "less", motion.segments[0].speed_mm_s);
}

namespace {

std::string Facts(const ReportOptions& options) {
  std::string out = "<p class=\"facts\">";
  out += EscapeHtml(options.source);
  for (const auto& [name, value] : options.facts) {
    out += fmt::format(" · {}: {}", EscapeHtml(name), EscapeHtml(value));
  }
  return out + "</p>\n";
}

// Escapes a reason, and keeps its options (--gcode) from being broken over two lines.
std::string ReasonHtml(const std::string& reason) {
  const std::string text = EscapeHtml(reason);
  std::string html;
  std::size_t done = 0;
  for (std::size_t at = 0; (at = text.find("--", done)) != std::string::npos;) {
    const std::size_t end =
        std::min(text.find_first_not_of("-abcdefghijklmnopqrstuvwxyz", at), text.size());
    html += text.substr(done, at - done) +
            fmt::format("<span class=\"option\">{}</span>", text.substr(at, end - at));
    done = end;
  }
  return html + text.substr(done);
}

std::string Head(const pa::Analysis& analysis) {
  const Measured& answer = analysis.pressure_advance;
  if (answer.good()) {
    const Quantity& quantity = answer.quantity();
    return HeadCard(
        Verdict::kGood,
        AnswerLine(ValueText(quantity.value, quantity.interval95, kSeconds),
                   IntervalText(quantity.interval95, kSeconds)) +
            "<p class=\"quiet\">The true value lies in this interval 95 times in 100.</p>\n");
  }
  std::string body = "<p class=\"value\">No value</p>\n";
  body += fmt::format("<p class=\"reason\">{}</p>\n", ReasonHtml(answer.reason()));
  body += answer.verdict() == Verdict::kCannotTell
              ? "<p class=\"quiet\">The recording is sound, but it does not determine the pressure "
                "advance. A guess would be worse than the value in use.</p>\n"
              : "<p class=\"quiet\">Nothing could be measured.</p>\n";
  return HeadCard(answer.verdict(), body);
}

// Returns the command for another firmware than Klipper that printed the lines.
std::string NextIn(const gcode::PrintedBy& printed_by, const std::string& value_s) {
  const gcode::FirmwareWords& words = gcode::WordsOf(printed_by.dialect);
  const auto lines = PressureAdvanceCommands(printed_by.dialect, value_s, {{}, printed_by.drive});
  return Card(
      "What to do next",
      fmt::format("<p>Try it at once ({}):</p>\n<pre>{}</pre>\n"
                  "<p>Keep it: {}.</p>\n"
                  "<p class=\"quiet\">It holds for this filament, nozzle and temperature. "
                  "A slicer that sets pressure advance itself overwrites it: set the same "
                  "value there.</p>\n",
                  EscapeHtml(words.title), EscapeHtml(lines.front()), EscapeHtml(words.keep)));
}

// Returns the commands of all firmwares but Klipper in a sentence.
std::string OtherFirmwares(const std::string& value_s) {
  std::string all;
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    if (words.dialect == gcode::Dialect::kKlipper) continue;
    all += fmt::format("{}{}: <code>{}</code>", all.empty() ? "" : " · ", EscapeHtml(words.title),
                       EscapeHtml(PressureAdvanceCommands(words.dialect, value_s).front()));
  }
  return all;
}

std::string Next(const pa::Analysis& analysis, bool has_figures) {
  const Measured& answer = analysis.pressure_advance;
  if (!answer.good()) {
    return Card(
        "What to do next",
        fmt::format(
            "<p>Put right what the reason above names, and measure again{}. Until then, keep the "
            "pressure advance that is in use.</p>\n",
            has_figures ? "; the figures below show what was seen" : ""));
  }
  const std::string value =
      SecondsText(answer.quantity().value, answer.quantity().standard_uncertainty);
  if (analysis.printed_by && analysis.printed_by->dialect != gcode::Dialect::kKlipper) {
    return NextIn(*analysis.printed_by, value);
  }
  return Card("What to do next",
              fmt::format("<p>Try it at once (Klipper):</p>\n<pre>{2}</pre>\n"
                          "<p>Keep it, in <code>printer.cfg</code>:</p>\n"
                          "<pre>[extruder]\npressure_advance: {0}</pre>\n"
                          "<p class=\"quiet\">{1}. It holds for this filament, nozzle and "
                          "temperature. A slicer that sets "
                          "pressure advance itself overwrites it: set the same value there.</p>\n",
                          value, OtherFirmwares(value),
                          PressureAdvanceCommands(gcode::Dialect::kKlipper, value).front()));
}

std::string Capitalised(std::string sentence) {
  if (!sentence.empty() && sentence.front() >= 'a' && sentence.front() <= 'z') {
    sentence.front() = static_cast<char>(sentence.front() - 'a' + 'A');
  }
  return sentence;
}

std::string FlowCard(const pa::Analysis& analysis) {
  if (!analysis.flow) return "";
  const pa::FlowRatio& flow = *analysis.flow;
  if (!flow.ratio.good()) {
    return Card("Flow ratio (extrusion multiplier)",
                fmt::format("<p>{}: {}.</p>\n", VerdictText(flow.ratio.verdict()),
                            EscapeHtml(FlowSentence(flow))));
  }
  const Quantity& ratio = flow.ratio.quantity();
  const std::string value = NumberText(ratio.value, kFlowRatio.min_decimals, false);
  const std::string slip = SlipSentence(flow, analysis.motion);
  return Card(
      "Flow ratio (extrusion multiplier)",
      AnswerLine(ValueText(ratio.value, ratio.interval95, kFlowRatio),
                 IntervalText(ratio.interval95, kFlowRatio)) +
          fmt::format(
              "<p><strong>{}.</strong>{}</p>\n"
              "<p>OrcaSlicer, filament settings, in place of the ratio there:</p>\n"
              "<pre>filament_flow_ratio = {}</pre>\n"
              "<p>Firmware, to try it with a slicer's flow ratio of 1:</p>\n"
              "<pre>M221 S{:.1f}</pre>\n"
              "<p class=\"quiet\">Nothing was applied. The pattern was printed with a flow ratio "
              "of 1. The slow stretches of {} lines count{}. It holds for the filament that was "
              "printed, with the filament diameter set in the pattern.</p>\n",
              EscapeHtml(Capitalised(FlowSentence(flow))),
              slip.empty() ? "" : " " + EscapeHtml(Capitalised(slip)) + ".", value,
              100 * ratio.value, flow.areas->slow->lines,
              flow.by_reference ? ", beside a scan of a known flow ratio" : ""));
}

std::string Parts(const pa::Analysis& analysis) {
  const std::vector<AnswerRow> rows = AnswerRows(analysis);
  if (rows.empty()) return "";
  Table table({{""}, {"value"}, {"interval"}, {"", true}});
  for (const AnswerRow& row : rows) {
    table.Row({EscapeHtml(row.name), row.value, row.interval, EscapeHtml(row.note)});
  }
  return Card("What the answer is made of", table.Html());
}

std::string SurplusCell(const pa::TransitionResult& result, std::size_t line) {
  if (line >= result.surplus_s.size() || line >= result.sigma_s.size() ||
      !(result.sigma_s[line] > 0) || !std::isfinite(result.surplus_s[line]) ||
      !std::isfinite(result.sigma_s[line])) {
    return "–";
  }
  const double value = result.surplus_s[line] * kMsPerS;
  const Interval interval = NormalInterval95(value, result.sigma_s[line] * kMsPerS);
  return fmt::format("{:+.1f} ({:+.1f} to {:+.1f})", value, interval.lo, interval.hi);
}

std::string Lines(const pa::Analysis& analysis) {
  if (analysis.lines.empty()) return "";
  const auto& scores = analysis.deviation.score_px;
  const bool scored = std::any_of(scores.begin(), scores.end(),
                                  [](const auto& score) { return score && std::isfinite(*score); });
  std::vector<Table::Column> columns = {{"printed with (s)"}};
  std::vector<const pa::TransitionResult*> readings;
  const auto read = [&](const char* name, const pa::TransitionResult& result) {
    columns.push_back({name});
    readings.push_back(&result);
  };
  if (analysis.corners) {
    read("corner (ms)", analysis.corners->response);
  } else {
    read("speeding up (ms)", analysis.response.acceleration);
    read("slowing down (ms)", analysis.response.deceleration);
  }
  if (scored) columns.push_back({"deviation (px)"});
  columns.push_back({"", true});
  Table table(columns);
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    const pa::LineResult& line = analysis.lines[i];
    std::vector<std::string> cells = {fmt::format(
        "{:.4f}", std::isfinite(line.pressure_advance_s) ? line.pressure_advance_s : 0)};
    for (const pa::TransitionResult* result : readings) cells.push_back(SurplusCell(*result, i));
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

std::string PageOf(const pa::Analysis& analysis, const std::vector<Figure>& figures,
                   const ReportOptions& options, const PhotoDetail& detail) {
  std::string page = PageBegin("Pressure advance", "Pressure advance");
  page += Facts(options);
  page += Head(analysis);
  page += Next(analysis, !figures.empty());
  page += FlowCard(analysis);
  page += ListCard("Worth knowing", analysis.notices);
  page += Parts(analysis);
  for (const Figure& figure : figures) page += Card("", FigureHtml(figure, detail));
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

std::string PressureAdvanceReport(const pa::Analysis& analysis, const std::vector<Figure>& figures,
                                  const ReportOptions& options) {
  return FittingPage(
      [&](std::size_t step) { return PageOf(analysis, figures, options, kPhotoSteps[step]); });
}

}  // namespace trammel::report
