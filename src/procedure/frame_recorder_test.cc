#include "procedure/frame_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "machine/host_clock.h"

namespace trammel::procedure {
namespace {

using machine::CapturedFrame;
using machine::FrameFault;
using testing::AllOf;
using testing::HasSubstr;

/// A live camera whose every picture has the same fault.
class FaultyCamera final : public machine::FrameSource {
 public:
  FaultyCamera(FrameFault fault, std::string text) : fault_(fault), text_(std::move(text)) {}
  Result<std::optional<CapturedFrame>> Next(double, std::stop_token) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    CapturedFrame frame;
    frame.arrival_s = machine::HostNow();
    frame.fault = fault_;
    frame.fault_text = text_;
    ++taken;
    return frame;
  }
  [[nodiscard]] std::string Describe() const override { return "camera faulty"; }
  [[nodiscard]] bool live() const override { return true; }

  std::atomic<int> taken = 0;

 private:
  FrameFault fault_;
  std::string text_;
};

TEST(FrameRecorder, OfPicturesThatNeverComeWholeTheErrorSaysWhatIsWrongWithThem) {
  FaultyCamera camera(FrameFault::kCutOff, "packets of it are missing");
  FrameRecorder recorder(camera, 5);
  auto frame = recorder.NextFrame(0.3, {});
  // On a machine under load the reader's thread may come late.
  for (int i = 0; i < 30 && camera.taken == 0; ++i) frame = recorder.NextFrame(0.3, {});
  frame = recorder.NextFrame(0.3, {});
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(frame.error().message, AllOf(HasSubstr("camera faulty"), HasSubstr("0.3 s"),
                                           HasSubstr("packets of it are missing")));
}

TEST(FrameRecorder, AFrameWithAWrongTimeOnlyIsAPicture) {
  FaultyCamera camera(FrameFault::kTimeJumped, "its time is before the last one's");
  FrameRecorder recorder(camera, 5);
  EXPECT_TRUE(recorder.NextFrame(10, {}));
}

}  // namespace
}  // namespace trammel::procedure
