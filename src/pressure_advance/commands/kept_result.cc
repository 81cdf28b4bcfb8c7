#include "pressure_advance/commands/kept_result.h"

#include <fmt/format.h>

#include <utility>

#include "app/provenance.h"
#include "measurement/outcome_file.h"
#include "pressure_advance/report/analysis_json.h"

namespace trammel::app {
namespace {

constexpr std::string_view kQuantity = "pressure_advance";

}  // namespace

ResultFile ResultOf(const pressure_advance::Analysis& analysis, std::string source) {
  return {{ProvenanceOf(measurement::Instrument::kPressureAdvance, {std::move(source)}),
           {{std::string(kQuantity), "s", analysis.pressure_advance}},
           analysis.notices},
          report::JsonOf(analysis)};
}

Result<Quantity> KeptPressureAdvance(const std::filesystem::path& path) {
  const auto outcome = files::ReadOutcome(path, measurement::Instrument::kPressureAdvance);
  if (!outcome) return tl::unexpected(outcome.error());
  const measurement::Answer* const answer = outcome->Find(kQuantity);
  if (answer == nullptr || answer->unit != "s") {
    return Fail(fmt::format("{}: holds no {} in s", path.string(), kQuantity));
  }
  if (answer->value.good()) return answer->value.quantity();
  return Fail(fmt::format("{}: it gives no value, because the verdict is {}: {}", path.string(),
                          VerdictWords(answer->value.verdict()), answer->value.reason()),
              ErrorKind::kMeasurement);
}

}  // namespace trammel::app
