// What ends a measurement, and which pictures count: the machine and the camera are made up.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "machine/net/host_clock.h"
#include "part_alignment/procedure/align_measure.h"
#include "part_alignment/procedure/align_picture.h"

namespace trammel::procedure {
namespace {

using Eigen::Vector3d;
using machine::CapturedFrame;
using machine::HostNow;
using part_alignment::Measurement;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Two views of one target, by a machine that goes where it is told.
struct Shop {
  Shop() {
    plan.targets = {{"7", {0, 0, 0}}};
    plan.views = {{{0, 0, 500}, Eigen::Matrix3d::Identity(), {}},
                  {{100, 0, 500}, Eigen::Matrix3d::Identity(), {}}};
    auto book = part_alignment::MakeCodeBook(14);
    if (book) options.book = *book;
    options.route.safe_z_mm = 700;
    shop.move_to = [this](const Vector3d& mm) -> Result<void> {
      at_mm = mm;
      return {};
    };
    shop.stands_at = [this]() -> Result<Vector3d> { return at_mm; };
    shop.take_picture = []() -> Result<CapturedFrame> { return CapturedFrame(); };
    shop.keep_picture = [this](std::size_t view, const CapturedFrame&) -> Result<void> {
      kept.push_back(view);
      return {};
    };
    shop.keep_observations = [](const Measurement&) -> Result<void> { return {}; };
    shop.tell = [](const std::string&) {};
  }

  Measurement plan;
  MeasureOptions options;
  MeasurementHooks shop;
  Vector3d at_mm = {0, 0, 700};
  std::vector<std::size_t> kept;
};

TEST(MeasurePart, ASpindleThatMovesWhileThePictureIsTakenEndsIt) {
  Shop made;
  made.shop.take_picture = [&made]() -> Result<CapturedFrame> {
    made.at_mm.x() += 0.02;
    return CapturedFrame();
  };
  const auto outcome = MeasurePart(made.plan, made.options, made.shop);
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().kind, ErrorKind::kMachine);
  EXPECT_THAT(outcome.error().message, HasSubstr("view 1: the spindle moved by 0.020 mm"));
  EXPECT_THAT(made.kept, ElementsAre(0));
}

TEST(MeasurePart, APictureIsKeptBeforeItIsFoundToBeNone) {
  Shop made;
  const auto outcome = MeasurePart(made.plan, made.options, made.shop);
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().kind, ErrorKind::kMeasurement);
  EXPECT_THAT(outcome.error().message, HasSubstr("view 1: frame of 0 bytes"));
  EXPECT_THAT(made.kept, ElementsAre(0));
}

TEST(MeasurePart, AFullDiskEndsItBeforeTheNextMove) {
  Shop made;
  made.shop.keep_picture = [](std::size_t, const CapturedFrame&) -> Result<void> {
    return Fail("no space left on device");
  };
  const auto outcome = MeasurePart(made.plan, made.options, made.shop);
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().message, HasSubstr("view 1: no space left"));
  EXPECT_EQ(made.at_mm, Vector3d(0, 0, 500));
}

TEST(MeasurePart, AMoveThatFailsNamesTheViewItWasFor) {
  Shop made;
  made.shop.move_to = [](const Vector3d&) -> Result<void> {
    return Fail("refused", ErrorKind::kMachine);
  };
  const auto outcome = MeasurePart(made.plan, made.options, made.shop);
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().message, "view 1: refused");
}

// A picture every 10 ms, each taken 50 ms before it arrives.
class Stream final : public machine::FrameSource {
 public:
  explicit Stream(bool stamped, int last = 1'000'000) : stamped_(stamped), last_(last) {}
  Result<std::optional<CapturedFrame>> Next(double, std::stop_token) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (last_-- == 0) return Fail("the stream ended", ErrorKind::kMachine);
    CapturedFrame frame;
    frame.arrival_s = HostNow();
    constexpr double kLate_s = 0.05;
    if (stamped_) frame.captured = {frame.arrival_s - kLate_s, machine::CameraClock::kOurs};
    return frame;
  }
  [[nodiscard]] std::string Describe() const override { return "made up"; }
  [[nodiscard]] bool live() const override { return true; }

 private:
  bool stamped_;
  int last_;
};

TEST(StillPictures, ALivePictureWasTakenAfterTheMachineHadSettled) {
  constexpr double kSettle_s = 0.1;
  for (const bool stamped : {false, true}) {
    Stream camera(stamped);
    StillPictures pictures(camera, kSettle_s);
    for (int i = 0; i < 3; ++i) {
      const double asked_s = HostNow();
      const auto frame = pictures.Take({});
      ASSERT_TRUE(frame) << frame.error().message;
      const double taken_s = stamped ? frame->captured->time_s : frame->arrival_s;
      EXPECT_GE(taken_s, asked_s + kSettle_s);
    }
  }
}

TEST(StillPictures, ACameraThatEndsAndAStopAreErrors) {
  Stream camera(false, 3);
  StillPictures pictures(camera, 0.5);
  const auto ended = pictures.Take({});
  ASSERT_FALSE(ended);
  EXPECT_THAT(ended.error().message, HasSubstr("the stream ended"));

  Stream other(false);
  StillPictures more(other, 60);
  std::stop_source stop;
  std::thread stopper([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop.request_stop();
  });
  const double asked_s = HostNow();
  const auto stopped = more.Take(stop.get_token());
  stopper.join();
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::kInterrupted);
  EXPECT_LT(HostNow() - asked_s, 5);
}

}  // namespace
}  // namespace trammel::procedure
