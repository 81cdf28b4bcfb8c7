// How long the newest of 10,000 kept results take to be read, with and without the index.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <filesystem>
#include <fstream>

#include "measurement/history_index.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;

constexpr int kResults = 10'000;

/// A folder with a history.jsonl of kResults results of 100 filaments.
const fs::path& Recordings() {
  static const fs::path folder = [] {
    fs::path made = fs::temp_directory_path() / "trammel-history-bench";
    fs::remove_all(made);
    fs::create_directories(made);
    std::ofstream file(made / kHistoryFile);
    for (int n = 0; n < kResults; ++n) {
      measurement::Outcome outcome;
      outcome.provenance = {
          measurement::Instrument::kPressureAdvance,
          "trammel 0.1.0",
          fmt::format("2026-01-01T{:02}:{:02}:{:02}Z", n / 3600, n / 60 % 60, n % 60),
          {"recordings/r"}};
      outcome.answers = {
          {"pressure_advance", "s", Measured::Good({0.036, 0.0006, {0.0348, 0.0372}})}};
      outcome.subject = {"printer.local", "0.40", fmt::format("filament {}", n % 100)};
      file << HistoryLine(outcome, fmt::format("recordings/r{}", n)) << '\n';
    }
    return made;
  }();
  return folder;
}

void ListNewest20(benchmark::State& state) {
  (void)ReadIndexed(Recordings(), {});  // builds the index
  for (auto _ : state) benchmark::DoNotOptimize(ReadIndexed(Recordings(), {}));
}
BENCHMARK(ListNewest20)->Unit(benchmark::kMillisecond);

void ListNewest20OfAFilamentAndNozzle(benchmark::State& state) {
  const HistoryQuery query{.subject = {.printer = {}, .nozzle = "0.40", .filament = "filament 7"}};
  (void)ReadIndexed(Recordings(), {});
  for (auto _ : state) benchmark::DoNotOptimize(ReadIndexed(Recordings(), query));
}
BENCHMARK(ListNewest20OfAFilamentAndNozzle)->Unit(benchmark::kMillisecond);

void ListNewest20WithoutTheIndex(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(ReadHistory(Recordings() / kHistoryFile, {}));
  }
}
BENCHMARK(ListNewest20WithoutTheIndex)->Unit(benchmark::kMillisecond);

void Rebuild(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(RebuildIndex(Recordings()));
}
BENCHMARK(Rebuild)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trammel::files
