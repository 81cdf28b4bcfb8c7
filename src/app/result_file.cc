#include "app/result_file.h"

#include "files/new_file.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"

namespace trammel::app {

OutputFile OutputOf(const std::filesystem::path& path, const ResultFile& result) {
  return {path, files::ToJson(result.outcome, result.details)};
}

Result<void> ListInHistory(const std::filesystem::path& folder,
                           const measurement::Outcome& outcome) {
  auto whole = std::filesystem::absolute(folder).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();  // "folder/" and "."
  const std::filesystem::path history = whole.parent_path() / files::kHistoryFile;
  const auto listed = files::HistoryHolds(history, outcome);
  if (!listed) return tl::unexpected(listed.error());
  return *listed ? Result<void>() : files::AppendLine(history, files::HistoryLine(outcome, folder));
}

Result<void> KeepInRecording(const std::filesystem::path& folder, const ResultFile& result) {
  if (auto kept = files::KeepOutcome(folder, result.outcome, result.details); !kept) return kept;
  return ListInHistory(folder, result.outcome);
}

}  // namespace trammel::app
