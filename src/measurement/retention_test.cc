#include "measurement/retention.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "measurement/outcome_file.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::size_t kVideo_bytes = 200'000;

class Retention : public testing::Test {
 protected:
  fs::path Recorded(int day, bool with_result = true) const {
    const fs::path folder = root_.path() / ("pressure_advance-2026010" + std::to_string(day));
    fs::create_directories(folder / "validation");
    test::WriteWhole(folder / "line0.avi", std::string(kVideo_bytes, 'v'));
    test::WriteWhole(folder / "validation" / "line0.avi", std::string(kVideo_bytes, 'v'));
    test::WriteWhole(folder / "report.html", std::string(kVideo_bytes, 'h'));
    test::WriteWhole(folder / "scan.json", "{}");
    if (!with_result) return folder;
    measurement::Outcome outcome;
    outcome.provenance = {measurement::Instrument::kPressureAdvance,
                          "trammel",
                          "2026-01-0" + std::to_string(day) + "T00:00:00Z",
                          {}};
    outcome.answers = {{"pressure_advance", "s", Measured::Good({0.04, 0.001, {0.038, 0.042}})}};
    EXPECT_TRUE(KeepOutcome(folder, outcome));
    return folder;
  }

  test::TemporaryFolder root_;
};

TEST_F(Retention, TakesTheOldestRawDataAndNothingElse) {
  const fs::path old = Recorded(1), younger = Recorded(2), newest = Recorded(3);
  const auto plan = PlanPruning(root_.path(), 5 * kVideo_bytes + 100'000, 1);
  ASSERT_TRUE(plan) << plan.error().message;
  ASSERT_THAT(plan->gone, SizeIs(2));
  EXPECT_EQ(plan->gone[0].folder, old);
  EXPECT_EQ(plan->gone[0].bytes, 2 * kVideo_bytes);
  EXPECT_EQ(plan->bytes_before - plan->bytes_after, 4 * kVideo_bytes);
  EXPECT_TRUE(fs::exists(old / "line0.avi"));  // it is a plan
  ASSERT_TRUE(Prune(*plan));
  EXPECT_FALSE(fs::exists(old / "line0.avi"));
  EXPECT_FALSE(fs::exists(younger / "validation" / "line0.avi"));
  for (const fs::path& folder : {old, younger, newest}) {
    EXPECT_TRUE(fs::exists(folder / "result.json"));
    EXPECT_TRUE(fs::exists(folder / "report.html"));
    EXPECT_TRUE(fs::exists(folder / "scan.json"));
  }
  EXPECT_TRUE(fs::exists(newest / "line0.avi"));
  const auto again = PlanPruning(root_.path(), 0, 1);
  ASSERT_TRUE(again);
  EXPECT_THAT(again->gone, IsEmpty());  // the newest stays, whatever the budget
}

TEST_F(Retention, TakesNothingWithinTheBudget) {
  Recorded(1);
  const auto plan = PlanPruning(root_.path(), 10 * kVideo_bytes, 0);
  ASSERT_TRUE(plan);
  EXPECT_THAT(plan->gone, IsEmpty());
  EXPECT_EQ(plan->bytes_after, plan->bytes_before);
}

// What is at work has no result yet; links may lead anywhere; others' folders are others'.
TEST_F(Retention, LeavesWhatIsNotItsOwn) {
  const fs::path at_work = Recorded(1, false);
  const test::TemporaryFolder elsewhere;
  test::WriteWhole(elsewhere.path() / "mine.avi", std::string(kVideo_bytes, 'm'));
  const fs::path linking = Recorded(2);
  fs::create_symlink(elsewhere.path() / "mine.avi", linking / "link.avi");
  fs::create_directory_symlink(elsewhere.path(), linking / "link");
  for (const char* name : {"notes.pdf", "IMG_1.jpg", "model.3mf", "setup.png", "marking.jpg"}) {
    test::WriteWhole(linking / name, std::string(kVideo_bytes, 'n'));
  }
  const fs::path inner = linking / "inner";
  fs::create_directory(inner);
  test::WriteWhole(inner / "line0.avi", std::string(kVideo_bytes, 'i'));
  test::WriteWhole(inner / "result.json", "{}");
  fs::create_directory_symlink(linking, root_.path() / "again");
  test::WriteWhole(root_.path() / "loose.avi", std::string(kVideo_bytes, 'l'));
  const auto plan = PlanPruning(root_.path(), 0, 0);
  ASSERT_TRUE(plan);
  ASSERT_THAT(plan->gone, SizeIs(1));
  EXPECT_EQ(plan->gone[0].folder, linking);
  EXPECT_THAT(plan->gone[0].files, SizeIs(2));
  ASSERT_TRUE(Prune(*plan));
  EXPECT_TRUE(fs::exists(elsewhere.path() / "mine.avi"));
  EXPECT_TRUE(fs::exists(at_work / "line0.avi"));
  EXPECT_TRUE(fs::exists(root_.path() / "loose.avi"));
  EXPECT_TRUE(fs::exists(linking / "IMG_1.jpg"));
  EXPECT_TRUE(fs::exists(inner / "line0.avi"));
  EXPECT_EQ(plan->without_result, 1);
}

// A picture of a user's may have a name that recordings give, and a video any.
TEST_F(Retention, LeavesAUsersPictureUnderARecordingsName) {
  const fs::path folder = Recorded(1);
  const std::string bytes(kVideo_bytes, 'p');
  for (const char* name :
       {"mark-01.png", "view-02.jpg", "plate.jpg", "step-3.png", "holiday.avi"}) {
    test::WriteWhole(folder / name, bytes);
  }
  const auto of_result = fs::last_write_time(folder / "result.json");
  using std::chrono::hours;
  fs::last_write_time(folder / "mark-01.png", of_result - std::chrono::minutes(5));
  fs::last_write_time(folder / "view-02.jpg", of_result + hours(1));
  fs::last_write_time(folder / "plate.jpg", of_result - hours(24 * 30));
  fs::last_write_time(folder / "step-3.png", of_result + std::chrono::minutes(1));
  const auto plan = PlanPruning(root_.path(), 0, 0);
  ASSERT_TRUE(plan);
  ASSERT_TRUE(Prune(*plan));
  EXPECT_FALSE(fs::exists(folder / "line0.avi"));
  EXPECT_FALSE(fs::exists(folder / "mark-01.png"));
  for (const char* name : {"view-02.jpg", "plate.jpg", "step-3.png", "holiday.avi"}) {
    EXPECT_TRUE(fs::exists(folder / name)) << name;
  }
}

TEST_F(Retention, WantsAFolder) {
  const auto plan = PlanPruning(root_.path() / "nowhere", 0, 0);
  ASSERT_FALSE(plan);
  EXPECT_THAT(plan.error().message, HasSubstr("is no folder of recordings"));
}

}  // namespace
}  // namespace trammel::files
