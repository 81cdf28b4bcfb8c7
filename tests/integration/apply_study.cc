// trammel pa apply, killed at 200 moments.
#include <gtest/gtest.h>

#include <cstdio>

#include "apply_kills.h"

namespace trammel::test {
namespace {

TEST(ApplyStudy, KilledAt200MomentsLeavesTheOldValueOrTheNewOneAndARecordOfIt) {
  const KilledApplies killed = KillApplies(200, 7321);
  std::printf("of 200 killed runs %d had noted nothing, %d were open, %d were noted to their end\n",
              killed.unnoted, killed.open, killed.finished);
  EXPECT_GE(killed.open, 1);  // else the moments miss what they are about
}

}  // namespace
}  // namespace trammel::test
