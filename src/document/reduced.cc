#include "document/reduced.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace trammel::report {
namespace {

/// Source pixels that one of `target` pixels covers.
std::pair<int, int> Covered(int i, int target, int source) {
  const auto first = static_cast<int>(std::int64_t{i} * source / target);
  const auto last = static_cast<int>((std::int64_t{i} + 1) * source / target);
  return {first, std::max(first + 1, last)};
}

}  // namespace

Frame Reduced(const BgrView& image, double most_width, double most_height) {
  Frame out(std::clamp(static_cast<int>(std::lround(most_width)), 1, image.width),
            std::clamp(static_cast<int>(std::lround(most_height)), 1, image.height));
  for (int y = 0; y < out.height; ++y) {
    const auto [y0, y1] = Covered(y, out.height, image.height);
    std::uint8_t* to = out.row(y);
    for (int x = 0; x < out.width; ++x, to += 3) {
      const auto [x0, x1] = Covered(x, out.width, image.width);
      std::uint64_t sum[3] = {0, 0, 0};
      for (int row = y0; row < y1; ++row) {
        const std::uint8_t* pixel = image.row(row) + std::ptrdiff_t{3} * x0;
        for (int column = x0; column < x1; ++column, pixel += 3) {
          for (int channel = 0; channel < 3; ++channel) sum[channel] += pixel[channel];
        }
      }
      const auto count = static_cast<std::uint64_t>(x1 - x0) * static_cast<std::uint64_t>(y1 - y0);
      for (int channel = 0; channel < 3; ++channel) {
        to[channel] = static_cast<std::uint8_t>((sum[channel] + count / 2) / count);
      }
    }
  }
  return out;
}

}  // namespace trammel::report
