#include "part_alignment/targets/quieten.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "part_alignment/targets/four.h"

namespace trammel::part_alignment {

namespace {

[[gnu::always_inline]] inline void BlendAll(const std::uint8_t* before, const std::uint8_t* middle,
                                            const std::uint8_t* after, int count,
                                            std::uint8_t* blended) {
  for (int i = 0; i < count; ++i) {
    const auto sides = static_cast<std::uint8_t>((before[i] + after[i] + 1) >> 1);
    blended[i] = static_cast<std::uint8_t>((sides + middle[i] + 1) >> 1);
  }
}

#ifdef __x86_64__
[[gnu::target("avx2")]] void BlendByAvx2(const std::uint8_t* before, const std::uint8_t* middle,
                                         const std::uint8_t* after, int count,
                                         std::uint8_t* blended) {
  BlendAll(before, middle, after, count, blended);
}
#endif

}  // namespace

void Blend(const std::uint8_t* before, const std::uint8_t* middle, const std::uint8_t* after,
           int count, std::uint8_t* blended) {
#ifdef __x86_64__
  if (TakesAvx2()) return BlendByAvx2(before, middle, after, count, blended);
#endif
  BlendAll(before, middle, after, count, blended);
}

double PixelNoise(const PageView& picture) {
  std::array<int, 256> histogram{};
  int count = 0;
  const int step = std::max(1, picture.height / 16);
  for (int y = step / 2; y < picture.height; y += step) {
    const std::uint8_t* row = picture.row(y);
    for (int x = 1; x < picture.width - 1; x += 4) {
      ++histogram[static_cast<std::size_t>(std::abs(row[x + 1] - row[x - 1]))];
      ++count;
    }
  }
  std::size_t median = 0;
  int below = 0;
  while (2 * (below + histogram[median]) < count) below += histogram[median++];
  if (median == 0) return 0;
  // Where within its grey level's width the median lies.
  const double share = (0.5 * count - below) / histogram[median];
  constexpr double kSigmaOfMedian = 1.4826;
  constexpr double kPixelOfDifference = 0.7071;
  return kPixelOfDifference * kSigmaOfMedian * (static_cast<double>(median) - 0.5 + share);
}

void Quieten(const PageView& picture, std::vector<std::uint8_t>& samples) {
  const int width = picture.width;
  const auto size = static_cast<std::size_t>(width);
  samples.resize(size * static_cast<std::size_t>(picture.height));
  std::vector<std::uint8_t> lines(3 * size);
  std::array<std::uint8_t*, 3> line = {&lines[0], &lines[size], &lines[2 * size]};
  const auto along = [&](int y, std::uint8_t* to) {
    const std::uint8_t* row = picture.row(y);
    Blend(row, row + 1, row + 2, width - 2, to + 1);
    to[0] = row[0];
    to[width - 1] = row[width - 1];
  };
  along(0, line[0]);
  along(1, line[1]);
  std::copy_n(line[0], size, samples.begin());
  for (int y = 1; y < picture.height - 1; ++y) {
    along(y + 1, line[2]);
    Blend(line[0], line[1], line[2], width, &samples[static_cast<std::size_t>(y) * size]);
    std::rotate(line.begin(), line.begin() + 1, line.end());
  }
  std::copy_n(line[1], size, samples.end() - static_cast<std::ptrdiff_t>(size));
}

}  // namespace trammel::part_alignment
