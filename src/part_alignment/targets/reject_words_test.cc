#include "part_alignment/targets/reject_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

namespace trammel::part_alignment {
namespace {

TEST(RejectWords, EveryReasonHasWordsOfItsOwnAndNoName) {
  std::set<std::string> all;
  for (const RejectReason reason :
       {RejectReason::kMirrored, RejectReason::kWrongCode, RejectReason::kDoubled,
        RejectReason::kHidden, RejectReason::kAtBorder, RejectReason::kTooSmall,
        RejectReason::kSaturated, RejectReason::kDamaged}) {
    const std::string words = WordsFor(reason);
    EXPECT_THAT(words, testing::Not(testing::HasSubstr("_")));
    EXPECT_GT(words.size(), 20U) << words;
    EXPECT_TRUE(all.insert(words).second) << words;
  }
}

}  // namespace
}  // namespace trammel::part_alignment
