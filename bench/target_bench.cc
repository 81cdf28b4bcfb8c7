// Finds, reads and measures 40 targets in a picture of 2592 x 1944 px: at most 15 ms on one core.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "part_alignment/targets/ring_finder.h"
#include "support/target_picture.h"

namespace {

using namespace trammel;

constexpr int kWidth = 2592;
constexpr int kHeight = 1944;
constexpr int kTargets = 40;

/// 40 targets, each drawn in the middle of a square of `side` px, in noise of 2 grey levels. With
/// clutter a third of the picture is covered by things that are no targets.
Page Picture(int side, bool clutter,
             const std::function<test::DrawnTarget(std::size_t, Random&)>& drawn) {
  Random random(6);
  test::GreyImage image{kWidth, kHeight, {}};
  image.values.assign(static_cast<std::size_t>(kWidth) * kHeight, 200);
  for (int i = 0; i < kTargets; ++i) {
    const test::DrawnTarget target = drawn(static_cast<std::size_t>(i), random);
    const test::GreyImage patch = test::Draw(side, side, {target}, {.blur_px = 0.6});
    const int left = 200 + (i % 8) * 310 - side / 2;
    const int top = 200 + (i / 8) * 380 - side / 2;
    for (int y = 0; y < side; ++y) {
      std::copy_n(patch.values.begin() + y * side, side,
                  image.values.begin() + (top + y) * kWidth + left);
    }
  }
  Page page = test::Expose(image, 2, random);
  for (int band = 0; clutter && band < 5; ++band) {
    Page strip = test::Clutter(kWidth, 120, random);
    for (int y = 0; y < strip.height; ++y) {
      std::copy_n(strip.row(y), kWidth, page.row(std::min(kHeight - 1, 330 + 380 * band + y)));
    }
  }
  return page;
}

/// Ring codes of a radius, tilted by up to half a radian.
Page Rings(double radius, bool clutter) {
  const part_alignment::CodeBook book = part_alignment::MakeCodeBook(14).value();
  const int side = static_cast<int>(8 * radius) + 20;
  return Picture(side, clutter, [&](std::size_t i, Random& random) {
    test::DrawnTarget target = test::AffineTarget(
        0.5 * side + random.Uniform(-5, 5), 0.5 * side + random.Uniform(-5, 5), radius,
        random.Uniform(0, 0.5), random.Uniform(0, 6.3), random.Uniform(0, 6.3));
    target.bits = 14;
    target.word = book.words[i];
    return target;
  });
}

void BM_FindTargets(benchmark::State& state) {
  const Page page = Rings(static_cast<double>(state.range(0)), state.range(1) != 0);
  const part_alignment::CodeBook book = part_alignment::MakeCodeBook(14).value();
  part_alignment::FinderWorkspace workspace;
  std::size_t found = 0;
  for (auto _ : state) {
    auto result = part_alignment::FindTargets(page.view(), book, {}, workspace);
    found = result->targets.size();
    benchmark::DoNotOptimize(result);
  }
  state.SetLabel(std::to_string(found) + " targets" + (state.range(1) != 0 ? ", clutter" : ""));
}
BENCHMARK(BM_FindTargets)->ArgsProduct({{6, 12, 25}, {0, 1}})->Unit(benchmark::kMillisecond);

}  // namespace
