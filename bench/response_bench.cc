// Time of a laser scan's answer once its lines are read: the response fit with and without the
// storage model, learnt from whole profiles; and of reading a photo of another tool's pattern.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/random.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/photo/chevron_reader.h"
#include "pressure_advance/photo/photo_labels.h"
#include "pressure_advance/photo/photo_lines.h"
#include "pressure_advance/photo/photo_search.h"
#include "pressure_advance/response/response.h"
#include "sim/slicer_patterns/drawn_pattern_photo.h"

namespace trammel::pressure_advance {
namespace {

struct Lines {
  LineMotion motion;
  std::vector<LineProfile> profiles;
};

// Lines of an extruder whose flow follows what it is fed with a lag of 35 ms, ten a pattern.
Lines Print(PatternPreset preset) {
  constexpr double kLag_s = 0.035, kStep_s = 1e-4, kNoise = 0.03, kFrames_per_s = 30;
  PatternConfig pattern;
  settings::ScanSettings scan;
  ApplyPreset(preset, pattern, scan);
  Lines lines;
  lines.motion.segments = pattern.segments;
  lines.motion.length_mm = pattern.line_length_mm;
  lines.motion.acceleration_mm_s2 = pattern.acceleration_mm_s2;
  Random random(1);
  const double rise_mm = pattern.segments[0].fraction * pattern.line_length_mm;
  const double fall_mm = rise_mm + pattern.segments[1].fraction * pattern.line_length_mm;
  const double slow = pattern.segments[0].speed_mm_s, fast = pattern.segments[1].speed_mm_s;
  for (int i = 0; i < 10; ++i) {
    LineProfile profile;
    profile.pressure_advance_s = 0.06 * i / 9;
    double s = 0, speed = slow, flow = slow, laid = 0, next_mm = scan.skip_mm;
    const double reading_mm = scan.scan_speed_mm_s / kFrames_per_s;
    while (s < pattern.line_length_mm - scan.skip_mm) {
      const double brakes_mm = (speed * speed - slow * slow) / (2 * pattern.acceleration_mm_s2);
      const double wanted = s > rise_mm && s < fall_mm - brakes_mm ? fast : slow;
      const double step = pattern.acceleration_mm_s2 * kStep_s;
      const double change = std::clamp(wanted - speed, -step, step);
      const double fed = speed + profile.pressure_advance_s * change / kStep_s;
      flow += (fed - flow) * kStep_s / kLag_s;
      laid += std::max(0.0, flow) * kStep_s;
      speed += change;
      s += speed * kStep_s;
      if (s < next_mm) continue;
      ProfileSample sample;
      sample.position = s - reading_mm / 2;
      sample.area = {std::max(0.0, laid / reading_mm) + kNoise * random.Normal(), kNoise};
      if (next_mm > scan.skip_mm) profile.samples.push_back(sample);
      laid = 0;
      next_mm += reading_mm;
    }
    lines.profiles.push_back(profile);
  }
  return lines;
}

void Response(benchmark::State& state, PatternPreset preset, bool learns_law) {
  const Lines lines = Print(preset);
  ResponseOptions options;
  if (!learns_law) options.law.reset();
  for (auto _ : state) {
    benchmark::DoNotOptimize(FitResponse(lines.profiles, lines.motion, options));
  }
}
BENCHMARK_CAPTURE(Response, quick, PatternPreset::kQuick, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Response, paper, PatternPreset::kPaper, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Response, quick_crossings, PatternPreset::kQuick, false)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Response, paper_crossings, PatternPreset::kPaper, false)
    ->Unit(benchmark::kMillisecond);

// Searches chevrons, then lines, and reads corners or widths and the printed numbers, as pa photo
// does without any option; decoding is not included. Seed 1: a virtual photo of 12 megapixels.
void OtherToolsPhoto(benchmark::State& state, sim::PatternKind kind) {
  const auto world = sim::DrawPatternPhoto(kind, 1, {});
  for (auto _ : state) {
    PhotoSearch photo(world->photo);
    const ChevronView view = ViewChevrons(photo);
    if (view.problem.empty()) {
      benchmark::DoNotOptimize(ReadChevrons(view, 1));
      benchmark::DoNotOptimize(ReadLabels(photo.picture().view(), view));
      continue;
    }
    PhotoOptions options;
    options.pressure_advance_s = world->values;
    options.framed = false;
    PhotoLines lines = FindPhotoLines(photo, options);
    if (!lines.problem.empty()) continue;
    benchmark::DoNotOptimize(ReadLabels(photo.picture().view(), lines));
    benchmark::DoNotOptimize(MeasurePhotoLines(std::move(lines), options));
  }
}
BENCHMARK_CAPTURE(OtherToolsPhoto, chevrons, sim::PatternKind::kOrcaPattern)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(OtherToolsPhoto, lines, sim::PatternKind::kOrcaLine)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trammel::pressure_advance
