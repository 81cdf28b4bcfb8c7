#include "pressure_advance/commands/early_answer.h"

#include <utility>

#include "base/bug_note.h"
#include "base/check.h"
#include "pressure_advance/commands/analysis_output.h"

namespace trammel::app {

void EarlyAnswer::Begin(std::filesystem::path folder) {
  thread_ = std::jthread([this, folder = std::move(folder)] {
    bug_ = NoteBug([&] {
      run_ = AnalyseRecording(folder, pressure_advance::Method::kResponse, &read_ahead_);
      if (*run_ && say_) SayAnswer((*run_)->analysis);
    });
  });
}

Result<AnalysisRun> EarlyAnswer::Wait() {
  TRAMMEL_CHECK(thread_.joinable(), "no analysis was begun: {}", say_);
  thread_.join();
  if (bug_) return Fail("a bug in trammel ended the analysis: " + *bug_);
  return std::move(*run_);
}

}  // namespace trammel::app
