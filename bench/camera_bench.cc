// Speed at which the virtual camera draws and encodes its view.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "sim/camera/camera_view.h"
#include "sim/camera/jpeg.h"

namespace trammel::sim {
namespace {

constexpr double kFocusMm = 17.86;

// Lines of 30 mm every 4 mm, as the paper's pattern.
std::shared_ptr<const Bed> Lines() {
  auto bed = std::make_shared<Bed>(Bed{250, 250, {}});
  for (int line = 0; line < 10; ++line) {
    Strand strand;
    for (int i = 0; i <= 600; ++i) {
      strand.samples.push_back({100 + 0.05 * i, 100.0 + 4 * line, 0.11, 0.5, 0.25});
    }
    bed->strands.push_back(strand);
  }
  return bed;
}

struct Motion {
  double speed_mm_s = 0;
  bool laser_on = false;
  bool lights_on = false;
};

// Frames at 30 a second, to and fro over 24 mm of a line, with what is drawn anew on the way.
void Draw(benchmark::State& state, const Motion& motion) {
  const HeadOptics optics = DrawHeadOptics({Plate::kTextured, Filament::kWhite, false}, Random(1));
  const auto width = static_cast<int>(state.range(0));
  const auto height = static_cast<int>(state.range(1));
  CameraView view(optics, {{}, width, height}, Random(2));
  CameraMoment moment;
  moment.bed = Lines();
  moment.machine = {75, 57.8, kFocusMm, motion.speed_mm_s, motion.laser_on, motion.lights_on};
  double direction = 1;
  Frame frame;
  std::vector<std::uint8_t> jpeg;
  for (auto _ : state) {
    moment.time_s += 1.0 / 30;
    moment.machine.x_mm += direction * motion.speed_mm_s / 30;
    if (moment.machine.x_mm > 99) direction = -1;
    if (moment.machine.x_mm < 75) direction = 1;
    moment.travel_x_mm = direction * motion.speed_mm_s * 0.017;
    view.Render(moment, frame);
    EncodeJpeg(frame.view(), 90, jpeg);
    benchmark::DoNotOptimize(jpeg.data());
  }
  state.counters["frames/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

BENCHMARK_CAPTURE(Draw, sweep_in_the_dark, Motion{400.0 / 60, true, false})
    ->Args({1280, 720})
    ->Args({640, 360})
    ->Args({160, 120})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Draw, sweep_with_lights_on, Motion{400.0 / 60, true, true})
    ->Args({1280, 720})
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Draw, travel_with_lights_on, Motion{100, false, true})
    ->Args({1280, 720})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trammel::sim
