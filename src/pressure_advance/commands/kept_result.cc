#include "pressure_advance/commands/kept_result.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "app/provenance.h"
#include "measurement/outcome_file.h"
#include "pressure_advance/report/analysis_json.h"

namespace trammel::app {
namespace {

constexpr std::string_view kQuantity = "pressure_advance";

}  // namespace

measurement::Outcome OutcomeOf(const pressure_advance::Analysis& analysis,
                               std::vector<std::string> sources) {
  return {ProvenanceOf(measurement::Instrument::kPressureAdvance, std::move(sources)),
          {{std::string(kQuantity), "s", analysis.pressure_advance}},
          analysis.notices};
}

Result<void> KeepResult(const pressure_advance::Analysis& analysis,
                        const std::filesystem::path& folder) {
  const measurement::Outcome outcome = OutcomeOf(analysis, {folder.string()});
  const auto details = nlohmann::ordered_json::parse(report::ToJson(analysis));
  if (auto kept = files::KeepOutcome(folder, outcome, details); !kept) return kept;
  auto whole = std::filesystem::absolute(folder).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();  // "folder/" and "."
  const auto recordings = whole.parent_path();
  return files::AppendLine(recordings / files::kHistoryFile, files::HistoryLine(outcome, folder));
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
