// The exit codes of commands that end otherwise than they should.
#include <gtest/gtest.h>

#include <thread>

#include "app/commands.h"
#include "base/bug_note.h"
#include "base/check.h"

namespace trammel::app {
namespace {

// First: what is noted in a process stays noted.
TEST(ExitCode, ACommandWithoutABugEndsWithItsOwnCode) {
  EXPECT_EQ(ExitCodeOf([] { return static_cast<int>(kExitNotTrusted); }), kExitNotTrusted);
}

TEST(ExitCode, ABugHasOneOfItsOwnOnWhateverThreadItWas) {
  EXPECT_EQ(ExitCodeOf([]() -> int { throw Bug("here"); }), 70);
  EXPECT_EQ(ExitCodeOf([] {
              std::thread([] { (void)NoteBug([] { throw Bug("there"); }); }).join();
              return static_cast<int>(kExitGood);
            }),
            70);
}

}  // namespace
}  // namespace trammel::app
