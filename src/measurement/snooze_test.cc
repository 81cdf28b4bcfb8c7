#include "measurement/snooze.h"

#include <gtest/gtest.h>

#include "files/new_file.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using measurement::Instrument;
using measurement::Subject;

TEST(Snooze, TheLastLineThatMeansAThingHolds) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / kSnoozedFile;
  const Subject pla{"printer.local", "0.40", "PLA"};
  const Subject petg{"printer.local", "0.40", "PETG"};
  EXPECT_EQ(SnoozedUntil(path, Instrument::kTap, pla).value(), "");
  ASSERT_TRUE(NoteSnooze(path, {"2030-01-01T00:00:00Z", Instrument::kPressureAdvance, {}}));
  EXPECT_EQ(SnoozedUntil(path, Instrument::kTap, pla).value(), "");
  EXPECT_EQ(SnoozedUntil(path, Instrument::kPressureAdvance, pla).value(), "2030-01-01T00:00:00Z");
  ASSERT_TRUE(NoteSnooze(path, {"2031-01-01T00:00:00Z", {}, {.filament = "PLA"}}));
  EXPECT_EQ(SnoozedUntil(path, Instrument::kPressureAdvance, pla).value(), "2031-01-01T00:00:00Z");
  EXPECT_EQ(SnoozedUntil(path, Instrument::kPressureAdvance, petg).value(), "2030-01-01T00:00:00Z");
}

TEST(Snooze, PassesOverLinesThatAreNone) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / kSnoozedFile;
  ASSERT_TRUE(NoteSnooze(path, {"2030-01-01T00:00:00Z", {}, {}}));
  for (const char* line :
       {"{", "[]", "{\"format\":2}", "{\"format\":1,\"until\":3}",
        R"({"format":1,"until":"2040-01-01T00:00:00Z","instrument":"sundial"})"}) {
    ASSERT_TRUE(AppendLine(path, line));
  }
  EXPECT_EQ(SnoozedUntil(path, Instrument::kTap, {}).value(), "2030-01-01T00:00:00Z");
}

}  // namespace
}  // namespace trammel::files
