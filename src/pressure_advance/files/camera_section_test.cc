#include "pressure_advance/files/camera_section.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace trammel::files {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const CameraKeys kKeys = {{"offset_x", "28.5"}, {"crop", "[1, 2, 30, 40]"}};

TEST(PutCameraKeys, AddsASectionWhereThereIsNone) {
  EXPECT_EQ(PutCameraKeys("", kKeys), "[camera]\noffset_x = 28.5\ncrop = [1, 2, 30, 40]\n");
  EXPECT_EQ(PutCameraKeys("[scan]\nspeed = 5", kKeys),
            "[scan]\nspeed = 5\n\n[camera]\noffset_x = 28.5\ncrop = [1, 2, 30, 40]\n");
}

TEST(PutCameraKeys, LeavesAllElseAsItIsAndOldValuesAsComments) {
  const std::string text =
      "# mine\n[camera]\nurl = \"http://a/b?[x]\"  # stays\n  offset_x = 27 # measured\n"
      "crop = [\n  5, 6,\n  7, 8]\noffset_y = 50\n[scan]\noffset_x_of_mine = 1\n";
  EXPECT_EQ(PutCameraKeys(text, kKeys),
            "# mine\n[camera]\noffset_x = 28.5\ncrop = [1, 2, 30, 40]\n"
            "url = \"http://a/b?[x]\"  # stays\n# before pa setup: offset_x = 27 # measured\n"
            "# before pa setup: crop = [\n# before pa setup: 5, 6,\n# before pa setup: 7, 8]\n"
            "offset_y = 50\n[scan]\noffset_x_of_mine = 1\n");
}

TEST(PutCameraKeys, TouchesNoKeyOfAnotherSection) {
  const std::string text = "[mine]\noffset_x = 3\n[camera]  # here\nwidth = 640\n";
  const std::string put = PutCameraKeys(text, kKeys);
  EXPECT_THAT(put, HasSubstr("[mine]\noffset_x = 3\n[camera]  # here\noffset_x = 28.5\n"));
  EXPECT_THAT(put, Not(HasSubstr("before pa setup")));
}

TEST(PutCameraKeys, ComesToAnEndInWhateverIsWritten) {
  for (const char* text :
       {"[camera", "[camera]\ncrop = [", "=\n[camera]\n=\n[", "\r\n\r\n[camera]\r\n"}) {
    EXPECT_THAT(PutCameraKeys(text, kKeys), HasSubstr("offset_x = 28.5")) << text;
  }
}

}  // namespace
}  // namespace trammel::files
