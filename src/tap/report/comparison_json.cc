#include "tap/report/comparison_json.h"

#include <nlohmann/json.hpp>

#include "base/measured_json.h"
#include "document/json_number.h"
#include "tap/report/comparison_text.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

Json JsonOf(const tap::MethodScatter& scatter) {
  return {{"good", scatter.good},
          {"deviation_mm", MeasuredJson(scatter.deviation_mm)},
          {"back_to_back_mm", MeasuredJson(scatter.back_to_back_mm)},
          {"claimed_mm", Number(scatter.claimed_mm)}};
}

}  // namespace

Json JsonOf(const tap::MethodComparison& comparison) {
  const Verdict verdict = comparison.ratio.verdict();
  return {{"format", kFormat},
          {"verdict", ToString(verdict)},
          {"reason", comparison.ratio.reason()},
          {"better", tap::ToString(comparison.better)},
          {"because", comparison.because},
          {"taps", comparison.taps},
          {"used", comparison.used},
          {"places", comparison.places},
          {"contact", JsonOf(comparison.contact)},
          {"two_line", JsonOf(comparison.two_line)},
          {"ratio", MeasuredJson(comparison.ratio)},
          {"back_to_back_ratio", MeasuredJson(comparison.back_to_back_ratio)},
          {"difference_mm", MeasuredJson(comparison.difference_mm)},
          {"notices", ComparisonNotices(comparison)}};
}

}  // namespace trammel::report
