// Which of the kept results a command is about.
#pragma once

#include <cstddef>
#include <string>

#include "measurement/history.h"
#include "measurement/outcome.h"

namespace CLI {
class App;
}

namespace trammel::app {

struct HistoryOptions {
  std::string path = "recordings";  ///< history.jsonl, or its folder
  std::string instrument = {};      ///< empty: any
  measurement::Subject subject = {};

  [[nodiscard]] bool chooses() const {
    return !instrument.empty() || subject != measurement::Subject{};
  }
};

/// Adds --in and the options that choose by instrument, filament, nozzle and printer.
void AddHistoryOptions(CLI::App& command, HistoryOptions& options);

/// The same of --instrument, --filament, --nozzle and --printer alone.
void AddSubjectOptions(CLI::App& command, HistoryOptions& options);

/// The newest of the results that are chosen, at most `last`.
[[nodiscard]] files::HistoryQuery QueryOf(const HistoryOptions& options, std::size_t last);

}  // namespace trammel::app
