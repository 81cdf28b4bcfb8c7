#include "part_alignment/procedure/align_picture.h"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <thread>

#include "machine/net/host_clock.h"

namespace trammel::procedure {
namespace {

using machine::CapturedFrame;

/// A live camera that says of some of its pictures when they were taken.
class TimedCamera final : public machine::FrameSource {
 public:
  /// @param told_of  one picture in so many; 0: none
  explicit TimedCamera(int told_of) : told_of_(told_of) {}
  Result<std::optional<CapturedFrame>> Next(double, std::stop_token) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    CapturedFrame frame;
    frame.arrival_s = machine::HostNow();
    if (told_of_ > 0 && count_++ % told_of_ == 0) {
      frame.captured = {frame.arrival_s, machine::CameraClock::kOurs};
    }
    return frame;
  }
  [[nodiscard]] std::string Describe() const override { return "camera timed"; }
  [[nodiscard]] bool live() const override { return true; }

 private:
  int told_of_;
  int count_ = 0;
};

// Such a picture may have waited in a queue since before the machine stood.
TEST(StillPictures, OnceTimesAreToldAPictureWithoutOneDoesNotCount) {
  constexpr int kTakes = 20;
  TimedCamera camera(2);
  StillPictures pictures(camera, 0);
  bool told = false;
  for (int i = 0; i < kTakes; ++i) {
    const auto frame = pictures.Take({});
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_TRUE(frame->captured || !told) << i;
    told = told || frame->captured;
  }
  EXPECT_TRUE(told);
}

TEST(StillPictures, ACameraWithoutTimesIsTakenByItsArrivals) {
  TimedCamera camera(0);
  StillPictures pictures(camera, 0.05);
  const double asked_s = machine::HostNow();
  const auto frame = pictures.Take({});
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_GE(frame->arrival_s, asked_s + 0.05);
}

}  // namespace
}  // namespace trammel::procedure
