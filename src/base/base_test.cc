#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <cmath>
#include <limits>
#include <thread>
#include <vector>

#include "base/frame.h"
#include "base/measured.h"
#include "base/random.h"
#include "base/statistics.h"
#include "base/thread_priority.h"

namespace trammel {
namespace {

TEST(Measured, HoldsANumberOnlyWhenGood) {
  const Measured good = Measured::Good({0.04, 0.001, {0.038, 0.042}});
  EXPECT_TRUE(good.good());
  EXPECT_DOUBLE_EQ(good.quantity().value, 0.04);
  EXPECT_TRUE(good.reason().empty());
  const Measured unsure = Measured::CannotTell("the lines do not differ");
  EXPECT_FALSE(unsure.good());
  EXPECT_THROW((void)unsure.quantity(), Bug);
  EXPECT_EQ(Measured().verdict(), Verdict::kRefused);
}

TEST(Measured, RefusesAnIntervalThatDoesNotHoldItsValue) {
  EXPECT_THROW((void)Measured::Good({1.0, 0.1, {1.1, 1.2}}), Bug);
  EXPECT_THROW((void)Measured::Good({std::nan(""), 0.1, {0, 1}}), Bug);
}

TEST(Random, GivesTheSameSequenceForTheSameSeed) {
  Random a(7);
  Random b(7);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.Bits(), b.Bits());
  EXPECT_NE(Random(7).Bits(), Random(8).Bits());
  EXPECT_NE(Random(7).Fork(0).Bits(), Random(7).Fork(1).Bits());
}

TEST(Random, NormalHasUnitVarianceAndNoMean) {
  Random random(1);
  constexpr int kCount = 100000;
  std::vector<double> sample(kCount);
  for (double& value : sample) value = random.Normal();
  constexpr double kSigmas = 5;
  EXPECT_NEAR(Mean(sample), 0, kSigmas / std::sqrt(kCount));
  EXPECT_NEAR(StandardDeviation(sample), 1, kSigmas / std::sqrt(2.0 * kCount));
}

TEST(Random, BelowReachesEveryValueAndNoOther) {
  Random random(3);
  std::vector<int> count(5);
  for (int i = 0; i < 5000; ++i) ++count.at(random.Below(5));
  for (const int n : count) EXPECT_NEAR(n, 1000, 150);
}

TEST(Statistics, MedianSlopeLeavesOutWhatIsNotFinite) {
  const std::vector<double> x{0, 1, 1, 2, 3}, y{1, 3, 3, 5, std::nan("")};
  EXPECT_DOUBLE_EQ(MedianSlope(x, y), 2);
  EXPECT_EQ(MedianSlope(std::vector<double>{1, 1}, std::vector<double>{0, 5}), 0);
}

TEST(Statistics, MedianAndQuantilesInterpolate) {
  EXPECT_DOUBLE_EQ(Median(std::vector<double>{3, 1, 2}), 2);
  EXPECT_DOUBLE_EQ(Median(std::vector<double>{4, 1, 2, 3}), 2.5);
  EXPECT_DOUBLE_EQ(Quantile(std::vector<double>{0, 10}, 0.25), 2.5);
}

TEST(Statistics, RobustStandardDeviationIgnoresAnOutlier) {
  Random random(5);
  std::vector<double> sample(1001);
  for (double& value : sample) value = random.Normal(10, 2);
  sample[500] = 1e9;
  EXPECT_NEAR(RobustStandardDeviation(sample), 2, 0.3);
}

TEST(Statistics, StudentTMatchesThePublishedTable) {
  // NIST/SEMATECH e-Handbook, table 1.3.6.7.2.
  EXPECT_NEAR(StudentT95(1), 12.706, 1e-3);
  EXPECT_NEAR(StudentT95(5), 2.571, 1e-3);
  EXPECT_NEAR(StudentT95(30), 2.042, 1e-3);
  EXPECT_NEAR(StudentT95(120), 1.9799, 1e-4);
  EXPECT_NEAR(StudentT95(1e7), 1.960, 1e-3);
  // Fisher & Yates: two-sided 0.01 and 0.001.
  EXPECT_NEAR(StudentPoint(0.01, 5), 4.0321, 1e-4);
  EXPECT_NEAR(StudentPoint(0.001, 20), 3.8495, 1e-4);
  EXPECT_NEAR(StudentPoint(0.5, 1), 1, 1e-12);  // Cauchy's quartile
}

TEST(Statistics, StudentTFallsToTheNormalQuantileWithoutABreak) {
  double last = StudentT95(1);
  for (double freedom = 1.1; freedom < 1e12; freedom *= 1.1) {
    const double t = StudentT95(freedom);
    EXPECT_LE(t, last + 1e-12) << freedom;
    EXPECT_GE(t, 1.9599639) << freedom;
    last = t;
  }
  EXPECT_NEAR(StudentT95(100), StudentT95(100.0001), 2e-7);
}

TEST(ChiSquare, QuantilesAreThoseOfTheTables) {
  // Printed tables (Pearson & Hartley): 0.95 and 0.999.
  EXPECT_NEAR(ChiSquareQuantile(0.95, 1), 3.841459, 1e-5);
  EXPECT_NEAR(ChiSquareQuantile(0.95, 9), 16.918978, 1e-5);
  EXPECT_NEAR(ChiSquareQuantile(0.999, 9), 27.877165, 1e-5);
  EXPECT_NEAR(ChiSquareQuantile(0.05, 9), 3.325113, 1e-5);
  EXPECT_NEAR(ChiSquareQuantile(0.95, 100), 124.342113, 1e-4);
}

TEST(ChiSquare, TailsAreExactWithTwoDegreesAndFallWithTheValue) {
  EXPECT_NEAR(ChiSquareTail(2 * std::log(2.0), 2), 0.5, 1e-14);
  EXPECT_NEAR(ChiSquareTail(2 * std::log(1000.0), 2), 0.001, 1e-15);
  EXPECT_EQ(ChiSquareTail(std::numeric_limits<double>::infinity(), 3), 0);
}

TEST(ChiSquare, WithoutASumOrAFreedomNothingIsUnlikely) {
  EXPECT_EQ(ChiSquareTail(0, 3), 1);
  EXPECT_EQ(ChiSquareTail(std::numeric_limits<double>::quiet_NaN(), 3), 1);
  EXPECT_EQ(ChiSquareTail(100, 0), 1);
  EXPECT_THROW((void)ChiSquareQuantile(0.95, 0), Bug);
}

TEST(Frame, CropLooksIntoTheSamePixelsAndStaysInside) {
  Frame frame(4, 3);
  frame.row(1)[2 * 3] = 99;
  EXPECT_EQ(Crop(frame.view(), {2, 1, 2, 2}).row(0)[0], 99);
  EXPECT_THROW((void)Crop(frame.view(), {3, 0, 2, 1}), Bug);
  EXPECT_THROW((void)Crop(frame.view(), {-1, 0, 2, 1}), Bug);
}

TEST(ThreadPriority, RaisesTheCallingThreadAloneOrSaysWhyNot) {
  const auto policy = [] {
    int now = 0;
    sched_param parameters{};
    pthread_getschedparam(pthread_self(), &now, &parameters);
    return now;
  };
  const int before = policy();
  ThreadPriority fetching;
  int while_fetching = 0;
  std::thread([&] {
    fetching = RaiseThisThread(ThreadUrgency::kFetching);
    while_fetching = policy();
  }).join();
  EXPECT_EQ(policy(), before);
  EXPECT_FALSE(fetching.text.empty());
  EXPECT_EQ(while_fetching == SCHED_RR, fetching.text == "round robin");
  EXPECT_EQ(!fetching.raised, fetching.text.find("LimitRTPRIO") != std::string::npos);
}

TEST(ThreadPriority, IsTakenBackFromAThreadThatWorksInsteadOfSleeping) {
  ThreadPriority idle, busy;
  int policy = -1;
  std::thread([&] {
    PriorityWatch watch(RaiseThisThread(ThreadUrgency::kFetching));
    (void)watch.Look(1);
    idle = watch.Look(3);  // two seconds later by the watch's clock, and no work was done
    const auto worked_s = [] {
      timespec worked{};
      clock_gettime(CLOCK_THREAD_CPUTIME_ID, &worked);
      return static_cast<double>(worked.tv_sec) + 1e-9 * static_cast<double>(worked.tv_nsec);
    };
    const double enough_s = worked_s() + 0.6;
    while (worked_s() < enough_s) {
    }
    busy = watch.Look(4);
    sched_param parameters{};
    pthread_getschedparam(pthread_self(), &policy, &parameters);
  }).join();
  EXPECT_FALSE(busy.raised);
  EXPECT_EQ(policy, SCHED_OTHER);
  if (!idle.raised) GTEST_SKIP() << "no priority to take back: " << idle.text;
  EXPECT_NE(busy.text.find("taken back"), std::string::npos) << busy.text;
}

}  // namespace
}  // namespace trammel
