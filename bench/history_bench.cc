// How long the newest of 2,000 kept results take to be read, and all of them from the folders.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <filesystem>

#include "measurement/history.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;

/// A folder with the results of 100 filaments.
const fs::path& Recordings() {
  static const fs::path folder = [] {
    constexpr int kResults = 2'000;
    fs::path made = fs::temp_directory_path() / "trammel-history-bench";
    fs::remove_all(made);
    for (int n = 0; n < kResults; ++n) {
      measurement::Outcome outcome;
      outcome.provenance = {measurement::Instrument::kPressureAdvance,
                            "trammel 0.1.0",
                            fmt::format("2026-01-01T00:{:02}:{:02}Z", n / 60 % 60, n % 60),
                            {"recordings/r"}};
      outcome.answers = {
          {"pressure_advance", "s", Measured::Good({0.036, 0.0006, {0.0348, 0.0372}})}};
      outcome.subject = {"printer.local", "0.40", fmt::format("filament {}", n % 100)};
      const fs::path recording = made / fmt::format("r{}", n);
      fs::create_directories(recording);
      (void)KeepOutcome(recording, outcome);
    }
    return made;
  }();
  return folder;
}

void ListNewest20(benchmark::State& state) {
  (void)ReadHistory(Recordings(), {});
  for (auto _ : state) benchmark::DoNotOptimize(ReadHistory(Recordings(), {}));
}
BENCHMARK(ListNewest20)->Unit(benchmark::kMillisecond);

void BuildAnew(benchmark::State& state) {
  for (auto _ : state) {
    fs::remove(Recordings() / kHistoryFile);
    benchmark::DoNotOptimize(ReadHistory(Recordings(), {}));
  }
}
BENCHMARK(BuildAnew)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trammel::files
