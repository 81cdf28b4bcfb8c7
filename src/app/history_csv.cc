#include "app/history_csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace trammel::app {
namespace {

std::string Cell(std::string_view text) {
  const bool formula =
      !text.empty() && std::string_view("=+-@\t\r").find(text[0]) != std::string_view::npos;
  std::string cell = formula ? "\"'" : "\"";
  for (const char c : text) cell += c == '"' ? std::string("\"\"") : std::string(1, c);
  return cell + "\"";
}

}  // namespace

std::string HistoryRows(const files::HistoryEntry& entry) {
  const auto& [provenance, answers, notices, subject] = entry.outcome;
  const auto applied = std::find_if(
      entry.applied.rbegin(), entry.applied.rend(),
      [](const auto& each) { return each.step == files::Application::Step::kApplied; });
  const files::Application last = applied == entry.applied.rend() ? files::Application{} : *applied;
  std::string rows;
  for (const measurement::Answer& answer : answers) {
    std::string numbers = ",,,";
    if (answer.value.good()) {
      const Quantity& quantity = answer.value.quantity();
      numbers = fmt::format("{},{},{},{}", quantity.value, quantity.standard_uncertainty,
                            quantity.interval95.lo, quantity.interval95.hi);
    }
    rows += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
                        Cell(provenance.utc), ToString(provenance.instrument),
                        Cell(subject.printer), Cell(subject.nozzle), Cell(subject.filament),
                        Cell(answer.name), Cell(answer.unit), ToString(answer.value.verdict()),
                        numbers, Cell(answer.value.reason()), Cell(last.utc), Cell(last.machine),
                        Cell(provenance.program), Cell(entry.folder), Cell(subject.toolhead),
                        Cell(subject.spool), Cell(subject.nozzle_c), Cell(subject.bed_c));
  }
  return rows;
}

}  // namespace trammel::app
