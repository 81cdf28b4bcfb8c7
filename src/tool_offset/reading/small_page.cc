#include "tool_offset/reading/small_page.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/parallel.h"

namespace trammel::tool_offset {
namespace {

constexpr int kLongSide = 1200;
/// Small pixels per side of a block whose median is the paper: 6 mm at 100 dpi. Wider than a
/// finger and its gap several times over; ink covers less than half of it.
constexpr int kBlock = 24;

/// Block means; of large blocks only every second row and pixel or fewer, which is plenty.
void ShrinkRows(const PageView& page, int first, int last, SmallPage& small) {
  const int step = std::max(1, small.factor / 4);
  const std::size_t row_values =
      static_cast<std::size_t>(small.width) * static_cast<std::size_t>(small.channels);
  std::vector<std::uint32_t> sum(row_values);
  const int samples_across = (small.factor + step - 1) / step;
  const auto samples = static_cast<std::uint32_t>(samples_across * samples_across);
  for (int y = first; y < last; ++y) {
    std::fill(sum.begin(), sum.end(), 0);
    for (int dy = 0; dy < small.factor; dy += step) {
      const std::uint8_t* pixel = page.row(y * small.factor + dy);
      std::uint32_t* out = sum.data();
      for (int x = 0; x < small.width; ++x, out += small.channels) {
        for (int dx = 0; dx < small.factor; dx += step) {
          for (int c = 0; c < small.channels; ++c) out[c] += pixel[dx * small.channels + c];
        }
        pixel += static_cast<std::ptrdiff_t>(small.factor) * small.channels;
      }
    }
    std::uint8_t* out = small.pixels.data() + static_cast<std::size_t>(y) * row_values;
    for (std::size_t i = 0; i < row_values; ++i) {
      out[i] = static_cast<std::uint8_t>((sum[i] + samples / 2) / samples);
    }
  }
}

/// Medians of blocks, one value per block and channel.
std::vector<float> BlockMedians(const SmallPage& small, int columns, int rows) {
  std::vector<float> medians(static_cast<std::size_t>(columns * rows * small.channels));
  ParallelFor(rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      for (int c = 0; c < small.channels; ++c) {
        std::array<int, 256> histogram{};
        int count = 0;
        for (int y = row * kBlock; y < std::min((row + 1) * kBlock, small.height); ++y) {
          for (int x = column * kBlock; x < std::min((column + 1) * kBlock, small.width); ++x) {
            ++histogram[small.pixels[small.at(x, y) * static_cast<std::size_t>(small.channels) +
                                     static_cast<std::size_t>(c)]];
            ++count;
          }
        }
        int level = 0;
        for (int below = histogram[0]; 2 * below < count; below += histogram[++level]) {
        }
        medians[static_cast<std::size_t>((row * columns + column) * small.channels + c)] =
            static_cast<float>(level);
      }
    }
  });
  return medians;
}

/// Between which two blocks' centres a small pixel lies, and how far along.
struct Between {
  int lower = 0;
  int upper = 0;
  float part = 0;
};

Between BetweenBlocks(int position, int blocks) {
  const float at = (static_cast<float>(position) + 0.5F) / kBlock - 0.5F;
  const int lower = std::clamp(static_cast<int>(std::floor(at)), 0, blocks - 1);
  const int upper = std::min(lower + 1, blocks - 1);
  return {lower, upper, std::clamp(at - static_cast<float>(lower), 0.0F, 1.0F)};
}

void CompareWithSurroundings(SmallPage& small) {
  const int columns = (small.width + kBlock - 1) / kBlock;
  const int rows = (small.height + kBlock - 1) / kBlock;
  const std::vector<float> medians = BlockMedians(small, columns, rows);
  const auto median = [&](int row, int column, int c) {
    return medians[static_cast<std::size_t>((row * columns + column) * small.channels + c)];
  };
  ParallelFor(small.height, [&](int y) {
    const Between v = BetweenBlocks(y, rows);
    for (int x = 0; x < small.width; ++x) {
      const Between u = BetweenBlocks(x, columns);
      float squares = 0;
      for (int c = 0; c < small.channels; ++c) {
        const float upper = median(v.lower, u.lower, c) +
                            u.part * (median(v.lower, u.upper, c) - median(v.lower, u.lower, c));
        const float lower = median(v.upper, u.lower, c) +
                            u.part * (median(v.upper, u.upper, c) - median(v.upper, u.lower, c));
        const float level = upper + v.part * (lower - upper);
        const std::size_t i =
            small.at(x, y) * static_cast<std::size_t>(small.channels) + static_cast<std::size_t>(c);
        small.background[i] = static_cast<std::uint8_t>(level + 0.5F);
        const float difference = static_cast<float>(small.pixels[i]) - level;
        squares += difference * difference;
      }
      small.strength[small.at(x, y)] = static_cast<std::uint8_t>(
          std::min(255.0F, std::sqrt(squares / static_cast<float>(small.channels)) + 0.5F));
    }
  });
}

}  // namespace

SmallPage Shrink(const PageView& page) {
  SmallPage small;
  small.factor = std::max(1, (std::max(page.width, page.height) + kLongSide / 2) / kLongSide);
  small.width = page.width / small.factor;
  small.height = page.height / small.factor;
  small.channels = page.channels;
  const std::size_t count =
      static_cast<std::size_t>(small.width) * static_cast<std::size_t>(small.height);
  small.pixels.resize(count * static_cast<std::size_t>(small.channels));
  small.background.resize(small.pixels.size());
  small.strength.resize(count);
  constexpr int kRowsAtOnce = 32;
  ParallelFor((small.height + kRowsAtOnce - 1) / kRowsAtOnce, [&](int part) {
    ShrinkRows(page, part * kRowsAtOnce, std::min((part + 1) * kRowsAtOnce, small.height), small);
  });
  CompareWithSurroundings(small);
  return small;
}

}  // namespace trammel::tool_offset
