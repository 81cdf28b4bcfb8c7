// Analyses a recording while the printer is brought back, and says the answer when it is there.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <thread>

#include "base/result.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/procedure/read_ahead.h"

namespace trammel::app {

class EarlyAnswer {
 public:
  /// @param say  the answer on standard output, as text.
  explicit EarlyAnswer(bool say) : say_(say) {}
  EarlyAnswer(const EarlyAnswer&) = delete;
  EarlyAnswer& operator=(const EarlyAnswer&) = delete;
  ~EarlyAnswer() = default;  ///< waits for what was begun: the thread is the last member

  /// Where the scan has its lines read.
  [[nodiscard]] procedure::ReadAhead& read_ahead() { return read_ahead_; }

  /// Begins the analysis of a whole recording on a thread of its own; returns at once.
  void Begin(std::filesystem::path folder);

  /// Its end. REQUIRES Begin(). Errors: those of AnalyseRecording().
  [[nodiscard]] Result<AnalysisRun> Wait();

 private:
  bool say_;
  procedure::ReadAhead read_ahead_;
  std::optional<Result<AnalysisRun>> run_;
  std::optional<std::string> bug_;
  std::jthread thread_;
};

}  // namespace trammel::app
