#include "pressure_advance/commands/kept_result.h"

#include <fmt/format.h>

#include <utility>

#include "app/provenance.h"
#include "measurement/outcome_file.h"
#include "pressure_advance/report/analysis_json.h"

namespace trammel::app {
namespace {

constexpr std::string_view kQuantity = "pressure_advance";
constexpr double kMost_s = 10;  // as pa apply takes it

}  // namespace

ResultFile ResultOf(const pressure_advance::Analysis& analysis, std::string source) {
  return {{ProvenanceOf(measurement::Instrument::kPressureAdvance, {std::move(source)}),
           {{std::string(kQuantity), "s", analysis.pressure_advance}},
           analysis.notices},
          report::JsonOf(analysis)};
}

measurement::Subject SubjectIn(const std::filesystem::path& folder) {
  const auto kept = files::ReadOutcome(folder, measurement::Instrument::kPressureAdvance);
  return kept ? kept->subject : measurement::Subject{};
}

Result<ChosenValue> KeptPressureAdvance(const std::filesystem::path& path) {
  auto outcome = TRY(files::ReadOutcome(path, measurement::Instrument::kPressureAdvance));
  const measurement::Answer* const answer = outcome.Find(kQuantity);
  if (answer == nullptr || answer->unit != "s") {
    return Fail(fmt::format("{}: holds no {} in s", path.string(), kQuantity));
  }
  if (!answer->value.good()) {
    return Fail(fmt::format("{}: it gives no value, because the verdict is {}: {}", path.string(),
                            VerdictWords(answer->value.verdict()), answer->value.reason()),
                ErrorKind::kMeasurement);
  }
  const Quantity quantity = answer->value.quantity();
  const Interval& interval95 = quantity.interval95;
  if (quantity.value < 0 || interval95.lo < -kMost_s || interval95.hi > kMost_s) {
    return Fail(fmt::format(
        "{}: {} is {} s, 95 %: {} to {} s; it must lie within 0 ... {} s, and its interval within "
        "+-{} s",
        path.string(), kQuantity, quantity.value, interval95.lo, interval95.hi, kMost_s, kMost_s));
  }
  return ChosenValue{quantity.value, quantity, std::move(outcome)};
}

}  // namespace trammel::app
