// Time of an alignment (4 targets, 8 pictures, 7 unknowns), and of a survey.
#include <benchmark/benchmark.h>

#include "part_alignment/pose/alignment_test_support.h"
#include "part_alignment/pose/pose_fit.h"
#include "part_alignment/pose/pose_uncertainty.h"
#include "part_alignment/survey/survey_world_test_support.h"

namespace {

using namespace trammel;
using namespace trammel::part_alignment;

constexpr double kSigma_px = 0.05;

struct Bench {
  Measurement measurement;
  AlignmentState state;
  std::vector<Eigen::Vector2d> pixels;
};

Bench PaperBench() {
  test_support::AlignmentWorld world = test_support::BenchWorld();
  Random random(1);
  TakePictures(world, kSigma_px, random);
  Bench bench;
  bench.measurement = MeasurementOf(world, kSigma_px);
  bench.state.machine_from_part = world.machine_from_part;
  bench.state.clamping.angle_rad = world.clamping.angle_rad;
  for (const test_support::WorldView& view : world.views) {
    bench.pixels.push_back(view.observations[0].pixel);
  }
  return bench;
}

/// Prepared near the answer, as Monte Carlo and repeated measurements use it: at most 100 us.
void OneSolve(benchmark::State& state) {
  const Bench bench = PaperBench();
  auto solver = PoseSolver::Make(bench.measurement, {}, bench.state.machine_from_part, {});
  for (auto _ : state) {
    benchmark::DoNotOptimize(solver->SolvePixels(bench.pixels));
  }
}
BENCHMARK(OneSolve)->Unit(benchmark::kMicrosecond);

/// 10,000 measurements with all inputs drawn: at most 2 s.
void TenThousandMeasurements(benchmark::State& state) {
  const Bench bench = PaperBench();
  SolveOptions options;
  options.inputs = {0.003, 0.02, 0, 0.015, 0, 0, 0};
  for (auto _ : state) {
    Random random(1);
    benchmark::DoNotOptimize(
        SimulateMeasurements(bench.measurement, options, bench.state, 10000, random));
  }
}
BENCHMARK(TenThousandMeasurements)->Unit(benchmark::kMillisecond);

/// Solves from nothing, with verdict.
void SolveFromNothing(benchmark::State& state) {
  const Bench bench = PaperBench();
  SolveOptions options;
  for (auto _ : state) {
    benchmark::DoNotOptimize(Solve(bench.measurement, options));
  }
}
BENCHMARK(SolveFromNothing)->Unit(benchmark::kMillisecond);

/// 64 codes in 100 pictures of 12 MP, from nothing: at most 10 s.
void SurveyFromNothing(benchmark::State& state) {
  const test::SurveyWorld world = test::MakeSurveyWorld({}, 1);
  const SurveyInput input = test::Photograph(world, 1);
  for (auto _ : state) benchmark::DoNotOptimize(SolveSurvey(input, {}));
}
BENCHMARK(SurveyFromNothing)->Unit(benchmark::kMillisecond);

}  // namespace
