#include "pressure_advance/commands/setup_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "support/temporary_folder.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using test::ReadWhole;
using test::WriteWhole;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kFocus_mm = 17.5;

Measured Known(double value) { return Measured::Good({value, 0.01, {value - 0.02, value + 0.02}}); }

pressure_advance::SetupResult Measurement() {
  pressure_advance::SetupResult result;
  result.focus_mm = Known(kFocus_mm);
  result.offset = {Known(28.123), Known(50.456)};
  result.scale.px_per_mm = Known(41.5);
  result.height.px_per_height_mm = Known(35);
  result.scan_angle_rad = Known(0.7);
  result.crop = PixelRect{800, 300, 60, 110};
  return result;
}

class WriteCamera : public ::testing::Test {
 protected:
  [[nodiscard]] fs::path path() const { return folder_.path() / "trammel.toml"; }
  test::TemporaryFolder folder_;
};

TEST_F(WriteCamera, KeepsEverythingElseAndTheFileAsItWas) {
  const std::string before =
      "# mine\n[filament]\nmaterial = \"pla\"\n\n[camera]\nfps = 60\noffset_x = 27\n";
  WriteWhole(path(), before);
  const auto target = ReadCameraTarget(path());
  ASSERT_TRUE(target) << target.error().message;
  const auto backup = WriteCameraTarget(*target, Measurement(), kFocus_mm);
  ASSERT_TRUE(backup) << backup.error().message;
  EXPECT_EQ(ReadWhole(*backup), before);
  EXPECT_THAT(
      ReadWhole(path()),
      AllOf(HasSubstr("# mine\n[filament]\nmaterial = \"pla\"\n"), HasSubstr("fps = 60"),
            HasSubstr("\noffset_x = 28.123\n"), HasSubstr("\nfocus_height = 17.5\n"),
            HasSubstr("\npx_per_mm_sigma = 0.01\n"), HasSubstr("\nlaser_angle_sigma = 0.573\n"),
            HasSubstr("# before pa setup: offset_x = 27")));
}

TEST_F(WriteCamera, MakesAFileThatIsNotThere) {
  const auto target = ReadCameraTarget(path());
  ASSERT_TRUE(target);
  const auto backup = WriteCameraTarget(*target, Measurement(), kFocus_mm);
  ASSERT_TRUE(backup) << backup.error().message;
  EXPECT_EQ(*backup, "");
  EXPECT_THAT(ReadWhole(path()), HasSubstr("[camera]\noffset_x = 28.123\n"));
}

TEST_F(WriteCamera, LeavesAFileAloneThatChangedMeanwhile) {
  WriteWhole(path(), "[camera]\nfps = 60\n");
  const auto target = ReadCameraTarget(path());
  ASSERT_TRUE(target);
  const std::string changed = "[camera]\nfps = 30\n";
  WriteWhole(path(), changed);
  const auto backup = WriteCameraTarget(*target, Measurement(), kFocus_mm);
  ASSERT_FALSE(backup);
  EXPECT_THAT(backup.error().message, HasSubstr("was changed"));
  EXPECT_EQ(ReadWhole(path()), changed);
}

TEST_F(WriteCamera, LeavesAFileAloneWhoseSectionItDoesNotUnderstand) {
  const std::string inline_table = "camera = {fps = 60, offset_x = 27}\n";
  WriteWhole(path(), inline_table);
  const auto target = ReadCameraTarget(path());  // before anything is heated
  ASSERT_FALSE(target);
  EXPECT_THAT(target.error().message, HasSubstr("a line for each key"));
  const auto backup = WriteCameraTarget({path(), inline_table}, Measurement(), kFocus_mm);
  ASSERT_FALSE(backup);
  EXPECT_THAT(backup.error().message, HasSubstr("copy the lines by hand"));
  EXPECT_EQ(ReadWhole(path()), inline_table);
}

TEST_F(WriteCamera, AFileThatOnlyItsOwnerReadsStaysSo) {
  WriteWhole(path(), "[moonraker]\n");
  fs::permissions(path(), fs::perms::owner_read | fs::perms::owner_write);
  const auto target = ReadCameraTarget(path());
  ASSERT_TRUE(target);
  const auto backup = WriteCameraTarget(*target, Measurement(), kFocus_mm);
  ASSERT_TRUE(backup) << backup.error().message;
  for (const fs::path& file : {path(), fs::path(*backup)}) {
    EXPECT_EQ(fs::status(file).permissions() & (fs::perms::group_all | fs::perms::others_all),
              fs::perms::none)
        << file;
  }
}

TEST_F(WriteCamera, WhatIsNoSettingsFileIsRefusedBeforeAnythingIsMeasured) {
  WriteWhole(path(), "[camera]\nofset_x = 3\n");
  EXPECT_FALSE(ReadCameraTarget(path()));
  EXPECT_FALSE(ReadCameraTarget(folder_.path()));
}

// A mount that moved shows in the history of its printer.
TEST(PrintSetup, KeepsTheResultAndSaysWhatChanged) {
  const test::TemporaryFolder folder;
  procedure::SetupRecord record;
  std::string text;
  for (int run = 0; run < 5; ++run) {
    record.result = Measurement();
    if (run == 4) record.result.offset.x_mm = Known(28.6);
    SetupOutput output;
    output.printer = "printer.local";
    output.folder = folder.path() / ("camera_setup-" + std::to_string(run));
    fs::create_directory(output.folder);
    ::testing::internal::CaptureStdout();
    EXPECT_EQ(PrintSetup(record, output), 0);
    text = ::testing::internal::GetCapturedStdout();
    EXPECT_THAT(ReadWhole(output.folder / "result.json"),
                AllOf(HasSubstr("camera_setup"), HasSubstr("offset_x")));
    if (run == 3) {
      EXPECT_THAT(text, HasSubstr("as before         6 of 6 values"));
    }
  }
  EXPECT_THAT(text, AllOf(HasSubstr("changed           offset_x: "),
                          HasSubstr("as before         5 of 6 values")));
}

}  // namespace
}  // namespace trammel::app
