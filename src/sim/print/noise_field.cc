#include "sim/print/noise_field.h"

#include <cmath>
#include <utility>

#include "base/check.h"

namespace trammel::sim {

std::vector<float> GaussianKernel(double sigma) {
  if (sigma <= 0) return {1.0F};
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> taps;
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) {
    taps.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    sum += taps.back();
  }
  std::vector<float> kernel;
  for (const double tap : taps) kernel.push_back(static_cast<float>(tap / sum));
  return kernel;
}

Tile SmoothNoise(int size, double sigma, Random& random) {
  TRAMMEL_CHECK(
      size >= 8 && size <= 4096 && (size & (size - 1)) == 0 && sigma >= 0 && 8 * sigma <= size,
      "size = {}, sigma = {}", size, sigma);
  const auto count = static_cast<std::size_t>(size);
  Tile tile{size, std::vector<float>(count * count)};
  for (float& value : tile.value) value = static_cast<float>(random.Normal());
  if (sigma <= 0) return tile;

  const std::vector<float> kernel = GaussianKernel(sigma);
  const int radius = static_cast<int>(kernel.size() / 2);
  double power = 0;
  for (const float tap : kernel) power += static_cast<double>(tap) * static_cast<double>(tap);
  const auto gain = static_cast<float>(1 / std::sqrt(power));
  // Each pass smooths along columns (whole rows are added, which is fast) and transposes.
  Tile next{size, std::vector<float>(count * count)};
  std::vector<float> sum(count);
  for (int pass = 0; pass < 2; ++pass) {
    for (int y = 0; y < size; ++y) {
      sum.assign(count, 0.0F);
      for (int i = -radius; i <= radius; ++i) {
        const float tap = gain * kernel[static_cast<std::size_t>(i + radius)];
        const float* row =
            tile.value.data() + static_cast<std::size_t>((y + i) & (size - 1)) * count;
        for (std::size_t x = 0; x < count; ++x) sum[x] += tap * row[x];
      }
      for (std::size_t x = 0; x < count; ++x) {
        next.value[x * count + static_cast<std::size_t>(y)] = sum[x];
      }
    }
    std::swap(tile.value, next.value);
  }
  return tile;
}

}  // namespace trammel::sim
