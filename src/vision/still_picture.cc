#include "vision/still_picture.h"

#include <cstddef>
#include <cstdlib>

#include "base/check.h"

namespace trammel::vision {
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
  TRAMMEL_CHECK(frames_ < kMostFrames, "{} frames in one still picture", frames_ + 1);
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
