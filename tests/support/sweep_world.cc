#include "support/sweep_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace trammel::test {
namespace {

constexpr std::size_t kSpots = 24;  // places in the picture whose brightness is looked at
constexpr std::size_t kWaves = 6;   // that make up the texture under one place

/// Brightness under each spot along the line: sums of waves with normal wave numbers.
struct Texture {
  std::array<std::array<double, kWaves>, kSpots> number{};
  std::array<std::array<double, kWaves>, kSpots> phase{};

  Texture(double grain_mm, Random& random) {
    for (std::size_t s = 0; s < kSpots; ++s) {
      for (std::size_t w = 0; w < kWaves; ++w) {
        number[s][w] = random.Normal() / grain_mm;
        phase[s][w] = random.Uniform(0, 2 * std::numbers::pi);
      }
    }
  }
  [[nodiscard]] double At(std::size_t spot, double x_mm) const {
    double sum = 0;
    for (std::size_t w = 0; w < kWaves; ++w) {
      sum += std::cos(number[spot][w] * x_mm + phase[spot][w]);
    }
    return sum / std::sqrt(static_cast<double>(kWaves));
  }
};

/// Distance gone `t` after the start of a sweep with equal ramps, by cases.
double Gone(const SweepWorld& world, double t) {
  const double length = std::abs(world.end_mm - world.start_mm);
  const double ramp = world.speed_mm_s / world.acceleration_mm_s2;
  const double total = length / world.speed_mm_s + ramp;
  if (t <= 0) return 0;
  if (t >= total) return length;
  if (t < ramp) return world.acceleration_mm_s2 * t * t / 2;
  if (t > total - ramp) {
    const double left = total - t;
    return length - world.acceleration_mm_s2 * left * left / 2;
  }
  return world.speed_mm_s * (t - ramp / 2);
}

double Position(const SweepWorld& world, double t) {
  return world.start_mm + (world.end_mm > world.start_mm ? 1 : -1) * Gone(world, t);
}

/// Runs the camera from `from_s` and keeps what it takes until `to_s`.
class Camera {
 public:
  Camera(const SweepWorld& world, double from_s, Random& random) : world_(world), random_(random) {
    step_s_ = world.period_s * (1 + world.period_error * random.Uniform(-1, 1));
    next_s_ = from_s + random.Uniform() * step_s_;
  }
  void SkipTo(double time_s) {
    while (next_s_ < time_s) Tick();
  }
  double Tick() {
    const double time_s = next_s_;
    next_s_ += step_s_;
    ++sequence_;
    return time_s + world_.capture_scatter_s * random_.Normal();
  }
  [[nodiscard]] double next_s() const { return next_s_; }
  [[nodiscard]] unsigned long sequence() const { return sequence_; }

 private:
  const SweepWorld& world_;
  Random& random_;
  double step_s_ = 0;
  double next_s_ = 0;
  unsigned long sequence_ = 0;
};

double Delay(const SweepWorld& world, double& blocked_until_s, double ready_s, Random& random) {
  switch (world.delivery) {
    case Delivery::kPrompt:
      return 3e-4 * random.Uniform();
    case Delivery::kUniform:
      return world.jitter_s * random.Uniform();
    case Delivery::kBursty:
      if (random.Uniform() < 0.05) {
        blocked_until_s = std::max(blocked_until_s, ready_s + world.jitter_s * random.Uniform());
      }
      return std::max(0.0, blocked_until_s - ready_s) + 1e-3 * random.Uniform();
  }
  return 0;
}

WorldSweep Watch(const SweepWorld& world, double start_s, Camera& camera, Random& random) {
  const Texture texture(world.grain_mm, random);
  const double length = std::abs(world.end_mm - world.start_mm);
  const double moving_s = length / world.speed_mm_s + world.speed_mm_s / world.acceleration_mm_s2;
  WorldSweep sweep;
  sweep.start_s = start_s;
  camera.SkipTo(start_s - world.still_s);
  std::array<double, kSpots> before{};
  double last_arrival_s = 0;
  double blocked_until_s = 0;
  while (camera.next_s() < start_s + moving_s + world.still_s) {
    SweepFrame frame;
    frame.sequence = camera.sequence();
    frame.true_time_s = camera.Tick();
    const double since = frame.true_time_s - start_s;
    frame.true_position_mm = Position(world, since);
    constexpr double kStep_s = 1e-5;
    frame.true_speed_mm_s =
        (Position(world, since + kStep_s) - Position(world, since - kStep_s)) / (2 * kStep_s);
    std::array<double, kSpots> spots{};
    double square = 0;
    for (std::size_t s = 0; s < kSpots; ++s) {
      constexpr int kMoments = 3;
      for (int m = 0; m < kMoments; ++m) {
        const double moment = since + world.exposure_s * (m - 1) / kMoments;
        spots[s] += texture.At(s, Position(world, moment)) / kMoments;
      }
      spots[s] += world.noise * random.Normal();
      square += (spots[s] - before[s]) * (spots[s] - before[s]);
    }
    before = spots;
    const double stamp_s = frame.true_time_s + world.latency_s;
    const double ready_s = stamp_s + world.transport_s;
    const double arrival_s = ready_s + Delay(world, blocked_until_s, ready_s, random);
    if (random.Uniform() < world.loss) continue;
    frame.change = sweep.frames.empty() ? 0 : std::sqrt(square / kSpots);
    frame.stamp_s = stamp_s + world.clock_s;
    frame.arrival_s = std::max(arrival_s, last_arrival_s + 1e-5);
    last_arrival_s = frame.arrival_s;
    sweep.frames.push_back(frame);
  }
  return sweep;
}

}  // namespace

WorldSweep RecordSweep(const SweepWorld& world, double start_s, Random& random) {
  Camera camera(world, start_s - 2 * world.still_s, random);
  return Watch(world, start_s, camera, random);
}

std::vector<WorldSweep> RecordSession(const SweepWorld& world, std::size_t sweeps, Random& random) {
  double start_s = 1000 + random.Uniform();
  Camera camera(world, start_s - 2 * world.still_s, random);
  std::vector<WorldSweep> session;
  for (std::size_t i = 0; i < sweeps; ++i) {
    session.push_back(Watch(world, start_s, camera, random));
    start_s = session.back().frames.back().true_time_s + world.still_s + 2 + random.Uniform();
  }
  return session;
}

}  // namespace trammel::test
