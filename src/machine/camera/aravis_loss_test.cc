// A GigE Vision camera that vanishes in mid-stream. Slow, for Aravis asks many times before it
// gives a camera up.
#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine/camera/camera.h"

namespace trammel::machine {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(AravisLoss, ACameraWhoseCableIsPulledIsLost) {
  ArvGvFakeCamera* device = arv_gv_fake_camera_new("127.0.0.1", "GV78");
  auto camera = OpenCamera("aravis:127.0.0.1");
  ASSERT_TRUE(camera) << camera.error().message;
  constexpr double kPatience_s = 60;  // Aravis takes 11 s
  const auto first = (*camera)->Next(kPatience_s, {});
  ASSERT_TRUE(first) << first.error().message;
  g_object_unref(device);
  auto frame = (*camera)->Next(kPatience_s, {});
  while (frame) frame = (*camera)->Next(kPatience_s, {});
  EXPECT_EQ(frame.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(frame.error().message, AllOf(HasSubstr("aravis:127.0.0.1"), HasSubstr("was lost")));
  camera->reset();
  arv_shutdown();
}

}  // namespace
}  // namespace trammel::machine
