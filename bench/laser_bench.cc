// Frames per second of decoding and of a whole analysis, on 1280x720 MJPEG: dark frames of some 20
// kB and bright ones of some 200.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "machine/video/video_cutter.h"
#include "machine/video/video_file.h"
#include "pressure_advance/commands/laser_recording.h"
#include "support/sweep_world.h"

namespace trammel {
namespace {

constexpr int kFrames = 30;
const PixelRect kPaperCrop{837, 341, 45, 60};

/// A laser line over a dark chamber, or over one in the light whose noise the camera keeps.
enum class Light { kDark, kBright };

std::vector<Frame> DrawFrames(Light light) {
  Random random(1);
  test::LaserWorld world;
  world.width = 1280;
  world.height = 720;
  world.plate_column_px = 872;
  world.bead_row_px = 371;
  world.noise = light == Light::kDark ? 0.2 : 3;
  if (light == Light::kBright) world.ambient = 60;
  std::vector<Frame> frames;
  for (int i = 0; i < kFrames; ++i) {
    frames.push_back(test::DrawLaserFrame(world, 0.11, random));
  }
  return frames;
}

const std::vector<Frame>& Frames(Light light = Light::kDark) {
  static const std::vector<Frame> dark = DrawFrames(Light::kDark);
  static const std::vector<Frame> bright = DrawFrames(Light::kBright);
  return light == Light::kDark ? dark : bright;
}

void SetFrames(benchmark::State& state, std::int64_t frames) {
  state.counters["frames_per_s"] =
      benchmark::Counter(static_cast<double>(frames), benchmark::Counter::kIsRate);
}

void SetBytes(benchmark::State& state, const std::filesystem::path& video) {
  state.counters["kB_per_frame"] =
      1e-3 * static_cast<double>(std::filesystem::file_size(video)) / kFrames;
}

enum class Read {
  kWhole,
  kCrop,     ///< from whole frames
  kCutCrop,  ///< from frames cut to it
};

void Decode(benchmark::State& state, Light light, Read read) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "bench.avi";
  std::vector<Frame> stored = Frames(light);
  if (read == Read::kCutCrop)
    for (int i = 0; i < kFrames; ++i) stored.push_back(Frames(light)[static_cast<std::size_t>(i)]);
  test::WriteAvi(path, stored, static_cast<std::uint32_t>(stored.size()));
  if (read == Read::kCutCrop) {  // but for the first of sixty, as recordings are
    auto cut = machine::CutVideo::Write(path, {kPaperCrop, stored.size(), 30}, {});
    if (!cut || !cut->TakePlace()) return state.SkipWithError("the video stays whole");
  }
  std::int64_t frames = 0;
  for (auto _ : state) {
    auto video = machine::VideoFile::Open(path);
    while (*video->Advance()) {
      const auto frame =
          video->Decode(read == Read::kWhole ? PixelRect{0, 0, 1280, 720} : kPaperCrop);
      benchmark::DoNotOptimize((*frame)->bgr.data());
      ++frames;
    }
  }
  SetFrames(state, frames);
  SetBytes(state, path);
}

/// A recording of ten lines, from its folder to heights and scores.
void Measure(benchmark::State& state, Light light) {
  constexpr int kLines = 10;
  constexpr int kSweepFrames = 99;
  std::vector<Frame> sweep;
  for (std::size_t i = 0; i < kSweepFrames; ++i) sweep.push_back(Frames(light)[i % kFrames]);
  const test::TemporaryFolder folder;
  nlohmann::json scan = {{"format", 1},
                         {"eye", "laser"},
                         {"scan_speed_mm_s", 10.0},
                         {"px_per_mm", 44.0},
                         {"crop_px",
                          {{"x", kPaperCrop.x},
                           {"y", kPaperCrop.y},
                           {"width", kPaperCrop.width},
                           {"height", kPaperCrop.height}}},
                         {"lines", nlohmann::json::array()}};
  for (int i = 0; i < kLines; ++i) {
    const std::string video = "line" + std::to_string(i) + ".avi";
    test::WriteAvi(folder.path() / video, sweep, kSweepFrames);
    scan["lines"].push_back({{"pressure_advance_s", 0.01 * i}, {"video", video}});
  }
  std::ofstream(folder.path() / "scan.json") << scan.dump();
  for (auto _ : state) {
    auto measured = app::MeasureRecording(folder.path());
    benchmark::DoNotOptimize(measured);
  }
  SetFrames(state, state.iterations() * kLines * kSweepFrames);
}

void Names(benchmark::internal::Benchmark* bench) { bench->Unit(benchmark::kMillisecond); }

BENCHMARK_CAPTURE(Decode, dark_whole, Light::kDark, Read::kWhole)->Apply(Names);
BENCHMARK_CAPTURE(Decode, bright_whole, Light::kBright, Read::kWhole)->Apply(Names);
BENCHMARK_CAPTURE(Decode, dark_crop, Light::kDark, Read::kCrop)->Apply(Names);
BENCHMARK_CAPTURE(Decode, bright_crop, Light::kBright, Read::kCrop)->Apply(Names);
BENCHMARK_CAPTURE(Decode, dark_cut, Light::kDark, Read::kCutCrop)->Apply(Names);
BENCHMARK_CAPTURE(Decode, bright_cut, Light::kBright, Read::kCutCrop)->Apply(Names);
BENCHMARK_CAPTURE(Measure, dark, Light::kDark)->Apply(Names)->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(Measure, bright, Light::kBright)->Apply(Names)->MeasureProcessCPUTime();

}  // namespace
}  // namespace trammel
