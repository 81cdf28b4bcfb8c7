// The files that calibration, part fit and budget read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "part_alignment/camera/camera_convert.h"
#include "part_alignment/files/camera_file.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/files/stl_file.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using ::testing::HasSubstr;

class PartMetrologyFile : public testing::Test {
 protected:
  std::filesystem::path File(const std::string& text) {
    const auto path = folder_.path() / "file";
    test::WriteWhole(path, text);
    return path;
  }
  test::TemporaryFolder folder_;
};

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

constexpr const char* kGrid = R"({"format": 1, "date": "2026-11-22",
  "camera": {"model": "brown_measured_to_ideal", "image_px": [2592, 1944],
             "pixel_pitch_mm": 0.0022, "looks_along": "-z"},
  "cmm_from_taper": {"translation_mm": [1, 2, 3], "angles_rad": [0.1, 0, 0],
                     "sigma_mm": [0.002, 0.002, 0.003], "sigma_rad": [1e-5, 1e-5, 2e-5]},
  "target_from_tip": {"offset_mm": [0, -12, 3], "sigma_mm": [0.001, 0.001, 0.001]},
  "position_sigma_mm": 0.001,
  "views": [{"tip_mm": [10, 20, 30], "column_px": 100.5, "row_px": 200.25, "sigma_px": 0.02}]})";

TEST_F(PartMetrologyFile, AGridIsReadAndItsFaultsAreNamed) {
  const auto read = Must(ReadCalibrationGrid(File(kGrid)));
  EXPECT_EQ(read.date, "2026-11-22");
  EXPECT_EQ(read.grid.camera.width_px, 2592);
  EXPECT_EQ(read.grid.taper_sigma[5], 2e-5);
  EXPECT_EQ(read.grid.target_from_tip_mm.y(), -12);
  ASSERT_EQ(read.grid.views.size(), 1U);
  EXPECT_EQ(read.grid.views[0].row_px, 200.25);
  const auto complaint = [this](const std::string& from, const std::string& to) {
    return ErrorOf(ReadCalibrationGrid(File(Replaced(kGrid, from, to))));
  };
  EXPECT_THAT(complaint("\"sigma_px\": 0.02", "\"sigma_px\": 0"), HasSubstr("views[0].sigma_px"));
  EXPECT_THAT(complaint("100.5", "9100.5"), HasSubstr("column_px"));
  EXPECT_THAT(complaint("2026-11-22", "yesterday"), HasSubstr("date"));
  EXPECT_THAT(complaint("\"offset_mm\"", "\"offset\""), HasSubstr("offset_mm"));
  EXPECT_THAT(complaint("[0.1, 0, 0]", "[90, 0, 0]"), HasSubstr("angles_rad"));
}

TEST_F(PartMetrologyFile, ACalibratedCameraIsReadAsAnyOther) {
  part_alignment::CameraCalibration calibration;
  calibration.camera = part_alignment::TableOneCamera();
  calibration.nearest_mm = 395;
  calibration.farthest_mm = 1430;
  const auto camera = Must(ReadCameraFile(File(CalibratedCameraText(calibration, "2026-11-22"))));
  EXPECT_EQ(camera.camera.k1, calibration.camera.k1);
  ASSERT_TRUE(camera.calibration);
  EXPECT_EQ(camera.calibration->farthest_mm, 1430);
}

TEST_F(PartMetrologyFile, ATableOfPointsIsReadWithAnySeparator) {
  for (const char separator : {',', ';', '\t'}) {
    std::string text =
        "surface,id,x_mm,y_mm,z_mm,sigma_mm,remark\r\ntop,p1,1.5,-2,3e1,0.05,a\r\n"
        "# a remark\r\n\r\n,T1,4,5,6,0.03,b\r\n";
    std::replace(text.begin(), text.end(), ',', separator);
    const auto points = Must(ReadPointTable(File(text)));
    ASSERT_EQ(points.size(), 2U);
    EXPECT_EQ(points[0].surface, "top");
    EXPECT_EQ(points[0].at_mm.z(), 30);
    EXPECT_EQ(points[1].surface, "");
    EXPECT_EQ(points[1].sigma_mm, 0.03);
  }
  const auto json = Must(ParsePointTable(
      R"({"format": 1, "points": [{"id": 7, "at_mm": [1, 2, 3], "sigma_mm": 0.1, "surface": "x"}]})",
      "f"));
  EXPECT_EQ(json[0].id, "7");
}

TEST_F(PartMetrologyFile, ATableOfPointsIsReadAsSpreadsheetsEncodeIt) {
  const std::string text = "id\tx_mm\ty_mm\tz_mm\tsigma_mm\tsurface\r\np1\t1\t2\t3\t0.05\ttop\r\n";
  for (const bool low_first : {true, false}) {
    std::string bytes = low_first ? "\xFF\xFE" : "\xFE\xFF";
    for (const char c : text) bytes += low_first ? std::string{c, '\0'} : std::string{'\0', c};
    const auto points = Must(ReadPointTable(File(bytes)));
    ASSERT_EQ(points.size(), 1U);
    EXPECT_EQ(points[0].at_mm.z(), 3);
    EXPECT_EQ(points[0].surface, "top");
    EXPECT_THAT(ReadPointTable(File(bytes.substr(2))), FailsWith("UTF-16 without its mark"));
  }
  EXPECT_TRUE(ReadPointTable(File("\xEF\xBB\xBF" + text)));
  EXPECT_THAT(ReadPointTable(File("PK\x03\x04 an .xlsx")), FailsWith("save it as CSV"));
}

TEST_F(PartMetrologyFile, FaultsOfATableNameTheirLine) {
  const auto complaint = [](const std::string& text) {
    return ErrorOf(ParsePointTable(text, "f.csv"));
  };
  EXPECT_THAT(complaint("id,x_mm,y_mm\n1,2,3\n"), HasSubstr("z_mm is missing"));
  EXPECT_THAT(complaint("id,x_mm,y_mm,z_mm,sigma_mm,surface\na,1,2,3,0.1,t\nb,1,two,3,0.1,t\n"),
              HasSubstr("f.csv:3: y_mm"));
  EXPECT_THAT(complaint("id;x_mm;y_mm;z_mm;sigma_mm;surface\na;1,5;2;3;0.1;t\n"),
              HasSubstr("with a point"));
  EXPECT_THAT(complaint("id,x_mm,y_mm,z_mm,sigma_mm,surface\na,1,2\n"), HasSubstr("3 cells"));
  EXPECT_THAT(complaint("\n"), HasSubstr("empty"));
}

TEST_F(PartMetrologyFile, APartIsReadAndItsFaultsAreNamed) {
  const std::string text = R"({"format": 1, "guard_sigmas": 3, "surfaces": [
    {"id": "top", "kind": "plane", "middle_mm": [0, 0, 50], "direction": [0, 0, 1],
     "overstock_mm": 3},
    {"id": 2, "kind": "bore", "middle_mm": [0, 0, 0], "direction": [0, 0, 1], "radius_mm": 40,
     "overstock_mm": 2}],
    "scale_bars": [{"from": "B1", "to": "B2", "length_mm": 1000, "sigma_mm": 0.002}],
    "start": {"translation_mm": [0, 0, 0], "angles_rad": [0, 0, 1]}})";
  const auto part = Must(ReadPartFile(File(text), ReadMeshFile));
  EXPECT_EQ(part.surfaces[1].radius_mm, 40);
  EXPECT_EQ(part.options.guard_sigmas, 3);
  EXPECT_TRUE(part.start);
  EXPECT_THAT(ReadPartFile(File(Replaced(text, "\"radius_mm\": 40,", "")), ReadMeshFile),
              FailsWith("surfaces[1].radius_mm"));
}

TEST_F(PartMetrologyFile, ABudgetIsReadAndItsFaultsAreNamed) {
  const std::string text = R"({"format": 1, "targets_mm": [[0, 0, 0], [1500, 0, 0], [0, 1000, 0]],
    "target_sigma_mm": [0.0035, 0.0143, 0.0155], "box_low_mm": [0, 0, 0],
    "box_high_mm": [1500, 1000, 500], "tolerance_mm": [-1, 1], "lengths_mm": [[1000, 1000.04]]})";
  const auto budget = Must(ReadBudgetFile(File(text)));
  EXPECT_EQ(budget.scene.targets_mm.size(), 3U);
  EXPECT_EQ(budget.scene.expansion_per_k, 11e-6);
  EXPECT_EQ(budget.lengths[0].measured_mm, 1000.04);
  const auto complaint = [&](const std::string& from, const std::string& to) {
    return ErrorOf(ReadBudgetFile(File(Replaced(text, from, to))));
  };
  EXPECT_THAT(complaint("[1500, 0, 0]", "[1500, 0]"), HasSubstr("targets_mm[1]"));
  EXPECT_THAT(complaint("[-1, 1]", "[1, 1]"), HasSubstr("tolerance_mm"));
  EXPECT_THAT(complaint("box_high_mm", "box_hi"), HasSubstr("box_high_mm"));
}

}  // namespace
}  // namespace trammel::files
