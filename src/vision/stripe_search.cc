#include "vision/stripe_search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>

namespace trammel::vision {
namespace {

/// Robust sigma of the response over the whole image: the stripe is a minority of the pixels.
float ResponseNoise(const ImageSize& size, LaserLineWorkspace& ws) {
  // A sample of some ten thousand pixels is plenty; the step is odd against the image's width.
  const std::size_t step = std::max<std::size_t>(1, size.area() / 20011);
  ws.sample.clear();
  for (std::size_t i = 0; i < size.area(); i += step) {
    ws.sample.push_back(ws.response[i]);
  }
  return kMadToSigma * MedianMagnitude(ws.sample);
}

/// out[x] = sum over k of kernel[k] · in[x + k].
void Convolve(const float* in, std::span<const float> kernel, std::span<float> out) {
  constexpr std::size_t kBlock = 8;  // columns at a time, in vector registers
  std::size_t x = 0;
  for (; x + kBlock <= out.size(); x += kBlock) {
    std::array<float, kBlock> sums{};
    for (std::size_t k = 0; k < kernel.size(); ++k) {
      for (std::size_t i = 0; i < kBlock; ++i) sums[i] += kernel[k] * in[x + k + i];
    }
    std::copy(sums.begin(), sums.end(), out.begin() + static_cast<std::ptrdiff_t>(x));
  }
  for (; x < out.size(); ++x) {
    out[x] = 0;
    for (std::size_t k = 0; k < kernel.size(); ++k) out[x] += kernel[k] * in[x + k];
  }
}

/// out[x] -= the mean of `box` values to either side, as many as there are.
/// @param sums  of all values before each, and of all.
void SubtractBoxMean(std::span<const double> sums, int box, std::span<float> out) {
  const int width = static_cast<int>(out.size());
  const auto subtract = [&](int x, int lo, int end) {
    out[static_cast<std::size_t>(x)] -= static_cast<float>(
        (sums[static_cast<std::size_t>(end)] - sums[static_cast<std::size_t>(lo)]) / (end - lo));
  };
  const int whole_begin = std::min(box, width);
  const int whole_end = std::max(whole_begin, width - box);
  for (int x = 0; x < whole_begin; ++x) subtract(x, 0, std::min(width, x + box + 1));
  const double count = 2 * box + 1;
  for (int x = whole_begin; x < whole_end; ++x) {  // apart, for vector registers
    const auto i = static_cast<std::size_t>(x);
    const auto reach = static_cast<std::size_t>(box);
    out[i] -= static_cast<float>((sums[i + reach + 1] - sums[i - reach]) / count);
  }
  for (int x = whole_end; x < width; ++x) subtract(x, std::max(0, x - box), width);
}

/// One step of the search: best[x] = min over x' of previous[x'] + price of going x' -> x, the
/// price being slope·|x - x'| but never more than jump. Felzenszwalb's two passes, linear in width.
void Relax(std::span<const float> previous, float slope, float jump, std::span<float> best,
           std::span<int> from) {
  const int width = static_cast<int>(previous.size());
  int cheapest = 0;
  for (int x = 0; x < width; ++x) {
    best[static_cast<std::size_t>(x)] = previous[static_cast<std::size_t>(x)];
    from[static_cast<std::size_t>(x)] = x;
    if (previous[static_cast<std::size_t>(x)] < previous[static_cast<std::size_t>(cheapest)]) {
      cheapest = x;
    }
  }
  for (int x = 1; x < width; ++x) {
    const auto i = static_cast<std::size_t>(x);
    if (best[i - 1] + slope < best[i]) {
      best[i] = best[i - 1] + slope;
      from[i] = from[i - 1];
    }
  }
  const float jumped = previous[static_cast<std::size_t>(cheapest)] + jump;
  for (int x = width - 1; x >= 0; --x) {
    const auto i = static_cast<std::size_t>(x);
    if (x + 1 < width && best[i + 1] + slope < best[i]) {
      best[i] = best[i + 1] + slope;
      from[i] = from[i + 1];
    }
    if (jumped < best[i]) {
      best[i] = jumped;
      from[i] = cheapest;
    }
  }
}

}  // namespace

float MedianMagnitude(std::span<float> sample) {
  if (sample.empty()) return 0;
  // Magnitudes are ordered as their bits are: a count by exponent and three bits of the mantissa
  // leaves a few to be ordered.
  constexpr unsigned kShift = 20;
  std::array<std::uint32_t, (std::size_t{1} << (31 - kShift))> counts{};
  const auto bin = [](float v) { return std::bit_cast<std::uint32_t>(v) >> kShift; };
  for (float& v : sample) {
    v = std::abs(v);
    ++counts[bin(v)];
  }
  std::size_t below = sample.size() / 2;  // in rank, among those not yet left out
  std::uint32_t middle = 0;
  while (below >= counts[middle]) below -= counts[middle++];
  std::size_t kept = 0;
  for (const float v : sample) {
    if (bin(v) == middle) sample[kept++] = v;
  }
  const auto median = sample.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(sample.begin(), median, sample.begin() + static_cast<std::ptrdiff_t>(kept));
  return *median;
}

void ExtractSignal(const BgrView& frame, const StripeModel& model, LaserLineWorkspace& workspace) {
  const ImageSize size{frame.width, frame.height};
  workspace.signal.resize(size.area());
  for (int y = 0; y < size.height; ++y) {
    const std::uint8_t* in = frame.row(y);
    float* out = workspace.signal.data() + size.at(y);
    for (int x = 0; x < size.width; ++x, in += 3) {
      out[x] = model.weight_b * in[0] + model.weight_g * in[1] + model.weight_r * in[2];
    }
  }
}

float MatchedFilter(const ImageSize& size, float sigma, LaserLineWorkspace& ws) {
  const int reach = std::max(1, static_cast<int>(std::ceil(3 * sigma)));
  ws.kernel.resize(static_cast<std::size_t>(2 * reach + 1));
  float total = 0;
  for (int i = -reach; i <= reach; ++i) {
    const float t = static_cast<float>(i) / sigma;
    total += ws.kernel[static_cast<std::size_t>(i + reach)] = std::exp(-0.5F * t * t);
  }
  for (float& k : ws.kernel) {
    k /= total;
  }
  const int box = std::max(2, static_cast<int>(std::ceil(kBackgroundReach * sigma)));
  ws.response.resize(size.area());
  ws.row_a.resize(static_cast<std::size_t>(size.width + 2 * reach));
  ws.sums.resize(static_cast<std::size_t>(size.width) + 1);
  for (int y = 0; y < size.height; ++y) {
    const float* in = ws.signal.data() + size.at(y);
    float* out = ws.response.data() + size.at(y);
    float* padded = ws.row_a.data();
    std::fill_n(padded, reach, in[0]);
    std::copy_n(in, size.width, padded + reach);
    std::fill_n(padded + reach + size.width, reach, in[size.width - 1]);
    ws.sums[0] = 0;
    for (int x = 0; x < size.width; ++x) {
      ws.sums[static_cast<std::size_t>(x) + 1] = ws.sums[static_cast<std::size_t>(x)] + in[x];
    }
    Convolve(padded, ws.kernel, {out, static_cast<std::size_t>(size.width)});
    SubtractBoxMean(ws.sums, box, {out, static_cast<std::size_t>(size.width)});
  }
  return ResponseNoise(size, ws);
}

void ShortestPath(const ImageSize& size, float sigma, float noise, const LaserLineOptions& options,
                  LaserLineWorkspace& ws) {
  const float slope = static_cast<float>(options.slope_cost);
  const float jump = static_cast<float>(options.jump_cost) * sigma;
  const auto width = static_cast<std::size_t>(size.width);
  ws.cost.resize(size.area());
  ws.from.resize(size.area());
  for (int y = 0; y < size.height; ++y) {
    const float* response = ws.response.data() + size.at(y);
    const std::span cost(ws.cost.data() + size.at(y), width);
    if (y == 0) {
      std::fill(cost.begin(), cost.end(), 0.0F);
    } else {
      Relax({ws.cost.data() + size.at(y - 1), width}, slope, jump, cost,
            {ws.from.data() + size.at(y), width});
    }
    const float floor = std::max(static_cast<float>(options.detection) * noise, 1e-6F);
    const float best = std::max(*std::max_element(response, response + width), floor);
    for (std::size_t x = 0; x < width; ++x) {
      cost[x] += 1 - std::clamp(response[x] / best, 0.0F, 1.0F);
    }
  }
  ws.path.resize(static_cast<std::size_t>(size.height));
  const float* last = ws.cost.data() + size.at(size.height - 1);
  int x = static_cast<int>(std::min_element(last, last + width) - last);
  for (int y = size.height - 1; y >= 0; --y) {
    ws.path[static_cast<std::size_t>(y)] = x;
    if (y > 0) {
      x = ws.from[size.at(y) + static_cast<std::size_t>(x)];
    }
  }
}

bool Connected(const std::vector<int>& path, int a, int b, float sigma) {
  for (int y = a; y < b; ++y) {
    const int step = path[static_cast<std::size_t>(y) + 1] - path[static_cast<std::size_t>(y)];
    if (static_cast<float>(std::abs(step)) > std::max(1.0F, sigma)) {
      return false;
    }
  }
  return true;
}

}  // namespace trammel::vision
