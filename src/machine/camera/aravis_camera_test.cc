// The Aravis source against Aravis' own cameras that are none: one within the process, and one that
// speaks GigE Vision over loopback.
#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <chrono>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "machine/camera/camera.h"
#include "machine/camera/camera_sources.h"
#include "machine/net/host_clock.h"
#include "support/matchers.h"

namespace trammel::machine {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kPatience_s = 10;  // sized for a loaded machine
constexpr int kSide_px = 512;       // of the camera in the process
// A picture that fits the smallest socket buffer: who is not root and waits for a processor loses
// packets of a larger one.
constexpr int kGigEWidth_px = 160;
constexpr int kGigEHeight_px = 96;

struct Release {
  void operator()(void* object) const { g_object_unref(object); }
};
using GigE = std::unique_ptr<ArvGvFakeCamera, Release>;

ArvFakeCamera* Registers(const GigE& camera) {
  return arv_gv_fake_camera_get_fake_camera(camera.get());
}

/// A camera that answers at 127.0.0.1 as a device in a network would.
GigE MakeGigE() {
  GigE camera;
  // The protocol's port may still be another run's.
  for (int i = 0; i < 10 && !(camera && arv_gv_fake_camera_is_running(camera.get())); ++i) {
    if (camera) std::this_thread::sleep_for(std::chrono::seconds(1));
    camera.reset(arv_gv_fake_camera_new("127.0.0.1", "GV77"));
  }
  EXPECT_TRUE(arv_gv_fake_camera_is_running(camera.get()));
  arv_fake_camera_write_register(Registers(camera), ARV_FAKE_CAMERA_REGISTER_WIDTH, kGigEWidth_px);
  arv_fake_camera_write_register(Registers(camera), ARV_FAKE_CAMERA_REGISTER_HEIGHT,
                                 kGigEHeight_px);
  return camera;
}

/// Test fixture that ignores real cameras.
class AravisCameraTest : public testing::Test {
 protected:
  void SetUp() override {
    arv_enable_interface("Fake");
    arv_disable_interface("USB3Vision");
    arv_disable_interface("GigEVision");
  }
  static void TearDownTestSuite() { arv_shutdown(); }
};

class AravisGigETest : public AravisCameraTest {
 protected:
  void SetUp() override {
    AravisCameraTest::SetUp();
    arv_enable_interface("GigEVision");
  }
};

std::unique_ptr<FrameSource> Opened(const std::string& address, const CameraOptions& options = {}) {
  return Must(OpenCamera(address, options));
}

/// The next whole one. On a machine under load any may be cut off, and is then told to be.
CapturedFrame NextFrame(FrameSource& camera) {
  const double asked_s = HostNow();
  for (;;) {
    auto frame = camera.Next(kPatience_s, {});
    EXPECT_TRUE(frame) << (frame ? "" : frame.error().message);
    if (!frame || !*frame || HostNow() - asked_s > kPatience_s) return {};
    if ((*frame)->fault == FrameFault::kNone) return **std::move(frame);
    EXPECT_EQ((*frame)->fault, FrameFault::kCutOff) << (*frame)->fault_text;
    EXPECT_THAT((*frame)->fault_text, Not(IsEmpty()));
  }
}

void ExpectFrames(FrameSource& camera, int width_px, int height_px) {
  double last_s = 0;
  std::uint64_t last = 0;
  for (int i = 0; i < 5; ++i) {
    const CapturedFrame frame = NextFrame(camera);
    EXPECT_EQ(frame.width_px, width_px);
    EXPECT_EQ(frame.height_px, height_px);
    ASSERT_TRUE(frame.captured);
    EXPECT_EQ(frame.captured->clock, CameraClock::kOurs);
    EXPECT_GT(frame.captured->time_s, last_s);
    EXPECT_LT(frame.captured->time_s, frame.arrival_s);
    EXPECT_GT(frame.captured->time_s, frame.arrival_s - kPatience_s);
    EXPECT_LE(frame.arrival_s, HostNow());
    ASSERT_TRUE(frame.sequence);
    EXPECT_GT(*frame.sequence, last);
    last_s = frame.captured->time_s;
    last = *frame.sequence;
    const auto decoded = Must(DecodeFrame(frame));
    EXPECT_EQ(decoded.width, width_px);
    EXPECT_EQ(decoded.height, height_px);
  }
}

/// Frames that are here are delivered before the loss is told.
void ExpectLoss(FrameSource& camera) {
  const double lost_s = HostNow();
  for (;;) {
    const auto frame = camera.Next(kPatience_s, {});
    ASSERT_LT(HostNow() - lost_s, kPatience_s);
    if (frame) continue;
    EXPECT_EQ(frame.error().kind, ErrorKind::kMachine);
    EXPECT_THAT(frame.error().message, Containing("aravis:127.0.0.1", "was lost after"));
    return;
  }
}

TEST_F(AravisCameraTest, FramesOfTheCameraInTheProcess) {
  const auto camera = Opened("aravis:Fake_1");
  EXPECT_TRUE(camera->live());
  EXPECT_THAT(camera->Describe(), Containing("aravis:Fake_1", "512x512", "Mono8"));
  ExpectFrames(*camera, kSide_px, kSide_px);
}

TEST_F(AravisCameraTest, ACaptureTimeIsBeforeThePacketsByTheExposure) {
  const auto camera = Opened("aravis:Fake_1");
  constexpr double kExposure_s = ARV_FAKE_CAMERA_EXPOSURE_TIME_US_DEFAULT * 1e-6;
  const CapturedFrame frame = NextFrame(*camera);
  ASSERT_TRUE(frame.captured);
  EXPECT_GE(frame.arrival_s - frame.captured->time_s, kExposure_s);
}

TEST_F(AravisCameraTest, AnUnknownIdIsAnErrorThatListsThoseThatAreThere) {
  const auto camera = OpenCamera("aravis:no-such-camera.invalid");
  ASSERT_THAT(camera, FailsWith(ErrorKind::kMachine));
  EXPECT_THAT(camera.error().message, Containing("aravis:no-such-camera.invalid", "aravis:Fake_1"));
}

TEST_F(AravisGigETest, FramesComeAndExposureAndGainStay) {
  const GigE device = MakeGigE();
  constexpr std::uint32_t kExposure_us = 4321;
  constexpr std::uint32_t kGain = 7;
  arv_fake_camera_write_register(Registers(device), ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US,
                                 kExposure_us);
  arv_fake_camera_write_register(Registers(device), ARV_FAKE_CAMERA_REGISTER_GAIN_RAW, kGain);
  const auto camera = Opened("aravis:127.0.0.1");
  ExpectFrames(*camera, kGigEWidth_px, kGigEHeight_px);
  std::uint32_t exposure_us = 0;
  std::uint32_t gain = 0;
  arv_fake_camera_read_register(Registers(device), ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US,
                                &exposure_us);
  arv_fake_camera_read_register(Registers(device), ARV_FAKE_CAMERA_REGISTER_GAIN_RAW, &gain);
  EXPECT_EQ(exposure_us, kExposure_us);
  EXPECT_EQ(gain, kGain);
}

TEST_F(AravisGigETest, APixelFormatThatIsNotReadIsNamedWithThoseThatAre) {
  const GigE device = MakeGigE();
  arv_fake_camera_write_register(Registers(device), ARV_FAKE_CAMERA_REGISTER_PIXEL_FORMAT,
                                 ARV_PIXEL_FORMAT_MONO_16);
  EXPECT_THAT(OpenCamera("aravis:127.0.0.1"),
              FailsWith(ErrorKind::kMachine, "aravis:127.0.0.1", "Mono16", "Mono8, Bayer",
                        "control PixelFormat=Mono8"));
}

/// Opens a camera that waits for a trigger that nobody gives.
std::unique_ptr<FrameSource> OpenedSilent(const GigE& device) {
  constexpr std::uint32_t kOn = 1;
  arv_fake_camera_write_register(Registers(device), ARV_FAKE_CAMERA_REGISTER_TRIGGER_MODE, kOn);
  return Opened("aravis:127.0.0.1");
}

/// Sends datagrams over loopback until the stop, as other programs of a machine do.
void ExchangeDatagrams(const std::stop_token& stop) {
  boost::asio::io_context context;
  const boost::asio::ip::udp::endpoint loopback(boost::asio::ip::address_v4::loopback(), 0);
  boost::asio::ip::udp::socket receiver(context, loopback);
  boost::asio::ip::udp::socket sender(context, loopback);
  const std::vector<char> datagram(500, '\x01');
  while (!stop.stop_requested()) {
    sender.send_to(boost::asio::buffer(datagram), receiver.local_endpoint());
  }
}

TEST_F(AravisGigETest, DatagramsOfOtherProgramsAreNoPictures) {
  const std::jthread others(ExchangeDatagrams);
  const GigE device = MakeGigE();
  for (int i = 0; i < 10; ++i) {
    const auto camera = OpenedSilent(device);
    EXPECT_FALSE(camera->Next(0.1, {}));
  }
}

TEST_F(AravisGigETest, ACameraThatWaitsForATriggerIsAStallThatSaysSo) {
  const GigE device = MakeGigE();
  const auto camera = OpenedSilent(device);
  constexpr double kLimit_s = 0.3;
  const double asked_s = HostNow();
  const auto frame = camera->Next(kLimit_s, {});
  const double waited_s = HostNow() - asked_s;
  ASSERT_THAT(frame, FailsWith(ErrorKind::kMachine, "0.3 s", "TriggerMode"));
  EXPECT_GE(waited_s, kLimit_s);
  EXPECT_LT(waited_s, kPatience_s);
}

TEST_F(AravisGigETest, AStopEndsTheWait) {
  const GigE device = MakeGigE();
  const auto camera = OpenedSilent(device);
  std::stop_source stop;
  const std::jthread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    stop.request_stop();
  });
  const double asked_s = HostNow();
  EXPECT_THAT(camera->Next(6 * kPatience_s, stop.get_token()), FailsWith(ErrorKind::kInterrupted));
  EXPECT_LT(HostNow() - asked_s, kPatience_s);
}

// Given another program that takes the camera, its next heartbeat, a second later, detects it.
TEST_F(AravisGigETest, ACameraThatIsLostInMidStreamIsAnError) {
  const GigE device = MakeGigE();
  const auto camera = Opened("aravis:127.0.0.1");
  NextFrame(*camera);
  arv_fake_camera_set_control_channel_privilege(Registers(device), 0);
  ExpectLoss(*camera);
}

}  // namespace
}  // namespace trammel::machine
