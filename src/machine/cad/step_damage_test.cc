// Damaged files: whatever a byte turns into, the answer is a refusal or a solid, never the end of
// this process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "base/random.h"
#include "machine/cad/step_file.h"
#include "support/step_text.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

// Flips a bit or replaces a byte of the DATA section at random.
std::string Damaged(std::string text, Random& random) {
  const std::size_t begin = text.find("DATA;");
  const auto at = begin + static_cast<std::size_t>(
                              random.Uniform(0, static_cast<double>(text.size() - begin) - 1));
  if (random.Uniform(0, 1) < 0.5) {
    text[at] = static_cast<char>(text[at] ^ (1 << static_cast<int>(random.Uniform(0, 8))));
  } else {
    constexpr char kOthers[] = "0123456789.,()#'*$=;-E AZ";
    text[at] = kOthers[static_cast<std::size_t>(random.Uniform(0, sizeof kOthers - 1))];
  }
  return text;
}

TEST(StepDamage, EveryDamageIsRefusedOrRead) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "damaged.step";
  Random random(77'001);
  constexpr int kRounds = 60;
  int refused = 0;
  for (int i = 0; i < kRounds; ++i) {
    test::StepBlock block;
    block.freeform = i % 2 == 0;
    test::WriteWhole(path, Damaged(test::StepText({block}, i % 3 == 0 ? "mm" : "inch"), random));
    refused += ReadStepFile(path) ? 0 : 1;
  }
  EXPECT_LT(refused, kRounds);
  EXPECT_GT(refused, kRounds / 4);
}

}  // namespace
}  // namespace trammel::machine
