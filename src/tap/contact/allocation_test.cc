// Counts every allocation of this executable; hence a test of its own.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "support/sanitized.h"
#include "tap/analyse/analyse.h"
#include "tap/contact/press_test_support.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

#ifndef TRAMMEL_SANITIZED  // it has its own operators
namespace {
void* Count(std::size_t size) {
  ++allocations;
  void* memory = std::malloc(size > 0 ? size : 1);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}
}  // namespace

void* operator new(std::size_t size) { return Count(size); }
void* operator new[](std::size_t size) { return Count(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return Count(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return Count(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
#endif

namespace trammel::tap {
namespace {

class Allocation : public testing::TestWithParam<Method> {};

TEST_P(Allocation, NothingIsAllocatedAfterTheFirstTap) {
  if (trammel::test::kSanitized) GTEST_SKIP() << "a sanitizer's operators count nothing";
  // Includes everything that makes the fit take its longer paths.
  const test::PressWorld worlds[] = {{},
                                     {.hum_g = 8},
                                     {.outlier_share = 0.01},
                                     {.memory = 0.8},
                                     {.onset_lag_mm = 0.006},
                                     {.stiffness_g_mm = 0},
                                     {.law = [](double u) { return u * u; }}};
  std::vector<test::PressTap> taps;
  for (std::uint64_t seed = 1000; seed < 1020; ++seed) {
    for (const test::PressWorld& world : worlds) {
      taps.push_back(test::MakePressTap(world, seed));
    }
  }
  TapAnalyser analyser({.method = GetParam()});
  std::size_t longest = 0;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    longest = taps[i].time_s.size() > taps[longest].time_s.size() ? i : longest;
  }
  (void)analyser.Analyse(taps[longest].View());
  const long before = allocations;
  int good = 0;
  for (const test::PressTap& tap : taps) {
    good += analyser.Analyse(tap.View()).verdict == Verdict::kGood ? 1 : 0;
  }
  EXPECT_EQ(allocations - before, 0);
  EXPECT_GT(good, 0);
}

INSTANTIATE_TEST_SUITE_P(Methods, Allocation, testing::Values(Method::kContact, Method::kTwoLine),
                         [](const auto& p) {
                           return p.param == Method::kContact ? "Contact" : "TwoLine";
                         });

}  // namespace
}  // namespace trammel::tap
