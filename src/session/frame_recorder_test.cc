#include "session/frame_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "base/bug_note.h"
#include "base/check.h"
#include "machine/net/host_clock.h"
#include "support/matchers.h"

namespace trammel::procedure {
namespace {

using machine::CapturedFrame;
using machine::FrameFault;

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
  // On a busy machine the reader's thread may be late.
  for (int i = 0; i < 30 && camera.taken == 0; ++i) frame = recorder.NextFrame(0.3, {});
  frame = recorder.NextFrame(0.3, {});
  ASSERT_THAT(
      frame, FailsWith(ErrorKind::kMachine, "camera faulty", "0.3 s", "packets of it are missing"));
}

/// A live camera that sends a sound picture every few milliseconds.
class SteadyCamera final : public machine::FrameSource {
 public:
  Result<std::optional<CapturedFrame>> Next(double, std::stop_token) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    CapturedFrame frame;
    frame.image.resize(bytes);
    frame.arrival_s = machine::HostNow();
    ++taken;
    taken.notify_all();
    return frame;
  }
  [[nodiscard]] std::string Describe() const override { return "camera steady"; }
  [[nodiscard]] bool live() const override { return true; }

  std::atomic<int> taken = 0;
  std::atomic<std::size_t> bytes = 1000;
};

/// A disk that does what a test tells it.
class Disk final : public FrameSink {
 public:
  explicit Disk(std::function<Result<void>(int)> add) : add_(std::move(add)) {}
  Result<void> Add(const CapturedFrame&) override { return add_(written_++); }
  Result<void> Finish() override { return {}; }

 private:
  std::function<Result<void>(int)> add_;
  int written_ = 0;
};

TEST(FrameRecorder, ADiskThatHangsKeepsNoFrameFromBeingFetched) {
  SteadyCamera camera;
  FrameRecorder recorder(camera, 5);
  ASSERT_TRUE(recorder.NextFrame(30, {}));
  bool fetched_meanwhile = true;
  const double begin_s = machine::HostNow();
  recorder.Begin(std::make_unique<Disk>([&](int number) -> Result<void> {
    // The disk takes its first picture only when twenty more have come.
    const int enough = camera.taken + 20;
    const double limit_s = machine::HostNow() + 30;
    while (number == 0 && camera.taken < enough && fetched_meanwhile) {
      fetched_meanwhile = machine::HostNow() < limit_s;
      std::this_thread::yield();
    }
    return {};
  }));
  recorder.WaitForFrames(30, begin_s, 60, {});
  const auto frames = Must(recorder.End());
  EXPECT_TRUE(fetched_meanwhile);
  EXPECT_GE(frames.size(), 30U);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    EXPECT_GT(frames[i].arrival_s, frames[i - 1].arrival_s);
  }
}

TEST(FrameRecorder, ADiskThatFallsBehindForGoodIsNamed) {
  SteadyCamera camera;
  FrameRecorder recorder(camera, 5);
  ASSERT_TRUE(recorder.NextFrame(30, {}));
  camera.bytes = std::size_t{8} << 20;
  std::atomic<bool> hang = true;
  recorder.Begin(std::make_unique<Disk>([&](int) -> Result<void> {
    hang.wait(true);
    return {};
  }));
  // 96 MB may wait: 12 such pictures, and those that came before the disk was known to hang.
  for (int count = camera.taken; count < 40; count = camera.taken) camera.taken.wait(count);
  hang = false;
  hang.notify_all();
  EXPECT_THAT(recorder.End(), FailsWith("the disk does not keep up"));
}

TEST(FrameRecorder, ADiskThatFailsIsTheErrorAndTheCameraGoesOn) {
  SteadyCamera camera;
  FrameRecorder recorder(camera, 5);
  const double begin_s = machine::HostNow();
  recorder.Begin(std::make_unique<Disk>([](int number) -> Result<void> {
    if (number < 5) return {};
    return Fail("the disk is full");
  }));
  recorder.WaitForFrames(1000, begin_s, 60, {});
  const auto frames = recorder.End();
  ASSERT_FALSE(frames);
  EXPECT_EQ(frames.error().message, "the disk is full");
  EXPECT_TRUE(recorder.NextFrame(30, {}));
  EXPECT_FALSE(recorder.priority().text.empty());
}

/// A camera whose server has gone.
class GoneCamera final : public machine::FrameSource {
 public:
  Result<std::optional<CapturedFrame>> Next(double, std::stop_token) override {
    return Fail("camera gone: the stream ended", ErrorKind::kMachine);
  }
  [[nodiscard]] std::string Describe() const override { return "camera gone"; }
  [[nodiscard]] bool live() const override { return true; }
};

TEST(FrameRecorder, AStopIsToldBeforeACameraThatHasGone) {
  GoneCamera camera;
  FrameRecorder recorder(camera, 5);
  EXPECT_THAT(recorder.NextFrame(30, {}), FailsWith(ErrorKind::kMachine));
  std::stop_source stop;
  stop.request_stop();
  const auto after = recorder.NextFrame(30, stop.get_token());
  ASSERT_FALSE(after);
  EXPECT_EQ(after.error().kind, ErrorKind::kInterrupted) << after.error().message;
}

/// A camera whose driver has a bug.
class BrokenCamera final : public machine::FrameSource {
 public:
  Result<std::optional<CapturedFrame>> Next(double, std::stop_token) override {
    throw Bug("no picture is -1 px wide");
  }
  [[nodiscard]] std::string Describe() const override { return "camera broken"; }
  [[nodiscard]] bool live() const override { return true; }
};

TEST(FrameRecorder, ABugInACameraIsTheRecordingsErrorAndNotTheProcesssEnd) {
  BrokenCamera camera;
  FrameRecorder recorder(camera, 5);
  EXPECT_THAT(recorder.NextFrame(10, {}), FailsWith("a bug in trammel", "-1 px wide"));
  EXPECT_FALSE(recorder.End());
  EXPECT_TRUE(NotedBug());
}

}  // namespace
}  // namespace trammel::procedure
