// Damaged files: whatever a byte turns into, the answer is a refusal or a solid, never the end of
// this process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "base/random.h"
#include "machine/cad/step_file.h"
#include "support/step_text.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

int Count(const char* name, int otherwise) {
  const char* const said = std::getenv(name);
  return said != nullptr ? std::atoi(said) : otherwise;
}

// Of one bit or another byte somewhere in the data.
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
  Random random(static_cast<std::uint64_t>(Count("TRAMMEL_STEP_SEED", 77'001)));
  const int rounds = Count("TRAMMEL_STEP_DAMAGES", 60);
  int read = 0;
  int refused = 0;
  int crashed = 0;
  for (int i = 0; i < rounds; ++i) {
    const char* const unit = i % 3 == 0 ? "mm" : i % 3 == 1 ? "inch" : "m";
    test::StepBlock block;
    block.freeform = i % 2 == 0;
    const std::string whole = test::StepText({block}, unit);
    const std::string text = Damaged(whole, random);
    test::WriteWhole(path, text);
    const auto solid = ReadStepFile(path);
    if (!solid) {
      ++refused;
      if (solid.error().message.find("without a word") != std::string::npos) ++crashed;
      continue;
    }
    ++read;
  }
  RecordProperty("read", read);
  RecordProperty("refused", refused);
  RecordProperty("reader_died", crashed);
  std::printf("%d damaged files: %d read, %d refused, in %d of them the reader died\n", rounds,
              read, refused, crashed);
  EXPECT_GT(read, 0);
  EXPECT_GT(refused, rounds / 4);
}

TEST(StepDamage, CutAtAnyByteItIsRefused) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "cut.step";
  Random random(77'002);
  const std::string text = test::StepText({{}}, "inch");
  for (int i = 0; i < 300; ++i) {
    const auto bytes =
        static_cast<std::size_t>(random.Uniform(0, static_cast<double>(text.size()) - 2));
    test::WriteWhole(path, text.substr(0, bytes));
    const auto solid = ReadStepFile(path);
    ASSERT_FALSE(solid) << bytes;
  }
}

}  // namespace
}  // namespace trammel::machine
