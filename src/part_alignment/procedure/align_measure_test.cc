// Still pictures, the way between views, and a measurement with a scripted shop.
#include "part_alignment/procedure/align_measure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "machine/net/host_clock.h"
#include "part_alignment/procedure/align_route.h"
#include "support/matchers.h"

namespace trammel::procedure {
namespace {

using Eigen::Vector3d;
using machine::CapturedFrame;
using machine::HostNow;
using part_alignment::Measurement;
using part_alignment::View;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

View At(double x, double y, double z) { return {{x, y, z}, Eigen::Matrix3d::Identity(), {}}; }

// A block of 500 x 300 mm, 100 mm high, and a camera that hangs 400 mm below the spindle.
RouteOptions BlockRoute() {
  RouteOptions options;
  options.safe_z_mm = 700;
  options.camera_radius_mm = 60;
  options.obstacles = {{{0, 0, 0}, {500, 300, 100}}};
  return options;
}

TEST(RouteThrough, CrossesOnlyAtTheSafeHeightAndEndsThere) {
  const auto way =
      Must(RouteThrough({-200, -200, 300}, {At(100, 100, 550), At(400, 200, 560)}, BlockRoute()));
  Vector3d last(-200, -200, 300);
  std::vector<int> views;
  for (const Waypoint& point : way) {
    const bool across = point.spindle_mm.head<2>() != last.head<2>();
    if (across) {
      EXPECT_EQ(point.spindle_mm.z(), 700);
      EXPECT_EQ(last.z(), 700);
    }
    if (point.view >= 0) views.push_back(point.view);
    last = point.spindle_mm;
  }
  EXPECT_THAT(views, ::testing::ElementsAre(0, 1));
  EXPECT_EQ(last, Vector3d(400, 200, 700));
}

TEST(RouteThrough, RefusesAViewInWhichTheCameraTouchesThePart) {
  const auto way = RouteThrough({0, 0, 700}, {At(100, 100, 499)}, BlockRoute());  // lower end at 99
  ASSERT_THAT(way, FailsWith(ErrorKind::kSafety, "too near to obstacle 1"));
  EXPECT_TRUE(RouteThrough({0, 0, 700}, {At(100, 100, 501)}, BlockRoute()));
  // Beside the part, by more than the camera's radius.
  EXPECT_TRUE(RouteThrough({0, 0, 700}, {At(100, -61, 450)}, BlockRoute()));
  EXPECT_FALSE(RouteThrough({0, 0, 700}, {At(100, -59, 450)}, BlockRoute()));
}

TEST(RouteThrough, RefusesASafeHeightThatIsNone) {
  RouteOptions options = BlockRoute();
  options.safe_z_mm = 480;  // the camera would cut through the part on its way across
  EXPECT_THAT(RouteThrough({-200, 150, 480}, {At(700, 150, 470)}, options),
              FailsWith("raise the safe height"));
  options = BlockRoute();
  options.travel.high_mm.z() = 690;
  const auto outside = RouteThrough({0, 0, 600}, {At(100, 100, 600)}, options);
  ASSERT_THAT(outside, FailsWith(ErrorKind::kSafety));
  EXPECT_THAT(outside.error().message, HasSubstr("the safe height 700.0 lies outside the travel"));
}

TEST(RouteThrough, RefusesATravelThatIsNoNumberOrTheWrongWayRound) {
  for (const double most : {double{NAN}, -2e6}) {
    RouteOptions options = BlockRoute();
    options.travel.high_mm.y() = most;
    EXPECT_THAT(RouteThrough({0, 0, 700}, {At(0, 0, 600)}, options),
                FailsWith(ErrorKind::kSafety, "the travel reaches from"))
        << most;
  }
}

TEST(RouteThrough, RefusesWhatCannotBeDriven) {
  RouteOptions options = BlockRoute();
  options.travel.high_mm = {600, 400, 800};
  EXPECT_THAT(RouteThrough({0, 0, 700}, {At(601, 0, 600)}, options).error().message,
              HasSubstr("view 1 at X 601.0 Y 0.0 Z 600.0 lies outside the travel"));
  EXPECT_THAT(RouteThrough({0, 0, 700}, {At(0, 0, 701)}, options).error().message,
              HasSubstr("above the safe height"));
  View turned = At(0, 0, 600);
  turned.spindle_rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  EXPECT_THAT(RouteThrough({0, 0, 700}, {turned}, options).error().message,
              HasSubstr("turns the spindle"));
  EXPECT_FALSE(RouteThrough({0, 0, NAN}, {At(0, 0, 600)}, options));
  EXPECT_FALSE(RouteThrough({0, 0, 700}, {At(0, NAN, 600)}, options));
  options.obstacles[0].low_mm.x() = 900;
  EXPECT_THAT(RouteThrough({0, 0, 700}, {At(0, 0, 600)}, options).error().message,
              HasSubstr("least and then its most"));
}

TEST(RouteThrough, RefusesToSetOutFromWhereTheSpindleCannotBe) {
  for (const Vector3d& start : {Vector3d(0, 0, 1e300), Vector3d(-2e5, 0, 700)}) {
    EXPECT_THAT(RouteThrough(start, {At(100, 100, 550)}, BlockRoute()),
                FailsWith(ErrorKind::kSafety, "the spindle stands at X"));
  }
  RouteOptions options = BlockRoute();
  options.travel.high_mm = {600, 400, 800};
  EXPECT_TRUE(RouteThrough({600.005, 0, 800}, {At(100, 100, 550)}, options)) << "at its limit";
  EXPECT_FALSE(RouteThrough({600.5, 0, 800}, {At(100, 100, 550)}, options));
}

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
  EXPECT_THAT(MeasurePart(made.plan, made.options, made.shop),
              FailsWith(ErrorKind::kMachine, "view 1: the spindle moved by 0.020 mm"));
  EXPECT_THAT(made.kept, ElementsAre(0));
}

TEST(MeasurePart, APictureIsKeptBeforeItIsFoundToBeNone) {
  Shop made;
  EXPECT_THAT(MeasurePart(made.plan, made.options, made.shop),
              FailsWith(ErrorKind::kMeasurement, "view 1: frame of 0 bytes"));
  EXPECT_THAT(made.kept, ElementsAre(0));
}

TEST(MeasurePart, AFullDiskEndsItBeforeTheNextMove) {
  Shop made;
  made.shop.keep_picture = [](std::size_t, const CapturedFrame&) -> Result<void> {
    return Fail("no space left on device");
  };
  EXPECT_THAT(MeasurePart(made.plan, made.options, made.shop), FailsWith("view 1: no space left"));
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
  /// @param told_of  one picture in so many has its time; 0: none
  explicit Stream(int told_of, int last = 1'000'000) : told_of_(told_of), last_(last) {}
  Result<std::optional<CapturedFrame>> Next(double, std::stop_token) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (last_-- == 0) return Fail("the stream ended", ErrorKind::kMachine);
    CapturedFrame frame;
    frame.arrival_s = HostNow();
    constexpr double kLate_s = 0.05;
    if (told_of_ > 0 && count_++ % told_of_ == 0) {
      frame.captured = {frame.arrival_s - kLate_s, machine::CameraClock::kOurs};
    }
    return frame;
  }
  [[nodiscard]] std::string Describe() const override { return "made up"; }
  [[nodiscard]] bool live() const override { return true; }

 private:
  int told_of_;
  int last_;
  int count_ = 0;
};

// One without a time may have waited in a queue since before the machine stood.
TEST(StillPictures, OnceTimesAreToldAPictureWithoutOneDoesNotCount) {
  Stream camera(2);
  StillPictures pictures(camera, 0);
  bool told = false;
  for (int i = 0; i < 20; ++i) {
    const auto frame = Must(pictures.Take({}));
    EXPECT_TRUE(frame.captured || !told) << i;
    told = told || frame.captured;
  }
  EXPECT_TRUE(told);
}

TEST(StillPictures, ALivePictureWasTakenAfterTheMachineHadSettled) {
  constexpr double kSettle_s = 0.1;
  for (const bool stamped : {false, true}) {
    Stream camera(stamped ? 1 : 0);
    StillPictures pictures(camera, kSettle_s);
    for (int i = 0; i < 3; ++i) {
      const double asked_s = HostNow();
      const auto frame = Must(pictures.Take({}));
      const double taken_s = stamped ? frame.captured->time_s : frame.arrival_s;
      EXPECT_GE(taken_s, asked_s + kSettle_s);
    }
  }
}

TEST(StillPictures, ACameraThatEndsAndAStopAreErrors) {
  Stream camera(0, 3);
  StillPictures pictures(camera, 0.5);
  const auto ended = pictures.Take({});
  ASSERT_FALSE(ended);
  EXPECT_THAT(ended.error().message, HasSubstr("the stream ended"));

  Stream other(0);
  StillPictures more(other, 60);
  std::stop_source stop;
  std::thread stopper([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop.request_stop();
  });
  const double asked_s = HostNow();
  const auto stopped = more.Take(stop.get_token());
  stopper.join();
  ASSERT_THAT(stopped, FailsWith(ErrorKind::kInterrupted));
  EXPECT_LT(HostNow() - asked_s, 5);
}

}  // namespace
}  // namespace trammel::procedure
