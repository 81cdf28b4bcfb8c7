#include "tap/report/comparison_json.h"

#include <nlohmann/json.hpp>

#include "document/json_number.h"
#include "tap/report/comparison_text.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

Json JsonOf(const Measured& measured) {
  Json object{{"verdict", ToString(measured.verdict())}, {"reason", measured.reason()}};
  object["value"] = object["standard_uncertainty"] = object["interval95"] = nullptr;
  if (!measured.good()) return object;
  const Quantity& quantity = measured.quantity();
  object["value"] = quantity.value;
  object["standard_uncertainty"] = quantity.standard_uncertainty;
  object["interval95"] = {quantity.interval95.lo, quantity.interval95.hi};
  return object;
}

Json JsonOf(const tap::MethodScatter& scatter) {
  return {{"good", scatter.good},
          {"deviation_mm", JsonOf(scatter.deviation_mm)},
          {"back_to_back_mm", JsonOf(scatter.back_to_back_mm)},
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
          {"ratio", JsonOf(comparison.ratio)},
          {"back_to_back_ratio", JsonOf(comparison.back_to_back_ratio)},
          {"difference_mm", JsonOf(comparison.difference_mm)},
          {"notices", ComparisonNotices(comparison)}};
}

}  // namespace trammel::report
