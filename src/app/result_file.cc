#include "app/result_file.h"

#include "measurement/outcome_file.h"

namespace trammel::app {

OutputFile OutputOf(const std::filesystem::path& path, const ResultFile& result) {
  return {path, files::ToJson(result.outcome, result.details)};
}

Result<void> KeepInRecording(const std::filesystem::path& folder, const ResultFile& result) {
  return files::KeepOutcome(folder, result.outcome, result.details);
}

}  // namespace trammel::app
