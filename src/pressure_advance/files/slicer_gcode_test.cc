// Patterns of other tools in G-code, recognised by their moves.
#include "pressure_advance/files/slicer_gcode.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zip.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "files/new_file.h"
#include "files/whole_file.h"
#include "pressure_advance/files/gcode_archive.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Two walls a chevron, 0.5 mm apart, on two layers; the first one is slower, its arms shorter.
std::string Chevrons(double x, double y, double speed_mm_s) {
  std::string gcode = fmt::format("M83\nM204 P3000\nG1 X{} Y{} F6000\n", x, y);
  for (const double z : {0.25, 0.45}) {
    const double arm = z < 0.3 ? 18 : 20;
    gcode += fmt::format("G1 Z{} F600\n", z);
    for (int chevron = 0; chevron < 5; ++chevron) {
      gcode += fmt::format("M900 K{:.3f}\n", 0.01 * chevron);
      for (int wall = 0; wall < 2; ++wall) {
        const double x0 = x + 4 * chevron + 0.5 * wall;
        gcode += fmt::format("G0 X{:.3f} Y{:.3f} F9000\n", x0, y);
        const double feed = z < 0.3 ? 1800 : 60 * speed_mm_s;
        gcode += fmt::format("G1 X{:.3f} Y{:.3f} E0.9 F{}\n", x0 + arm, y + arm, feed);
        gcode += fmt::format("G1 X{:.3f} Y{:.3f} E0.9\n", x0, y + 2 * arm);
      }
    }
  }
  return gcode;
}

std::string Lines(bool to_and_fro = false) {
  std::string gcode = "M82\nG92 E0\nSET_VELOCITY_LIMIT ACCEL=2500\nG1 Z0.2 F600\n";
  double e = 0;
  for (int line = 0; line < 6; ++line) {
    const double y = 20 + 3.5 * line;
    const bool back = to_and_fro && line % 2 == 1;
    gcode += fmt::format("SET_PRESSURE_ADVANCE ADVANCE={:.3f}\nG0 X{} Y{} F9000\n", 0.02 * line,
                         back ? 130 : 50, y);
    for (const auto& [x, feed] :
         {std::pair{70, 1200}, std::pair{110, 6000}, std::pair{130, 1200}}) {
      gcode += fmt::format("G1 X{} Y{} E{:.4f} F{}\n", back ? 180 - x : x, y, e += 1, feed);
    }
  }
  return gcode;
}

TEST(SlicerGcode, TellsLinesPrintedToAndFro) {
  for (const bool to_and_fro : {false, true}) {
    const auto print = FindSlicerPatterns(Lines(to_and_fro), "a.gcode");
    ASSERT_TRUE(print.has_value()) << print.error().message;
    EXPECT_EQ(print->patterns.front().to_and_fro, to_and_fro);
  }
}

TEST(SlicerGcode, LinesCountFromTheirRightHandSideHoweverTheyAreTurnedOnThePlate) {
  for (const int quarters : {0, 1, 2, 3}) {
    std::string gcode = "M83\nG1 Z0.2 F600\n";
    const auto to = [&](double x, double y) {
      for (int i = 0; i < quarters; ++i) x = std::exchange(y, x) * -1;  // (x, y) -> (-y, x)
      return fmt::format("X{} Y{}", x, y);
    };
    for (int line = 0; line < 6; ++line) {
      const double y = 20 + 3.5 * line;
      gcode += fmt::format("M900 K{:.3f}\nG0 {} F9000\n", 0.02 * line, to(50, y));
      for (const auto& [x, feed] :
           {std::pair{70, 1200}, std::pair{110, 6000}, std::pair{130, 1200}}) {
        gcode += fmt::format("G1 {} E1 F{}\n", to(x, y), feed);
      }
    }
    const auto print = FindSlicerPatterns(gcode, "a.gcode");
    ASSERT_TRUE(print.has_value()) << print.error().message;
    const SlicerPattern& pattern = print->patterns.front();
    EXPECT_THAT(pattern.pressure_advance_s, ElementsAre(0, 0.02, 0.04, 0.06, 0.08, 0.1))
        << quarters;
    EXPECT_NEAR(pattern.spacing_mm, 3.5, 1e-9);
    EXPECT_FALSE(pattern.to_and_fro);
  }
}

TEST(SlicerGcode, ChevronsAreOneCandidateForTheirWallsOnTheTopLayer) {
  const auto print = FindSlicerPatterns(Chevrons(60, 40, 120), "a.gcode");
  ASSERT_TRUE(print.has_value()) << print.error().message;
  EXPECT_EQ(print->printed_by, (gcode::PrintedBy{gcode::Dialect::kMarlin, 0}));
  ASSERT_EQ(print->patterns.size(), 1U);
  const SlicerPattern& pattern = print->patterns.front();
  EXPECT_EQ(pattern.form, PatternForm::kCorners);
  EXPECT_THAT(pattern.pressure_advance_s, ElementsAre(0, 0.01, 0.02, 0.03, 0.04));
  EXPECT_NEAR(pattern.spacing_mm, 4, 1e-9);
  EXPECT_DOUBLE_EQ(pattern.speed_mm_s, 120);
  EXPECT_EQ(pattern.acceleration_mm_s2, 3000);
  EXPECT_DOUBLE_EQ(pattern.smooth_time_s, 0);
  EXPECT_NEAR(pattern.layer_height_mm.value_or(0), 0.2, 1e-9);
  EXPECT_NEAR(pattern.heading_rad, 0, 1e-9);
}

TEST(SlicerGcode, TheFlowIsThatOfTheFilamentInTheSettings) {
  const auto flow = [](const std::string& settings) {
    const auto print = FindSlicerPatterns(Lines() + settings, "a.gcode");
    return print ? print->patterns.front().flow_mm3_s : 0;
  };
  // 1 mm of filament on 40 mm at 100 mm/s.
  EXPECT_NEAR(flow(""), 2.5 * 2.405, 1e-2);
  EXPECT_NEAR(flow("; filament_diameter = 2.85,1.75\n"), 2.5 * 6.379, 1e-2);
  EXPECT_NEAR(flow("; filament_diameter = 0\n"), 2.5 * 2.405, 1e-2);
}

TEST(SlicerGcode, ABatchIsListedFrontToBackAndLeftToRight) {
  const auto print =
      FindSlicerPatterns(Chevrons(160, 40, 60) + Chevrons(20, 40, 120) + Chevrons(20, 140, 80), "");
  ASSERT_TRUE(print.has_value()) << print.error().message;
  std::vector<double> speeds;
  for (const SlicerPattern& pattern : print->patterns) speeds.push_back(pattern.speed_mm_s);
  EXPECT_THAT(speeds, ElementsAre(120, 60, 80));
}

TEST(SlicerGcode, LinesHaveTheirSegments) {
  const auto print = FindSlicerPatterns(Lines(), "a.gcode");
  ASSERT_TRUE(print.has_value()) << print.error().message;
  EXPECT_EQ(print->printed_by, (gcode::PrintedBy{gcode::Dialect::kKlipper, 0}));
  ASSERT_EQ(print->patterns.size(), 1U);
  const SlicerPattern& pattern = print->patterns.front();
  EXPECT_EQ(pattern.form, PatternForm::kLines);
  EXPECT_THAT(pattern.pressure_advance_s, ElementsAre(0, 0.02, 0.04, 0.06, 0.08, 0.1));
  EXPECT_THAT(pattern.segments,
              ElementsAre(pressure_advance::Segment{0.25, 20}, pressure_advance::Segment{0.5, 100},
                          pressure_advance::Segment{0.25, 20}));
  EXPECT_NEAR(pattern.spacing_mm, 3.5, 1e-9);
  EXPECT_EQ(pattern.acceleration_mm_s2, 2500);
}

TEST(SlicerGcode, TheCommandsTellTheFirmwareOrLeaveItOpen) {
  struct Row {
    const char* before;
    const char* behind;
    std::optional<gcode::PrintedBy> by;
  };
  const Row rows[] = {
      {"M900 K", " L1000 M10", gcode::PrintedBy{gcode::Dialect::kBambu, 0}},
      {"M572 D1 S", "", gcode::PrintedBy{gcode::Dialect::kRepRapFirmware, 1}},
      {"M572 S", "", std::nullopt},
      {"M572 W0.03 S", "", gcode::PrintedBy{gcode::Dialect::kPrusa, 0}},
  };
  for (const Row& row : rows) {
    std::string gcode = Chevrons(60, 40, 120);
    for (std::size_t at = 0; (at = gcode.find("M900 K", at)) != std::string::npos;) {
      gcode.insert(gcode.find('\n', at), row.behind);
      gcode.replace(at, 6, row.before);
      at += 6;
    }
    const auto print = FindSlicerPatterns(gcode, "a.gcode");
    ASSERT_TRUE(print.has_value()) << row.before << print.error().message;
    EXPECT_EQ(print->printed_by, row.by) << row.before;
  }
}

struct Refused {
  const char* name;
  std::string gcode;
  const char* words;
};

TEST(SlicerGcode, RefusesFilesWithoutAPattern) {
  std::string unset = Chevrons(60, 40, 120);
  while (unset.find("M900") != std::string::npos) unset.replace(unset.find("M900"), 4, ";900");
  std::string old_unit = Chevrons(60, 40, 120);
  old_unit.replace(old_unit.rfind("K0.040"), 6, "K60.00");
  const Refused rows[] = {
      {"empty", "", "no nested corners"},
      {"garbage", std::string("\0\xff\x01 G1 X\n=\n", 10) + std::string(100000, 'X'),
       "no nested corners"},
      {"numbers out of range", "G1 X1e999 Ynan E-inf\nG1 X9e99\n", "no nested corners"},
      {"no pressure advance", unset, "no pressure advance is set"},
      {"Marlin's old unit", old_unit, "not between 0 and 10"},
  };
  for (const Refused& row : rows) {
    const auto print = FindSlicerPatterns(row.gcode, "a.gcode");
    ASSERT_FALSE(print.has_value()) << row.name;
    EXPECT_THAT(print.error().message, HasSubstr(row.words)) << row.name;
    EXPECT_THAT(print.error().message, HasSubstr("a.gcode")) << row.name;
  }
}

// Writes a ZIP archive as a slicer does.
std::filesystem::path WriteArchive(
    const std::filesystem::path& path,
    const std::vector<std::pair<std::string, std::string>>& name_and_text) {
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE, nullptr);
  for (const auto& [name, text] : name_and_text) {
    zip_source_t* source = zip_source_buffer(archive, text.data(), text.size(), 0);
    EXPECT_GE(zip_file_add(archive, name.c_str(), source, 0), 0);
  }
  EXPECT_EQ(zip_close(archive), 0);
  return path;
}

TEST(SlicerGcode, AnArchiveGivesThePatternsOfItsPlates) {
  const test::TemporaryFolder folder;
  const auto path = WriteArchive(folder.path() / "batch.gcode.3mf",
                                 {{"3D/3dmodel.model", "<model/>"},
                                  {"Metadata/plate_10.gcode", Chevrons(60, 40, 80)},
                                  {"Metadata/plate_2.gcode", Chevrons(60, 40, 120)},
                                  {"Metadata/plate_1.gcode", "G28\n"}});
  const auto print = ReadSlicerGcode(path);
  ASSERT_TRUE(print.has_value()) << print.error().message;
  std::vector<double> speeds;
  for (const SlicerPattern& pattern : print->patterns) speeds.push_back(pattern.speed_mm_s);
  EXPECT_THAT(speeds, ElementsAre(120, 80));
  EXPECT_EQ(print->patterns.front().plate, "plate_2");
  for (const char* plate : {"10", "plate_10"}) {
    const auto alone = ReadSlicerGcode(path, plate);
    ASSERT_TRUE(alone.has_value()) << alone.error().message;
    ASSERT_EQ(alone->patterns.size(), 1U);
    EXPECT_EQ(alone->patterns.front().speed_mm_s, 80);
  }
  const auto none = ReadSlicerGcode(path, "3");
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().message,
              AllOf(HasSubstr("--plate 3"), HasSubstr("plate_1, plate_2, plate_10")));
}

TEST(SlicerGcode, RefusesArchivesWithoutAPattern) {
  const test::TemporaryFolder folder;
  const auto project = WriteArchive(folder.path() / "project.3mf", {{"3D/3dmodel.model", "<m/>"}});
  const auto other = WriteArchive(folder.path() / "benchy.3mf", {{"plate_1.gcode", "G28\n"}});
  const std::string bytes = files::ReadWholeFile(other, 10'000).value();
  const auto write = [&](const char* name, const std::string& text) {
    const auto path = folder.path() / name;
    EXPECT_TRUE(WriteWholeFile(path, text, IfThere::kRefuse).has_value());
    return path;
  };
  const std::pair<std::filesystem::path, const char*> rows[] = {
      {project, "not the project"},
      {other, "no nested corners"},
      {write("half.3mf", bytes.substr(0, bytes.size() / 2)), "not a whole archive"},
      {write("binary.bgcode", "GCDE\x01"), "binary G-code"},
      {write("empty.gcode", ""), "is empty"},
      {write("photo.gcode", std::string("\xff\xd8\0", 3)), "is no G-code"},
  };
  for (const auto& [path, words] : rows) {
    const auto print = ReadSlicerGcode(path);
    ASSERT_FALSE(print.has_value()) << path;
    EXPECT_THAT(print.error().message, HasSubstr(words));
    EXPECT_THAT(print.error().message, HasSubstr(path.string()));
  }
}

TEST(SlicerGcode, UnpacksNoMoreThanTheLimit) {
  const test::TemporaryFolder folder;
  const auto path = WriteArchive(
      folder.path() / "large.3mf",
      {{"plate_1.gcode", std::string(60'000, ';')}, {"plate_2.gcode", std::string(60'000, ';')}});
  const std::string bytes = files::ReadWholeFile(path, 10'000).value();
  EXPECT_TRUE(ReadGcodeArchive(bytes, "large.3mf", 120'000).has_value());
  const auto texts = ReadGcodeArchive(bytes, "large.3mf", 119'999);
  ASSERT_FALSE(texts.has_value());
  EXPECT_THAT(texts.error().message,
              HasSubstr("large.3mf, plate_2.gcode: the plates up to it are larger than 119999"));
}

}  // namespace
}  // namespace trammel::files
