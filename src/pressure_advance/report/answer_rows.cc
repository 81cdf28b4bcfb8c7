#include "pressure_advance/report/answer_rows.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "document/interval_text.h"

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
  if (!part.good()) return {std::move(name), VerdictWords(part.verdict()), "", part.reason()};
  // A part that is sound is still no answer where the whole is not.
  if (!answer_good) {
    return {std::move(name), "not shown", "", "readable alone, but the whole is not to be trusted"};
  }
  return RowOf(std::move(name), part.quantity(), kSeconds, "");
}

/// The storage model that the answer was weighed with; none where it was not.
const pa::LearntLaw* LawOf(const pa::Analysis& analysis) {
  const pa::ResponseResult& response = analysis.response;
  const bool counts =
      analysis.pressure_advance.good() && response.pressure_advance.good() && response.law;
  return counts ? &*response.law : nullptr;
}

void AddLaw(const pa::LearntLaw& law, const pa::LineMotion& motion, std::vector<AnswerRow>& rows) {
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
  const pa::LearntLaw* const law = LawOf(analysis);
  if (law != nullptr) {
    const char* const of = analysis.repeats ? " in the fit of all patterns' lines" : "";
    rows.push_back(RowOf("shape of the lines", law->pressure_advance_s, kSeconds,
                         fmt::format("counts {:.0f} %{}", 100 * law->weight, of)));
    rows.push_back(RowOf("changes of speed", law->crossings_s, kSeconds,
                         fmt::format("counts {:.0f} %{}, corrected by {:+.1f} ms",
                                     100 * (1 - law->weight), of, -law->correction_s * kMsPerS)));
  }
  rows.push_back(PartRow("speeding up", analysis.response.acceleration.pressure_advance, good));
  rows.push_back(PartRow("slowing down", analysis.response.deceleration.pressure_advance, good));
  if (law != nullptr) AddLaw(*law, analysis.motion, rows);
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

}  // namespace trammel::report
