#include "tap/contact/break_search.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trammel::tap {
namespace {

struct Found {
  Minimum minimum;
  int asked = 0;
};

template <class Cost>
Found Search(double left, double middle, double right, double tolerance, const Cost& cost) {
  Found found;
  found.minimum = FindMinimum(
      {left, cost(left)}, {middle, cost(middle)}, {right, cost(right)},
      [&](double t) {
        ++found.asked;
        return cost(t);
      },
      [tolerance](double) { return tolerance; });
  return found;
}

TEST(BreakSearch, FindsAMinimumWithinTheToleranceByFewPoints) {
  constexpr double kTolerance = 1e-4;
  constexpr int kFew = 7;
  for (const double t : {0.3117, 0.35, 0.3999, 0.43}) {
    // Skewed, as sums of squares along the break are.
    const Found found = Search(0.3, 0.37, 0.45, kTolerance,
                               [t](double x) { return (x - t) * (x - t) * (1 + 2 * (x - t)) + 5; });
    EXPECT_NEAR(found.minimum.t, t, kTolerance) << "t = " << t;
    EXPECT_LE(found.asked, kFew) << "t = " << t;
  }
}

TEST(BreakSearch, FindsTheEdgeOfWhatIsAllowed) {
  constexpr double kTolerance = 1e-4;
  const Found found =
      Search(0.3, 0.37, 0.45, kTolerance, [](double x) { return x < 0.3333 ? kNever : x; });
  EXPECT_NEAR(found.minimum.t, 0.3333, 3 * kTolerance);
}

}  // namespace
}  // namespace trammel::tap
