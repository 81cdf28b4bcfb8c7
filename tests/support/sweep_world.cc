#include "support/sweep_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <string>

#include "support/test_pictures.h"

namespace trammel::test {

namespace {

void Put32(std::string& out, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) {
    out.push_back(static_cast<char>(value >> (8 * i)));
  }
}

std::string Chunk(const std::string& name, const std::string& content) {
  std::string out = name;
  Put32(out, static_cast<std::uint32_t>(content.size()));
  out += content;
  if (content.size() % 2 != 0) {
    out.push_back('\0');
  }
  return out;
}

std::string Words(std::initializer_list<std::uint32_t> words) {
  std::string out;
  for (const std::uint32_t word : words) {
    Put32(out, word);
  }
  return out;
}

}  // namespace

Frame DrawLaserFrame(const LaserWorld& world, double area_mm2, Random& random) {
  const double height_mm = std::min(std::sqrt(area_mm2 * 0.75), world.highest_mm);
  const double half_width_mm = height_mm > 0 ? area_mm2 * 0.75 / height_mm : 0;
  Frame frame(world.width, world.height);
  for (int y = 0; y < world.height; ++y) {
    const double off = (y - world.bead_row_px) / world.px_per_mm;
    const double rise =
        height_mm > 0 ? height_mm * std::max(0.0, 1 - off * off / (half_width_mm * half_width_mm))
                      : 0;
    const double centre =
        world.plate_column_px + world.tilt * (y - world.bead_row_px) - rise * world.px_per_mm;
    const double amplitude = rise > 0 ? world.bead_amplitude : world.plate_amplitude;
    for (int x = 0; x < world.width; ++x) {
      const double t = (x - centre) / world.stripe_sigma_px;
      const double light =
          amplitude * std::exp(-0.5 * t * t) * std::max(0.0, 1 + world.speckle * random.Normal());
      for (int c = 0; c < 3; ++c) {
        const double level = world.ambient + (c == 2 ? light : 0.6 * std::max(0.0, light - 170)) +
                             world.noise * random.Normal();
        frame.row(y)[3 * x + c] =
            static_cast<std::uint8_t>(std::clamp(std::round(level), 0.0, 255.0));
      }
    }
  }
  return frame;
}

void WriteAvi(const std::filesystem::path& path, const std::vector<Frame>& frames,
              std::uint32_t announced_frames) {
  const std::uint32_t width = frames.empty() ? 64 : static_cast<std::uint32_t>(frames[0].width);
  const std::uint32_t height = frames.empty() ? 64 : static_cast<std::uint32_t>(frames[0].height);
  const std::uint32_t mjpg = 0x47504A4D;
  const std::string main_header =
      Words({33333, 0, 0, 0x10, announced_frames, 0, 1, 0, width, height, 0, 0, 0, 0});
  const std::string stream_header =
      "vids" + Words({mjpg, 0, 0, 0, 1, 30, 0, announced_frames, 0, 0xFFFFFFFF, 0, 0, 0});
  const std::string format =
      Words({40, width, height, (24U << 16) | 1U, mjpg, width * height * 3, 0, 0, 0, 0});
  const std::string stream = "strl" + Chunk("strh", stream_header) + Chunk("strf", format);
  std::string movie = "movi";
  for (const Frame& frame : frames) {
    movie += Chunk("00dc", JpegOf(frame, 95));
  }
  const std::string list = "hdrl" + Chunk("avih", main_header) + Chunk("LIST", stream);
  const std::string file = Chunk("RIFF", "AVI " + Chunk("LIST", list) + Chunk("LIST", movie));
  std::ofstream(path, std::ios::binary) << file;
}

namespace {

constexpr std::size_t kSpots = 24;  // places in the picture whose brightness is looked at
constexpr std::size_t kWaves = 6;   // of the texture under one place

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
