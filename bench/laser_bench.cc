// Frames per second of the laser eye's steps, each alone, on 1280x720 MJPEG.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

#include "machine/video_file.h"
#include "pressure_advance/deviation.h"
#include "support/laser_world.h"
#include "vision/laser_line.h"

namespace trammel {
namespace {

constexpr int kFrames = 30;
const PixelRect kPaperCrop{837, 341, 45, 60};

std::vector<Frame> DrawFrames() {
  Random random(1);
  test::LaserWorld world;
  world.width = 1280;
  world.height = 720;
  world.plate_column_px = 872;
  world.bead_row_px = 371;
  std::vector<Frame> frames;
  for (int i = 0; i < kFrames; ++i) {
    frames.push_back(test::DrawLaserFrame(world, 0.11, random));
  }
  return frames;
}

const std::vector<Frame>& Frames() {
  static const std::vector<Frame> frames = DrawFrames();
  return frames;
}

void SetFrames(benchmark::State& state, std::int64_t frames) {
  state.counters["frames_per_s"] =
      benchmark::Counter(static_cast<double>(frames), benchmark::Counter::kIsRate);
}

void Decode(benchmark::State& state) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "bench.avi";
  test::WriteAvi(path, Frames(), kFrames);
  std::int64_t frames = 0;
  for (auto _ : state) {
    auto video = machine::VideoFile::Open(path);
    for (auto next = video->Next(); next && *next != nullptr; next = video->Next()) {
      benchmark::DoNotOptimize((*next)->bgr.data());
      ++frames;
    }
  }
  SetFrames(state, frames);
}

/// The paper's mask, grey, blur and weighted mean.
void Filter(benchmark::State& state, bool crop) {
  pressure_advance::DeviationFrame result;
  std::int64_t frames = 0;
  for (auto _ : state) {
    const BgrView whole = Frames()[static_cast<std::size_t>(frames % kFrames)].view();
    pressure_advance::FilterFrame(crop ? Crop(whole, kPaperCrop) : whole, {}, result);
    benchmark::DoNotOptimize(result.centre_px.data());
    ++frames;
  }
  SetFrames(state, frames);
}

void FindLine(benchmark::State& state, bool crop) {
  vision::LaserLineWorkspace workspace;
  vision::LaserLine line;
  std::int64_t frames = 0;
  for (auto _ : state) {
    const BgrView whole = Frames()[static_cast<std::size_t>(frames % kFrames)].view();
    vision::FindLaserLine(crop ? Crop(whole, kPaperCrop) : whole, {}, {}, workspace, line);
    benchmark::DoNotOptimize(line.centre_px.data());
    ++frames;
  }
  SetFrames(state, frames);
}

BENCHMARK(Decode)->Name("decode_1280x720_mjpeg")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Filter, whole_frame, false)
    ->Name("filter_1280x720")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Filter, crop, true)->Name("filter_45x60_crop")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(FindLine, whole_frame, false)
    ->Name("find_line_1280x720")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(FindLine, crop, true)
    ->Name("find_line_45x60_crop")
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trammel
