#include "part_alignment/targets/picture_check.h"

#include <fmt/format.h>

#include <algorithm>

namespace trammel::part_alignment {

std::optional<std::string> PictureProblem(const PageView& picture) {
  constexpr int kLeastSide = 16;
  constexpr int kMostSide = 32767;
  if (picture.data == nullptr || picture.channels != 1) {
    return fmt::format("picture with {} channels: targets are looked for in grey, 1 channel",
                       picture.channels);
  }
  if (std::min(picture.width, picture.height) < kLeastSide ||
      std::max(picture.width, picture.height) > kMostSide) {
    return fmt::format("picture of {} x {} px: must have {} ... {} px a side", picture.width,
                       picture.height, kLeastSide, kMostSide);
  }
  return std::nullopt;
}

}  // namespace trammel::part_alignment
