// trammel pa study, from the shell: parts of it make the whole, and what is there is not done
// again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "support/run_trammel.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;

using test::CommandResult;
using test::ReadWhole;
using test::RunTrammel;
using test::TemporaryFolder;
using test::WriteWhole;
using ::testing::HasSubstr;

constexpr const char* kTwo =
    "pa study --patterns 1 --condition matte-black-dark --condition matte-white-dark ";

TEST(StudyCommand, GoesOnAfterAKillAndInShardsWithTheBytesOfOneRun) {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& arguments) {
    return RunTrammel(kTwo + arguments, folder.path());
  };
  const CommandResult whole = run("--out whole");
  ASSERT_EQ(whole.exit_code, 0) << whole.output;
  EXPECT_THAT(whole.output, HasSubstr("seed 1000: 2 of 2 scans in whole"));
  const fs::path black = folder.path() / "whole/scan-matte-black-dark-000.json";
  const fs::path white = folder.path() / "whole/scan-matte-white-dark-000.json";
  EXPECT_TRUE(fs::is_regular_file(folder.path() / "whole/study_17_deviation.png"));
  EXPECT_TRUE(fs::is_regular_file(folder.path() / "whole/validation-matte-white-dark.json"));
  EXPECT_FALSE(fs::exists(folder.path() / "whole/work"));
  const std::string first = ReadWhole(black);

  // Killed in the second scan: its result is not there, its recording is, in part.
  const auto kept = fs::last_write_time(white);
  fs::remove(black);
  fs::create_directories(folder.path() / "whole/work/scan-matte-black-dark-000.json");
  WriteWhole(folder.path() / "whole/work/scan-matte-black-dark-000.json/line0.avi", "RIFF");
  const CommandResult again = run("--out whole");
  ASSERT_EQ(again.exit_code, 0) << again.output;
  EXPECT_EQ(ReadWhole(black), first);
  EXPECT_EQ(fs::last_write_time(white), kept);

  const CommandResult part = run("--shard 2/2 --out parts");
  ASSERT_EQ(part.exit_code, 0) << part.output;
  EXPECT_THAT(part.output, HasSubstr("1 of 2 scans"));
  EXPECT_FALSE(fs::exists(folder.path() / "parts/scan-matte-black-dark-000.json"));
  EXPECT_EQ(ReadWhole(folder.path() / "parts/scan-matte-white-dark-000.json"), ReadWhole(white));

  const CommandResult other = run("--seed 1001 --report --out whole");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.output, HasSubstr("another seed"));
}

TEST(StudyCommand, RefusesAShardThatIsNone) {
  const TemporaryFolder folder;
  for (const char* shard : {"0/2", "3/2", "2", "1/2/3", "1/1001"}) {
    const CommandResult run =
        RunTrammel(std::string("pa study --out new --shard ") + shard, folder.path());
    EXPECT_EQ(run.exit_code, 1) << shard;
    EXPECT_THAT(run.output, HasSubstr("--shard")) << shard;
  }
  EXPECT_FALSE(fs::exists(folder.path() / "new"));
}

}  // namespace
}  // namespace trammel
