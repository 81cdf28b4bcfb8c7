#include "app/study/study_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/statistics.h"
#include "pressure_advance/laser/deviation.h"

namespace trammel::app {
namespace {

constexpr int kCurvePoints = 60;
constexpr double kRounding = 1 + 1e-9;  // a value a whole step away counts as within it

// The median distance of neighbouring lines.
double StepOf(const std::vector<StudyScan>& scans) {
  std::vector<double> steps;
  for (const StudyScan& scan : scans) {
    std::vector<double> values = scan.pressure_advances_s;
    std::sort(values.begin(), values.end());
    for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  }
  return steps.empty() ? 0 : Median(steps);
}

void CountWithin(double step_s, ChosenValues& chosen) {
  if (chosen.value_s.empty()) return;
  const double mean = Mean(chosen.value_s);
  for (const double value : chosen.value_s) {
    chosen.within_step += std::abs(value - mean) <= step_s * kRounding;
  }
}

std::optional<AggregateLine> FitLine(const std::vector<double>& x, const std::vector<double>& y) {
  if (x.size() < 3) return std::nullopt;
  const double mean_x = Mean(x);
  const double mean_y = Mean(y);
  double xx = 0;
  double xy = 0;
  double yy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
    yy += (y[i] - mean_y) * (y[i] - mean_y);
  }
  if (!(xx > 0 && yy > 0)) return std::nullopt;
  AggregateLine line;
  line.slope = xy / xx;
  line.offset_s = mean_y - line.slope * mean_x;
  line.r_squared = xy * xy / (xx * yy);
  if (line.slope != 0) line.zero_s = -line.offset_s / line.slope;
  return line;
}

std::optional<double> CurveFactor(const std::vector<double>& cubic, const PaperFigures& paper) {
  if (cubic.size() != 4) return std::nullopt;
  constexpr double kLast_s = 0.06;  // of the paper's lines
  const std::vector<double> theirs(paper.cubic.begin(), paper.cubic.end());
  double factor = 1;
  for (int i = 0; i <= kCurvePoints; ++i) {
    const double p = kLast_s * i / kCurvePoints;
    const double ratio = CubicAt(cubic, p) / CubicAt(theirs, p);
    if (!(ratio > 0)) return std::nullopt;
    factor = std::max({factor, ratio, 1 / ratio});
  }
  return factor;
}

double RootMeanSquare(const std::vector<double>& values) {
  double square = 0;
  for (const double value : values) square += value * value;
  return values.empty() ? 0 : std::sqrt(square / static_cast<double>(values.size()));
}

double MeanOf(const std::vector<double>& values) { return values.empty() ? 0 : Mean(values); }

std::string Digits(const std::optional<double>& value, double scale, int decimals) {
  return value ? fmt::format("{:.{}f}", *value * scale, decimals) : std::string("-");
}

std::string Row(const StudySummary& summary) {
  const PaperFigures paper = PaperOf(summary.condition);
  const ChosenValues& chosen = summary.deviation;
  std::optional<double> improvement;
  if (summary.validation) improvement = ImprovementOf(*summary.validation);
  const auto& line = summary.line;
  return fmt::format(
      "{:<22}{:>3} | {:>4.1f} {:>4.1f}  {:>2}/{:<2}  {:>4} {:>4.2f}  {:>4} {:>4.1f}  {:>4}  {:>4} "
      "| "
      "{:>2} {:>5.2f} {:>5.2f} {:>5.2f}  {:>2}/{:<2} {:>2}  {:>4}\n",
      sim::ToString(summary.condition), summary.scans.size(),
      1e3 * StandardDeviation(chosen.value_s), 1e3 * paper.chosen_sd_s, chosen.within_step,
      chosen.value_s.size(), Digits(summary.aggregate.r_squared, 1, 2), paper.r_squared,
      Digits(summary.aggregate.cubic_minimum_s, 1e3, 1), 1e3 * paper.minimum_s,
      Digits(summary.curve_factor, 1, 2), Digits(improvement, 100, 0),
      summary.response.value_s.size(), 1e3 * MeanOf(summary.error_s),
      1e3 * StandardDeviation(summary.error_s), 1e3 * RootMeanSquare(summary.error_s),
      summary.response.within_step, summary.response.value_s.size(), summary.covered,
      line ? Digits(line->r_squared, 1, 2) : "-");
}

}  // namespace

double CubicAt(const std::vector<double>& cubic, double p) {
  double value = 0;
  for (auto c = cubic.rbegin(); c != cubic.rend(); ++c) value = value * p + *c;
  return value;
}

std::optional<double> ImprovementOf(const StudyValidation& validation) {
  if (!(validation.control_px > 0)) return std::nullopt;
  return 1 - validation.calibrated_px / validation.control_px;
}

StudySummary Summarize(const sim::Condition& condition, std::vector<StudyScan> scans,
                       std::optional<StudyValidation> validation) {
  StudySummary summary;
  summary.condition = condition;
  summary.scans = std::move(scans);
  summary.validation = validation;
  summary.step_s = StepOf(summary.scans);
  std::vector<double> advance;
  std::vector<std::optional<double>> score;
  std::vector<double> read;
  std::vector<double> excess;
  for (const StudyScan& scan : summary.scans) {
    const auto& values = scan.pressure_advances_s;
    const auto best = pressure_advance::ScoreByDeviation(values, scan.score_px).best_s;
    if (best) summary.deviation.value_s.push_back(*best);
    for (std::size_t i = 0; i < values.size(); ++i) {
      advance.push_back(values[i]);
      score.push_back(scan.score_px[i]);
      if (!scan.excess_s[i]) continue;
      read.push_back(values[i]);
      excess.push_back(*scan.excess_s[i]);
    }
    if (!scan.response) continue;
    summary.response.value_s.push_back(scan.response->value);
    summary.error_s.push_back(scan.response->value - scan.truth_s);
    summary.covered += scan.response->interval95.lo <= scan.truth_s &&
                       scan.truth_s <= scan.response->interval95.hi;
  }
  CountWithin(summary.step_s, summary.deviation);
  CountWithin(summary.step_s, summary.response);
  summary.aggregate = pressure_advance::ScoreByDeviation(advance, score);
  summary.curve_factor = CurveFactor(summary.aggregate.cubic, PaperOf(condition));
  summary.line = FitLine(read, excess);
  return summary;
}

std::string SummaryText(const std::vector<StudySummary>& summaries) {
  std::string text =
      "Of each pair of columns the second is the paper's.\n"
      "deviation: scatter of the chosen value (ms), within a step of their mean, R^2 and minimum "
      "(ms) of the\n"
      "  cubic through all lines, largest factor between the two cubics, improvement over no "
      "advance (%; paper 80)\n"
      "response: good answers, mean, scatter and rms of their error (ms), within a step, in the "
      "95 % interval,\n"
      "  R^2 of the line through all lines\n"
      "condition              n |  scatter   step        R^2      minimum  fact  impr |  n  mean   "
      "sd   rms    step cov   R^2\n";
  int black = 0;
  int black_within = 0;
  for (const StudySummary& summary : summaries) {
    text += Row(summary);
    if (summary.condition.plate == sim::Plate::kPei) continue;
    black += static_cast<int>(summary.deviation.value_s.size());
    black_within += summary.deviation.within_step;
  }
  if (black > 0) {
    text += fmt::format(
        "deviation within a step of the mean on the black plates: {} of {} ({:.0f} %; paper "
        "{:.0f} %)\n",
        black_within, black, 100.0 * black_within / black, 100 * kPaperWithinStep);
  }
  return text;
}

}  // namespace trammel::app
