#include "sim/print/texture.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

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

namespace {

constexpr int kSize = 512;

Tile Constant(float value) { return {8, std::vector<float>(64, value)}; }

// Returns values with mean 1 and a standard deviation of about `contrast`, never negative.
Tile Lognormal(const Tile& normal, double contrast) {
  Tile tile = normal;
  for (float& value : tile.value) {
    value = static_cast<float>(
        std::exp(contrast * static_cast<double>(value) - contrast * contrast / 2));
  }
  return tile;
}

// Draws contours of one smooth field where a second one is high: the short curly lines of shining
// crests on powder-coated plates.
Tile CurlyGlints(const Tile& field, const Tile& where) {
  Tile glints = field;
  for (std::size_t i = 0; i < glints.value.size(); ++i) {
    const double ridge = std::exp(-0.5 * std::pow(static_cast<double>(field.value[i]) / 0.16, 2));
    const double kept = std::clamp((static_cast<double>(where.value[i]) - 0.35) / 0.5, 0.0, 1.0);
    glints.value[i] = static_cast<float>(ridge * kept);
  }
  return glints;
}

Texture MakeTextured(Random& random) {
  Texture texture;
  const Tile bump = SmoothNoise(kSize, 3.2, random);
  const Tile glints = CurlyGlints(bump, SmoothNoise(kSize, 4.0, random));
  const Tile grain = SmoothNoise(kSize, 1.2, random);
  const double bump_sigma_mm = random.Uniform(0.012, 0.020);
  texture.bump_mm = bump;
  texture.laser = bump;
  texture.ambient = bump;
  for (std::size_t i = 0; i < bump.value.size(); ++i) {
    const auto crest = static_cast<double>(bump.value[i]);
    const auto glint = static_cast<double>(glints.value[i]);
    const auto rough = static_cast<double>(grain.value[i]);
    texture.bump_mm.value[i] = static_cast<float>(bump_sigma_mm * crest);
    texture.laser.value[i] =
        static_cast<float>(std::max(0.12, 0.80 + 0.22 * crest + 0.12 * rough + 1.5 * glint));
    texture.ambient.value[i] =
        static_cast<float>(std::max(0.05, 0.5 + 0.3 * crest + 0.25 * rough) + 6 * glint);
  }
  return texture;
}

}  // namespace

Texture MakePlateTexture(Plate plate, Random& random) {
  if (plate == Plate::kTextured) return MakeTextured(random);
  const bool pei = plate == Plate::kPei;
  Texture texture;
  texture.bump_mm = SmoothNoise(kSize, pei ? 8.0 : 2.0, random);
  for (float& value : texture.bump_mm.value) value *= pei ? 0.001F : 0.002F;
  const Tile grain = SmoothNoise(kSize, pei ? 6.0 : 1.0, random);
  texture.laser = Lognormal(grain, pei ? 0.05 : 0.08);
  texture.ambient = Lognormal(grain, pei ? 0.03 : 0.06);
  return texture;
}

Texture MakeFilamentTexture(Random& random) {
  Texture texture;
  texture.bump_mm = SmoothNoise(kSize, 4.0, random);
  for (float& value : texture.bump_mm.value) value *= 0.002F;
  texture.laser = Lognormal(SmoothNoise(kSize, 3.0, random), 0.15);
  texture.ambient = Lognormal(SmoothNoise(kSize, 2.0, random), 0.10);
  return texture;
}

Texture MakePlainTexture() {
  Texture texture;
  texture.bump_mm = Constant(0.0F);
  texture.laser = Constant(1.0F);
  texture.ambient = Constant(1.0F);
  return texture;
}

}  // namespace trammel::sim
