#include "tap/samples/residuals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "base/random.h"

namespace trammel::tap {
namespace {

// Steps of a clock that scatters, with samples left out here and there.
std::vector<double> UnevenTimes(std::uint64_t seed) {
  Random random(seed);
  std::vector<double> time_s = {0.1};
  for (int i = 1; i < 300; ++i) {
    const double steps = random.Uniform() < 0.05 ? 7 : 1;
    time_s.push_back(time_s.back() + steps * random.Uniform(0.9, 1.1) / 320);
  }
  return time_s;
}

TEST(Residuals, HumOfUnevenSamplesIsThatOfPlainProjection) {
  constexpr double kFrequency_hz = 50;
  constexpr double kNoise_g = 2;
  for (const std::uint64_t seed : {1000, 1001, 1002}) {
    const std::vector<double> time_s = UnevenTimes(seed);
    std::vector<double> r;
    double cosine = 0;
    double sine = 0;
    for (const double t : time_s) {
      const double phase = 2 * std::numbers::pi * kFrequency_hz * (t - time_s[0]);
      r.push_back(6 * std::sin(phase + 1));
      cosine += 2 * r.back() * std::cos(phase) / static_cast<double>(time_s.size());
      sine += 2 * r.back() * std::sin(phase) / static_cast<double>(time_s.size());
    }
    const MainsHum hum = FindMainsHum(time_s, r, kNoise_g);
    EXPECT_EQ(hum.frequency_hz, kFrequency_hz);
    EXPECT_TRUE(hum.present[0]);
    constexpr double kSeries = 1e-6;  // 300 turns, each true to 10^-9
    EXPECT_NEAR(hum.amplitude_g, std::hypot(cosine, sine), kSeries * hum.amplitude_g);

    std::vector<double> force = r;
    std::vector<double> rest = r;
    RemoveMainsHum({kFrequency_hz, hum.amplitude_g, {true, false, false}}, time_s, rest, force);
    for (std::size_t i = 0; i < r.size(); ++i) {
      const double phase = 2 * std::numbers::pi * kFrequency_hz * (time_s[i] - time_s[0]);
      const double wave = cosine * std::cos(phase) + sine * std::sin(phase);
      EXPECT_NEAR(rest[i], r[i] - wave, kSeries * hum.amplitude_g);
      EXPECT_EQ(force[i], rest[i]);
    }
  }
}

}  // namespace
}  // namespace trammel::tap
