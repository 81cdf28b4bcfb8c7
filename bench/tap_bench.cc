// What one tap costs: 1000 samples with mains hum are to take well below a millisecond.
#include <benchmark/benchmark.h>

#include <vector>

#include "tap/analyse/analyse.h"
#include "tap/contact/press_test_support.h"

namespace {

using trammel::tap::Method;
using trammel::tap::TapAnalyser;
using trammel::tap::test::MakePressTap;
using trammel::tap::test::PressTap;

// Taps of about so many samples; the rate makes the number.
std::vector<PressTap> Taps(double samples, double hum_g = 0) {
  constexpr double kSeconds = 1.3648;  // per tap of MakePressTap with a pull-back of 0.1 mm
  std::vector<PressTap> taps;
  for (std::uint64_t seed = 1; seed <= 64; ++seed) {
    taps.push_back(MakePressTap({.rate_hz = samples / kSeconds, .hum_g = hum_g}, seed));
  }
  return taps;
}

void BM_Tap(benchmark::State& state) {
  const auto method = static_cast<Method>(state.range(0));
  const std::vector<PressTap> taps = Taps(static_cast<double>(state.range(1)));
  TapAnalyser analyser({.method = method});
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(analyser.Analyse(taps[i].View()));
    i = (i + 1) % taps.size();
  }
  state.SetLabel(std::string(trammel::tap::ToString(method)) + ", " +
                 std::to_string(taps[0].time_s.size()) + " samples");
}
BENCHMARK(BM_Tap)
    ->ArgsProduct({{static_cast<int>(Method::kContact), static_cast<int>(Method::kTwoLine)},
                   {400, 1000}})
    ->Unit(benchmark::kMicrosecond);

// Hum of half, of three and of ten times the noise.
void BM_TapWithHum(benchmark::State& state) {
  const std::vector<PressTap> taps = Taps(400, static_cast<double>(state.range(0)));
  TapAnalyser analyser({.method = Method::kContact});
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(analyser.Analyse(taps[i].View()));
    i = (i + 1) % taps.size();
  }
}
BENCHMARK(BM_TapWithHum)->Arg(1)->Arg(6)->Arg(20)->Unit(benchmark::kMicrosecond);

}  // namespace
