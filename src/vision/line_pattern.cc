#include "vision/line_pattern.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "base/check.h"
#include "base/statistics.h"
#include "geometry/linear_systems.h"

namespace trammel::vision {
namespace {

// Returns the median over some columns of each row: a string or a break in a line does not shift
// it.
std::vector<double> RowMedians(const GrayImage& image, int x_begin, int x_end) {
  const int step = std::max(1, (x_end - x_begin) / 150);
  std::vector<double> medians, row;
  for (int y = 0; y < image.height; ++y) {
    row.clear();
    for (int x = x_begin; x < x_end; x += step) row.push_back(image.row(y)[x]);
    medians.push_back(Median(row));
  }
  return medians;
}

std::vector<double> ColumnMedians(const GrayImage& image, int y_begin, int y_end) {
  const int step = std::max(1, (y_end - y_begin) / 150);
  std::vector<double> medians, column;
  for (int x = 0; x < image.width; ++x) {
    column.clear();
    for (int y = y_begin; y < y_end; y += step) column.push_back(image.row(y)[x]);
    medians.push_back(Median(column));
  }
  return medians;
}

double Wobble(const std::vector<double>& values, int begin, int end) {
  const std::vector<double> trend = BoxMean(values, (end - begin) / 6);
  double sum = 0;
  for (int i = begin; i < end; ++i) sum += (values[i] - trend[i]) * (values[i] - trend[i]);
  return std::sqrt(sum / std::max(1, end - begin));
}

struct Run {
  double begin = 0, end = 0;  // px, at half contrast
  double strength = 0;        // contrast

  [[nodiscard]] double centre() const { return (begin + end) / 2; }
  [[nodiscard]] double width() const { return end - begin; }
};

// Returns stretches above the middle between the local extremes, if these are as far apart as
// elsewhere.
std::vector<Run> Runs(const std::vector<double>& values, int half_window) {
  const int n = static_cast<int>(values.size());
  std::vector<double> low(values.size()), high(values.size()), range(values.size());
  for (int i = 0; i < n; ++i) {
    const auto a = values.begin() + std::max(0, i - half_window);
    const auto b = values.begin() + std::min(n, i + half_window + 1);
    const auto [least, most] = std::minmax_element(a, b);
    low[i] = *least;
    high[i] = *most;
    range[i] = *most - *least;
  }
  constexpr double kMinRange = 0.35;  // relative to this picture's usual range
  const double usual = Quantile(range, 0.75);
  low = BoxMean(low, half_window / 2);
  high = BoxMean(high, half_window / 2);
  std::vector<Run> runs;
  for (int i = 1; i < n; ++i) {
    const auto above = [&](int k) { return values[k] - (low[k] + high[k]) / 2; };
    if (!(above(i - 1) <= 0 && above(i) > 0)) continue;
    Run run;
    run.begin = i - above(i) / (above(i) - above(i - 1));
    int k = i;
    double peak = 0;
    for (; k < n && above(k) > 0; ++k) peak = std::max(peak, values[k] - low[k]);
    run.end = k < n ? k - 1 + above(k - 1) / (above(k - 1) - above(k)) : n - 1;
    run.strength = peak;
    if (peak > kMinRange * usual) runs.push_back(run);
  }
  return runs;
}

// Returns the runs between the two bars that close the frame; a problem if the bars are missing.
std::vector<Run> BetweenBars(const std::vector<Run>& runs, int margin, int height,
                             std::string& problem) {
  const double inner = height - 2.0 * margin;
  constexpr double kBarReach = 0.03;  // relative to the frame's height
  const double first = margin + kBarReach * inner;
  const double last = height - margin - kBarReach * inner;
  std::vector<Run> between;
  bool top = false, bottom = false;
  for (const Run& run : runs) {
    if (run.begin > margin - kBarReach * inner && run.begin < first) {
      top = true;
    } else if (run.end > last && run.end < height - margin + kBarReach * inner) {
      bottom = true;
    } else if (run.begin >= first && run.end <= last) {
      between.push_back(run);
    }
  }
  if (!top || !bottom) problem = "the outline has no bars parallel to the lines at its ends";
  return between;
}

void DropUnlikeTheRest(std::vector<Run>& runs) {
  std::vector<double> strengths, widths;
  for (const Run& run : runs) {
    strengths.push_back(run.strength);
    widths.push_back(run.width());
  }
  const double strength = Median(strengths), width = Median(widths);
  std::erase_if(runs, [&](const Run& run) {
    return run.strength < 0.35 * strength || run.width() < 0.35 * width;
  });
}

// Checks that the runs have equal steps, and records missing ones.
void CheckSteps(const std::vector<Run>& runs, LinePattern& line_pattern) {
  std::vector<double> steps, widths;
  for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
    steps.push_back(runs[i + 1].centre() - runs[i].centre());
  }
  for (const Run& run : runs) widths.push_back(run.width());
  line_pattern.pitch_px = Median(steps);
  line_pattern.bead_px = Median(widths);
  constexpr double kLargestIrregularity = 0.3;  // pitches
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double pitches = steps[i] / line_pattern.pitch_px;
    const double whole = std::max(1.0, std::round(pitches));
    line_pattern.irregularity = std::max(line_pattern.irregularity, std::abs(pitches - whole));
    line_pattern.steps.push_back(static_cast<int>(whole));
  }
  if (line_pattern.irregularity > kLargestIrregularity) {
    line_pattern.problem = fmt::format(
        "the {} stripes inside the outline are not equally spaced (a spacing is off by {:.2f} of "
        "the usual {:.1f} px)",
        runs.size(), line_pattern.irregularity, line_pattern.pitch_px);
  }
}

void TraceRungs(const GrayImage& image, int margin, const std::vector<Run>& runs,
                LinePattern& line_pattern) {
  constexpr int kTraceZones = 30;
  const double inner = image.width - 2.0 * margin;
  for (const Run& run : runs) {
    std::vector<double> x_px, y_px;
    // Search outwards from the middle both ways, each zone starting at the last one's position.
    for (const int direction : {1, -1}) {
      double near = run.centre();
      for (int zone = direction > 0 ? kTraceZones / 2 : kTraceZones / 2 - 1;
           zone >= 2 && zone < kTraceZones - 2; zone += direction) {
        const int x0 = margin + static_cast<int>(inner * zone / kTraceZones);
        const int x1 = margin + static_cast<int>(inner * (zone + 1) / kTraceZones);
        const std::optional<RungSection> section =
            SectionOfRung(image, x0, std::max(x0 + 1, x1), near, line_pattern.pitch_px);
        if (!section || section->height < 0.35 * run.strength ||
            std::abs(section->middle_px - near) > 0.25 * line_pattern.pitch_px) {
          continue;
        }
        near = section->middle_px;
        x_px.push_back((x0 + x1 - 1) / 2.0);
        y_px.push_back(near);
      }
    }
    if (x_px.empty()) {
      x_px.push_back(image.width / 2.0);
      y_px.push_back(run.centre());
    }
    line_pattern.rungs.push_back(FitCurve(x_px, y_px, image.width / 2.0, inner / 2));
  }
}

// Finds the start of the rail, going left from inside the frame; values run from the picture's
// left.
std::optional<double> RailEdge(const std::vector<double>& values, int margin, double bead_px) {
  const int width = static_cast<int>(values.size());
  const double inner = width - 2.0 * margin;
  const int from = margin + static_cast<int>(0.2 * inner);
  const int rail_end = margin + static_cast<int>(0.12 * inner);
  const auto begin = values.begin();
  const double plate = Quantile(std::vector<double>(begin + margin, begin + from), 0.3);
  const std::vector<double> smooth = BoxMean(values, std::max(1, static_cast<int>(bead_px / 6)));
  const double rail = *std::max_element(smooth.begin() + margin, smooth.begin() + rail_end);
  const double half = (plate + rail) / 2;
  const int least = std::max(2, static_cast<int>(0.4 * bead_px));
  for (int x = from; x > margin; --x) {
    if (!(smooth[x] <= half && smooth[x - 1] > half)) continue;
    bool rail_follows = true;
    for (int k = 1; k <= least && x - k >= 0; ++k) rail_follows &= smooth[x - k] > half;
    if (rail_follows) return x - 1 + (smooth[x - 1] - half) / (smooth[x - 1] - smooth[x]);
  }
  return std::nullopt;
}

void FindRails(const GrayImage& image, int margin, LinePattern& line_pattern) {
  std::vector<double> left_x, left_y, right_x, right_y;
  for (std::size_t i = 0; i + 1 < line_pattern.rungs.size(); ++i) {
    const Curve& above = line_pattern.rungs[i];
    const Curve& below = line_pattern.rungs[i + 1];
    std::vector<double> values = BetweenRungs(image, above, below, line_pattern.pitch_px);
    if (const auto edge = RailEdge(values, margin, line_pattern.bead_px)) {
      left_x.push_back(*edge);
      left_y.push_back((above(*edge) + below(*edge)) / 2);
    }
    std::reverse(values.begin(), values.end());
    if (const auto edge = RailEdge(values, margin, line_pattern.bead_px)) {
      const double x = image.width - 1 - *edge;
      right_x.push_back(x);
      right_y.push_back((above(x) + below(x)) / 2);
    }
  }
  const std::size_t fewest = (line_pattern.rungs.size() - 1 + 1) / 2;
  if (left_x.size() < fewest || right_x.size() < fewest) {
    line_pattern.problem = fmt::format(
        "the frame's two bars across the lines' ends are seen beside {} and {} of {} spaces "
        "between "
        "lines",
        left_x.size(), right_x.size(), line_pattern.rungs.size() - 1);
    return;
  }
  const double centre = image.height / 2.0;
  const double half = centre - margin;
  line_pattern.left_inner = FitCurve(left_y, left_x, centre, half);
  line_pattern.right_inner = FitCurve(right_y, right_x, centre, half);
}

}  // namespace

Curve FitCurve(const std::vector<double>& s, const std::vector<double>& value, double centre,
               double half_span) {
  TRAMMEL_CHECK(!s.empty() && s.size() == value.size() && half_span > 0, "{} and {} points, {}",
                s.size(), value.size(), half_span);
  const std::size_t n = s.size();
  const Eigen::Index terms = n >= 6 ? 3 : n >= 3 ? 2 : 1;
  std::vector<double> weight(n, 1.0), rest(n);
  Eigen::VectorXd c;
  for (int iteration = 0; iteration < 12; ++iteration) {
    // Computes the normal equations by loops: Eigen's matrix products take the compiler seconds.
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(terms, terms);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(terms);
    const auto powers = [&](std::size_t i) {
      const double u = (s[i] - centre) / half_span;
      return std::array<double, 3>{1, u, u * u};
    };
    for (std::size_t i = 0; i < n; ++i) {
      const std::array<double, 3> row = powers(i);
      for (Eigen::Index k = 0; k < terms; ++k) {
        for (Eigen::Index l = 0; l < terms; ++l) information(k, l) += weight[i] * row[k] * row[l];
        right(k) += weight[i] * row[k] * value[i];
      }
    }
    c = geometry::SolveSymmetric(information, right);
    for (std::size_t i = 0; i < n; ++i) {
      const std::array<double, 3> row = powers(i);
      double predicted = 0;
      for (Eigen::Index k = 0; k < terms; ++k) predicted += c(k) * row[k];
      rest[i] = std::abs(value[i] - predicted);
    }
    std::vector<double> sizes = rest;
    const double scale = std::max(0.05, 1.4826 * Median(sizes));
    for (std::size_t i = 0; i < n; ++i) {
      // Huber first, for a start near the bulk, then Tukey, to reject the outliers.
      const double ratio = rest[i] / scale;
      const double tukey = ratio < 4.7 ? std::pow(1 - ratio * ratio / (4.7 * 4.7), 2) : 0;
      weight[i] = std::max(1e-9, iteration < 6 ? std::min(1.0, 1 / std::max(ratio, 1e-9)) : tukey);
    }
  }
  Curve curve{centre, half_span, c(0), terms > 1 ? c(1) : 0, terms > 2 ? c(2) : 0};
  return curve;
}

double RowsOverColumns(const GrayImage& contrast, int margin_px) {
  const int w = contrast.width, h = contrast.height;
  const auto part = [&](int size, double share) {
    return margin_px + static_cast<int>(share * (size - 2 * margin_px));
  };
  const double rows =
      Wobble(RowMedians(contrast, part(w, 0.15), part(w, 0.85)), part(h, 0.15), part(h, 0.85));
  const double columns =
      Wobble(ColumnMedians(contrast, part(h, 0.15), part(h, 0.85)), part(w, 0.15), part(w, 0.85));
  return rows / std::max(columns, 1e-9);
}

LinePattern FindLinePattern(const GrayImage& contrast, int margin_px, std::size_t rungs_hint) {
  TRAMMEL_CHECK(contrast.width - 2 * margin_px >= 40 && contrast.height - 2 * margin_px >= 40,
                "{} x {}, margin {}", contrast.width, contrast.height, margin_px);
  LinePattern line_pattern;
  const double inner = contrast.height - 2.0 * margin_px;
  const int begin = margin_px + static_cast<int>(0.3 * (contrast.width - 2 * margin_px));
  const int end = margin_px + static_cast<int>(0.7 * (contrast.width - 2 * margin_px));
  const std::vector<double> rows =
      BoxMean(RowMedians(contrast, begin, end), static_cast<int>(inner / 1500));
  const double pitch_hint = inner / static_cast<double>(rungs_hint + 1);
  std::vector<Run> runs = BetweenBars(Runs(rows, std::max(3, static_cast<int>(0.75 * pitch_hint))),
                                      margin_px, contrast.height, line_pattern.problem);
  if (!line_pattern.problem.empty()) return line_pattern;
  if (runs.size() >= 3) DropUnlikeTheRest(runs);
  if (runs.size() < 2) {
    line_pattern.problem = fmt::format("{} lines lie inside the outline", runs.size());
    return line_pattern;
  }
  CheckSteps(runs, line_pattern);
  if (!line_pattern.problem.empty()) return line_pattern;
  TraceRungs(contrast, margin_px, runs, line_pattern);
  FindRails(contrast, margin_px, line_pattern);
  return line_pattern;
}

std::vector<double> BoxMean(const std::vector<double>& values, int half) {
  const int n = static_cast<int>(values.size());
  std::vector<double> sums(values.size() + 1, 0.0), means(values.size());
  for (int i = 0; i < n; ++i) sums[i + 1] = sums[i] + values[i];
  for (int i = 0; i < n; ++i) {
    const int a = std::max(0, i - half), b = std::min(n, i + half + 1);
    means[i] = (sums[b] - sums[a]) / (b - a);
  }
  return means;
}

std::optional<RungSection> SectionOfRung(const GrayImage& image, int x_begin, int x_end,
                                         double y_near, double pitch_px) {
  const int a = std::max(0, static_cast<int>(y_near - 0.55 * pitch_px));
  const int b = std::min(image.height - 1, static_cast<int>(y_near + 0.55 * pitch_px));
  if (b - a < 4) return std::nullopt;
  std::vector<double> profile;
  for (int y = a; y <= b; ++y) {
    double sum = 0;
    for (int x = x_begin; x < x_end; ++x) sum += image.row(y)[x];
    profile.push_back(sum / (x_end - x_begin));
  }
  const int n = static_cast<int>(profile.size());
  const auto quarter = profile.begin() + n / 4;
  const auto peak = std::max_element(quarter, profile.end() - n / 4);
  const double low = Quantile(profile, 0.15);
  const double half = (*peak + low) / 2;
  const int top = static_cast<int>(peak - profile.begin());
  int i = top, k = top;
  while (i > 0 && profile[i - 1] > half) --i;
  while (k + 1 < n && profile[k + 1] > half) ++k;
  double weights = 0, moment = 0;
  for (int y = i; y <= k; ++y) {
    weights += profile[y] - half;
    moment += (profile[y] - half) * y;
  }
  if (!(weights > 0)) return std::nullopt;
  return RungSection{a + moment / weights, k - i + 1.0, *peak - low};
}

std::vector<double> BetweenRungs(const GrayImage& image, const Curve& above, const Curve& below,
                                 double pitch_px) {
  std::vector<double> values(static_cast<std::size_t>(image.width));
  const int half = std::max(0, static_cast<int>(0.12 * pitch_px));
  for (int x = 0; x < image.width; ++x) {
    const int middle = static_cast<int>(std::lround((above(x) + below(x)) / 2));
    double sum = 0;
    for (int y = middle - half; y <= middle + half; ++y) {
      sum += image.row(std::clamp(y, 0, image.height - 1))[x];
    }
    values[x] = sum / (2 * half + 1);
  }
  return values;
}

}  // namespace trammel::vision
