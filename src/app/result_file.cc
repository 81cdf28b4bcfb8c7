#include "app/result_file.h"

#include "files/new_file.h"
#include "measurement/outcome_file.h"

namespace trammel::app {

OutputFile OutputOf(const std::filesystem::path& path, const ResultFile& result) {
  return {path, files::ToJson(result.outcome, result.details)};
}

Result<void> KeepInRecording(const std::filesystem::path& folder, const ResultFile& result) {
  if (auto kept = files::KeepOutcome(folder, result.outcome, result.details); !kept) return kept;
  auto whole = std::filesystem::absolute(folder).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();  // "folder/" and "."
  return files::AppendLine(whole.parent_path() / files::kHistoryFile,
                           files::HistoryLine(result.outcome, folder));
}

}  // namespace trammel::app
