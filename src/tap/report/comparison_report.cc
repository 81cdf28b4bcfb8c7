#include "tap/report/comparison_report.h"

#include <fmt/format.h>

#include <cmath>

#include "base/measured_json.h"
#include "document/interval_text.h"
#include "document/json_number.h"

namespace trammel::report {
namespace {

std::string Cell(const Measured& measured, const IntervalStyle& style) {
  return measured.good() ? WithInterval(measured.quantity(), style) : "–";
}

std::string Um(double mm) {
  return std::isfinite(mm) ? fmt::format("{:.2f} µm", mm * kUmPerMm) : "–";
}

}  // namespace

std::string ComparisonText(std::span<const tap::SeriesScatter> series) {
  const IntervalStyle um{.unit = "µm", .scale = kUmPerMm, .min_decimals = 2};
  const IntervalStyle ratio{.min_decimals = 2};
  std::string text = fmt::format("{:<18}{:<12}{:<34}{:<12}{:<10}{}\n", "compared", "good",
                                 "scatter about the mean", "mean step", "stated", "by the first");
  for (const tap::SeriesScatter& one : series) {
    text += fmt::format("{:<17} {:<12}{:<34}{:<12}{:<10}", one.name,
                        fmt::format("{} of {}", one.good, one.taps), Cell(one.deviation_mm, um),
                        Um(one.mean_step_mm), Um(one.claimed_mm));
    if (one.ratio.good()) {
      const Interval& interval = one.ratio.quantity().interval95;
      text += Cell(one.ratio, ratio) + (interval.hi < 1   ? ": repeats better"
                                        : interval.lo > 1 ? ": repeats worse"
                                                          : ": cannot tell");
    }
    text += '\n';
    if (!one.deviation_mm.good()) {
      text += fmt::format("    because: {}\n", one.deviation_mm.reason());
    }
  }
  return text;
}

nlohmann::ordered_json JsonOf(std::span<const tap::SeriesScatter> series) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const tap::SeriesScatter& one : series) {
    list.push_back({{"series", one.name},
                    {"taps", one.taps},
                    {"good", one.good},
                    {"used", one.used},
                    {"deviation_mm", MeasuredJson(one.deviation_mm)},
                    {"mean_step_mm", Number(one.mean_step_mm)},
                    {"predicted_deviation_mm", Number(one.claimed_mm)}});
    if (list.size() > 1) list.back()["ratio"] = MeasuredJson(one.ratio);
  }
  return list;
}

}  // namespace trammel::report
