#include "machine/camera/frame_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "support/temporary_folder.h"
#include "support/test_pictures.h"

namespace trammel::machine {
namespace {

using ::testing::HasSubstr;

class FrameFilesTest : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& bytes) const {
    test::WriteWhole(folder_.path() / name, bytes);
  }
  [[nodiscard]] std::string Message(const std::string& name) const {
    auto camera = OpenCamera((folder_.path() / name).string());
    return camera ? (*camera)->Describe() : camera.error().message;
  }
  test::TemporaryFolder folder_;
};

TEST_F(FrameFilesTest, AFolderComesInTheOrderOfItsNumbers) {
  for (const int i : {10, 9, 1, 2}) {
    Write("frame" + std::to_string(i) + ".jpg", test::JpegOf(test::TestPicture(32, 24, i)));
  }
  Write("frame11.JPG", test::JpegOf(test::TestPicture(48, 24, 0)));
  Write("frame12.png", "not a picture");
  Write("notes.txt", "x");
  auto camera = OpenCamera(folder_.path().string());
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_FALSE((*camera)->live());
  for (const int i : {1, 2, 9, 10}) {
    const auto frame = (*camera)->Next(1, {});
    ASSERT_TRUE(frame && *frame);
    const std::string expected = test::JpegOf(test::TestPicture(32, 24, i));
    EXPECT_EQ(std::string((*frame)->image.begin(), (*frame)->image.end()), expected) << i;
    EXPECT_FALSE((*frame)->captured);
  }
  EXPECT_EQ((**(*camera)->Next(1, {})).fault, FrameFault::kOtherSize);
  EXPECT_EQ((**(*camera)->Next(1, {})).fault, FrameFault::kNotAnImage);
  EXPECT_FALSE(*(*camera)->Next(1, {}));
}

TEST_F(FrameFilesTest, NamesWhatIsNotThereOrNotAVideo) {
  EXPECT_THAT(Message("none.avi"), HasSubstr("nothing of that name"));
  Write("text.avi", std::string(1000, 'x'));
  EXPECT_THAT(Message("text.avi"), HasSubstr("text.avi"));
  EXPECT_THAT(Message(""), HasSubstr("holds no .jpg"));
  const auto rtsp = OpenCamera("rtsp://host/stream");
  ASSERT_FALSE(rtsp);
  EXPECT_THAT(rtsp.error().message, HasSubstr("MJPEG over HTTP"));
  const auto device = OpenCamera("/dev/video-none");
  ASSERT_FALSE(device);
  EXPECT_EQ(device.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(device.error().message, HasSubstr("plugged in"));
  const auto null = OpenCamera("/dev/null");
  ASSERT_FALSE(null);
  EXPECT_THAT(null.error().message, HasSubstr("not a video device"));
}

}  // namespace
}  // namespace trammel::machine
