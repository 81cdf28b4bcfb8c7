#include "base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace trammel {
namespace {

TEST(ParallelFor, DoesEachPieceOnce) {
  for (const int count : {0, 1, 2, 7, 1000}) {
    for (const int threads : {1, 2, 64}) {
      std::vector<int> done(static_cast<std::size_t>(count));
      ParallelFor(
          count, [&](int i) { ++done[static_cast<std::size_t>(i)]; }, threads);
      EXPECT_EQ(done, std::vector<int>(static_cast<std::size_t>(count), 1));
    }
  }
}

TEST(ParallelFor, StaysOnTheCallersThreadWhereItIsTold) {
  std::set<std::thread::id> threads;
  ParallelFor(
      50, [&](int) { threads.insert(std::this_thread::get_id()); }, 1);
  EXPECT_EQ(threads, std::set{std::this_thread::get_id()});
}

TEST(ParallelFor, ThrowsOnWhatAPieceThrowsAndBeginsNoMore) {
  std::atomic<int> begun{0};
  const auto work = [&](int i) {
    ++begun;
    if (i == 10) throw std::runtime_error("piece");
  };
  EXPECT_THROW(ParallelFor(1'000'000, work), std::runtime_error);
  EXPECT_LT(begun, 1'000'000);
  begun = 0;
  EXPECT_THROW(ParallelFor(1'000'000, work, 1), std::runtime_error);
  EXPECT_EQ(begun, 11);
}

}  // namespace
}  // namespace trammel
