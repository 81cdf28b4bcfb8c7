#include "vision/frame_change.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>

#include "base/check.h"

namespace trammel::vision {
namespace {

constexpr int kBlock_px = 4;
constexpr double kStrongest = 0.05;  // share of the blocks

/// after = gain · before + offset, by least squares over all blocks.
struct Exposure {
  double gain = 1;
  double offset = 0;
};

Exposure FitExposure(const std::vector<float>& before, const std::vector<float>& after) {
  const auto count = static_cast<double>(before.size());
  double sum_b = 0;
  double sum_a = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    sum_b += before[i];
    sum_a += after[i];
  }
  const double mean_b = sum_b / count;
  const double mean_a = sum_a / count;
  double covariance = 0;
  double variance = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    covariance += (before[i] - mean_b) * (after[i] - mean_a);
    variance += (before[i] - mean_b) * (before[i] - mean_b);
  }
  Exposure exposure;
  // A laser line that moved away has no gain; a common gain of two pictures of one scene is near 1.
  constexpr double kMaxGain = 2;
  if (variance > 0) exposure.gain = std::clamp(covariance / variance, 1 / kMaxGain, kMaxGain);
  exposure.offset = mean_a - exposure.gain * mean_b;
  return exposure;
}

}  // namespace

void SketchFrame(const BgrView& frame, FrameSketch& sketch) {
  TRAMMEL_CHECK(frame.width >= kBlock_px && frame.height >= kBlock_px, "{}x{} px", frame.width,
                frame.height);
  sketch.width = frame.width / kBlock_px;
  sketch.height = frame.height / kBlock_px;
  sketch.brightness.resize(static_cast<std::size_t>(sketch.width) *
                           static_cast<std::size_t>(sketch.height));
  std::vector<std::uint32_t> sums(static_cast<std::size_t>(sketch.width));
  const float scale = 1.0F / (3.0F * static_cast<float>(kBlock_px * kBlock_px));
  for (int y = 0; y < sketch.height; ++y) {
    std::fill(sums.begin(), sums.end(), 0U);
    for (int row = 0; row < kBlock_px; ++row) {
      const std::uint8_t* pixel = frame.row(y * kBlock_px + row);
      for (std::uint32_t& sum : sums) {
        for (int i = 0; i < 3 * kBlock_px; ++i) sum += *pixel++;
      }
    }
    float* out = sketch.brightness.data() +
                 static_cast<std::size_t>(y) * static_cast<std::size_t>(sketch.width);
    for (const std::uint32_t sum : sums) *out++ = static_cast<float>(sum) * scale;
  }
}

double FrameChange(const FrameSketch& before, const FrameSketch& after,
                   std::vector<float>& scratch) {
  TRAMMEL_CHECK(
      before.width == after.width && before.height == after.height && !before.brightness.empty(),
      "{}x{} against {}x{} blocks", before.width, before.height, after.width, after.height);
  const Exposure exposure = FitExposure(before.brightness, after.brightness);
  const std::size_t count = before.brightness.size();
  scratch.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double expected = exposure.gain * before.brightness[i] + exposure.offset;
    const double difference = after.brightness[i] - expected;
    scratch[i] = static_cast<float>(difference * difference);
  }
  const auto strongest = std::clamp<std::size_t>(
      static_cast<std::size_t>(std::ceil(kStrongest * static_cast<double>(count))), 1, count);
  const auto end = scratch.begin() + static_cast<std::ptrdiff_t>(strongest);
  std::nth_element(scratch.begin(), end - 1, scratch.end(), std::greater<>());
  double sum = 0;
  for (auto at = scratch.begin(); at != end; ++at) sum += *at;
  return std::sqrt(sum / static_cast<double>(strongest));
}

namespace {

bool Moved(const Frame& before, const Frame& after) {
  constexpr int kClear = 24;  // levels
  constexpr std::size_t kOneOf = 1000;
  const std::size_t values = before.bgr.size();
  std::size_t moved = 0;
  for (std::size_t i = 0; i < values; ++i) {
    moved += static_cast<std::size_t>(std::abs(before.bgr[i] - after.bgr[i]) > kClear);
  }
  return moved * kOneOf > values;
}

}  // namespace

StillPicture::Added StillPicture::Add(const Frame& frame) {
  TRAMMEL_CHECK(frames_ < kMaxFrames, "{} frames in one still picture", frames_ + 1);
  if (frames_ == 0) {
    first_ = frame;
    sum_.assign(frame.bgr.size(), 0);
  } else if (frame.width != first_.width || frame.height != first_.height) {
    return Added::kOtherSize;
  } else if (Moved(first_, frame)) {
    return Added::kMoved;
  }
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    sum_[i] = static_cast<std::uint16_t>(sum_[i] + frame.bgr[i]);
  }
  ++frames_;
  return Added::kStill;
}

Frame StillPicture::Mean() const {
  TRAMMEL_CHECK(frames_ > 0, "the mean of no frames");
  Frame mean = first_;
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    mean.bgr[i] = static_cast<std::uint8_t>((sum_[i] + frames_ / 2) / frames_);
  }
  return mean;
}

}  // namespace trammel::vision
