// What it costs to find, read and measure 40 targets in a picture of 2592 x 1944 px: rings at most
// 15 ms on one processor, square markers what they need.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "part_alignment/targets/ring_finder.h"
#include "part_alignment/targets/square_finder.h"
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

/// Square markers, likewise.
Page Squares(double side, bool clutter, const part_alignment::SquareBook& book) {
  const int patch = static_cast<int>(1.9 * side) + 20;
  return Picture(patch, clutter, [&](std::size_t i, Random& random) {
    test::DrawnTarget target = test::SquareTarget(
        0.5 * patch + random.Uniform(-5, 5), 0.5 * patch + random.Uniform(-5, 5), side,
        random.Uniform(0, 0.5), random.Uniform(0, 6.3), random.Uniform(0, 6.3));
    target.word = part_alignment::SquareWord(book.ids[i]);
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

void BM_FindSquares(benchmark::State& state) {
  const part_alignment::SquareBook book =
      part_alignment::MakeSquareBook(part_alignment::DefaultSquareIds(kTargets).value()).value();
  const Page page = Squares(static_cast<double>(state.range(0)), state.range(1) != 0, book);
  part_alignment::SquareWorkspace workspace;
  std::size_t found = 0;
  for (auto _ : state) {
    auto result = part_alignment::FindSquares(page.view(), book, {}, workspace);
    found = result->targets.size();
    benchmark::DoNotOptimize(result);
  }
  state.SetLabel(std::to_string(found) + " markers" + (state.range(1) != 0 ? ", clutter" : ""));
}
BENCHMARK(BM_FindSquares)->ArgsProduct({{30, 60, 120}, {0, 1}})->Unit(benchmark::kMillisecond);

}  // namespace
