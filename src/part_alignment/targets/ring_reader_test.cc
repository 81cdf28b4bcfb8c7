#include "part_alignment/targets/ring_reader.h"

#include <gtest/gtest.h>

#include "part_alignment/targets/ring_finder.h"
#include "support/target_picture.h"

namespace trammel::part_alignment {
namespace {

TEST(RingReader, NamesADiscInAClosedRing) {
  for (const int bits : {12, 14, 20}) {
    const CodeBook book = MakeCodeBook(bits).value();
    const std::uint32_t all_ink = (1U << bits) - 1;
    EXPECT_FALSE(TargetNumber(book, all_ink));
    test::DrawnTarget target = test::AffineTarget(60, 60, 12, 0.5, 1, 2);
    target.bits = bits;
    target.word = all_ink;
    Random random(3);
    const Page page = test::Expose(test::Draw(120, 120, {target}, {}), 1, random);
    FinderWorkspace workspace;
    const auto found = FindTargets(page.view(), book, {}, workspace);
    ASSERT_TRUE(found);
    EXPECT_TRUE(found->targets.empty());
    ASSERT_EQ(found->rejected.size(), 1);
    EXPECT_EQ(found->rejected[0].reason, RejectReason::kWrongCode);
  }
}

}  // namespace
}  // namespace trammel::part_alignment
