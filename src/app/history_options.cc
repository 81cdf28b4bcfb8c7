#include "app/history_options.h"

#include <CLI/CLI.hpp>
#include <vector>

namespace trammel::app {

void AddSubjectOptions(CLI::App& command, HistoryOptions& options) {
  const auto instruments = measurement::InstrumentNames();
  command.add_option("--instrument", options.instrument, "only its results; left out: of all")
      ->check(CLI::IsMember(std::vector<std::string>{instruments.begin(), instruments.end()}));
  command.add_option("--filament", options.subject.filament, "only of this filament");
  command.add_option("--nozzle", options.subject.nozzle,
                     "only of the nozzle of this diameter in mm: 0.40");
  command.add_option("--printer", options.subject.printer, "only of the printer of this address");
}

void AddHistoryOptions(CLI::App& command, HistoryOptions& options) {
  command.add_option("--in", options.path, "history.jsonl, or the folder of the recordings")
      ->capture_default_str();
  AddSubjectOptions(command, options);
}

files::HistoryQuery QueryOf(const HistoryOptions& options, std::size_t last) {
  files::HistoryQuery query{last, {}, options.subject};
  query.instrument = measurement::InstrumentNamed(options.instrument);
  return query;
}

}  // namespace trammel::app
