// Time of a scanned A4 page after decoding: at most 0.4 s at 600 dpi and 1.6 s at 1200 dpi on two
// processors.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <vector>

#include "tool_offset/offset/analyse.h"
#include "tool_offset/reading/sheet_scene_test_support.h"

namespace {

using trammel::PageView;
using trammel::Random;
using trammel::tool_offset::AnalyseSheet;
using trammel::tool_offset::PlanSheet;
using trammel::tool_offset::Scan;
using trammel::tool_offset::ScannedScene;
using trammel::tool_offset::SheetPlan;
using trammel::tool_offset::SheetScene;
using trammel::tool_offset::SheetSettings;

/// Five tools' sheet, a little turned, in the middle of paper of the size of A4, lying.
struct Page {
  SheetPlan plan;
  int width = 0;
  int height = 0;
  int channels = 1;
  std::vector<std::uint8_t> pixels;

  Page(double dpi, int page_channels) : channels(page_channels) {
    SheetSettings settings;
    settings.tools = {0, 1, 2, 3, 4};
    plan = PlanSheet(settings);
    SheetScene scene;
    scene.paper.dpi_x = scene.paper.dpi_y = dpi;
    scene.paper.channels = channels;
    scene.angle_rad = 0.02;
    scene.margin_mm = 2;
    Random random(1);
    const ScannedScene scan = Scan(plan, scene, random);
    width = std::max(scan.page.width, static_cast<int>(297 * dpi / 25.4));
    height = std::max(scan.page.height, static_cast<int>(210 * dpi / 25.4));
    const auto row = static_cast<std::size_t>(width * channels);
    pixels.assign(row * static_cast<std::size_t>(height), 235);
    const int left = (width - scan.page.width) / 2;
    const int top = (height - scan.page.height) / 2;
    for (int y = 0; y < scan.page.height; ++y) {
      std::copy_n(
          scan.view().row(y), scan.page.width * channels,
          pixels.begin() + static_cast<std::ptrdiff_t>(row * static_cast<std::size_t>(top + y) +
                                                       static_cast<std::size_t>(left * channels)));
    }
  }
  [[nodiscard]] PageView view() const {
    return {pixels.data(), width, height, channels, std::ptrdiff_t{width} * channels};
  }
};

void BM_AnalyseSheet(benchmark::State& state) {
  const Page page(static_cast<double>(state.range(0)), static_cast<int>(state.range(1)));
  for (auto _ : state) {
    auto result = AnalyseSheet(page.view(), page.plan);
    if (!result) state.SkipWithError(result.error().message.c_str());
    benchmark::DoNotOptimize(result);
  }
  state.SetLabel(std::to_string(page.width) + " x " + std::to_string(page.height) + " px");
}
BENCHMARK(BM_AnalyseSheet)
    ->ArgsProduct({{600, 1200}, {1, 3}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

}  // namespace
