#include "pressure_advance/laser_crop.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace trammel::pressure_advance {
namespace {

using testing::HasSubstr;

TEST(FindCrop, RefusesAPictureThatIsTooSmallForALaserLineByItsSize) {
  vision::LaserLineWorkspace workspace;
  for (const auto& [width, height] : {std::pair{1, 1}, {4, 4}, {7, 480}, {15, 480}, {640, 1}}) {
    const std::vector<Frame> frames(3, Frame(width, height));
    for (const AxisDirection direction : {AxisDirection::kMinusX, AxisDirection::kPlusY}) {
      const FoundCrop found = FindCrop(frames, direction, workspace);
      EXPECT_FALSE(found.crop) << width << "x" << height;
      // As the video has it: frames are turned upright.
      EXPECT_THAT(found.fault, HasSubstr(direction == AxisDirection::kMinusX
                                             ? fmt::format("{}x{} px", width, height)
                                             : fmt::format("{}x{} px", height, width)));
    }
  }
}

TEST(FindCrop, FindsNoLaserLineInADarkPicture) {
  vision::LaserLineWorkspace workspace;
  for (const int size : {16, 17, 64}) {
    const std::vector<Frame> frames(3, Frame(size, size));
    EXPECT_FALSE(FindCrop(frames, AxisDirection::kMinusX, workspace).crop) << size;
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
