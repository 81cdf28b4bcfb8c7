// A GigE Vision camera that vanishes in mid-stream. Slow, for Aravis asks many times before it
// gives a camera up.
#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine/camera/camera.h"
#include "support/matchers.h"

namespace trammel::machine {
namespace {

TEST(AravisLoss, ACameraWhoseCableIsPulledIsLost) {
  ArvGvFakeCamera* device = arv_gv_fake_camera_new("127.0.0.1", "GV78");
  auto camera = Must(OpenCamera("aravis:127.0.0.1"));
  constexpr double kPatience_s = 60;  // Aravis takes 11 s
  ASSERT_TRUE(camera->Next(kPatience_s, {}));
  g_object_unref(device);
  auto frame = camera->Next(kPatience_s, {});
  while (frame) frame = camera->Next(kPatience_s, {});
  EXPECT_EQ(frame.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(frame.error().message, Containing("aravis:127.0.0.1", "was lost"));
  camera.reset();
  arv_shutdown();
}

}  // namespace
}  // namespace trammel::machine
