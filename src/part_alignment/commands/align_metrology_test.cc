// trammel align calibrate, camera, fit, budget and study, from the shell to the files they leave.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "base/random.h"
#include "part_alignment/camera/camera_convert.h"
#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;

using ::testing::HasSubstr;
using ::testing::StartsWith;

class AlignMetrology : public testing::Test {
 protected:
  [[nodiscard]] test::CommandResult Run(const std::string& arguments) const {
    return test::RunTrammel("align " + arguments, folder_.path());
  }
  [[nodiscard]] fs::path At(const std::string& name) const { return folder_.path() / name; }
  [[nodiscard]] nlohmann::json Read(const std::string& name) const {
    return nlohmann::json::parse(test::ReadWhole(At(name)));
  }
  void Write(const std::string& name, const std::string& text) const {
    test::WriteWhole(At(name), text);
  }

  // The paper's pyramid before its camera, the taper being the measuring machine's frame.
  void WriteGrid(const std::string& name, int planes) const {
    const part_alignment::Camera camera = part_alignment::TableOneCamera();
    const Eigen::Matrix3d rotation =
        geometry::RotationFromAngles(camera.taper_from_camera.angles_rad);
    Random random(1001);
    std::string views;
    for (int plane = 0; plane < planes; ++plane) {
      const double w_mm = -395 - 115.0 * plane;
      for (int i = -3; i <= 3; ++i) {
        for (int j = -2; j <= 2; ++j) {
          const Eigen::Vector3d at(0.14 * i * w_mm, 0.155 * j * w_mm, w_mm);
          const auto pixel = Must(part_alignment::Project(camera, at));
          const Eigen::Vector3d tip = rotation * at + camera.taper_from_camera.translation_mm;
          views += fmt::format(
              "{}{{\"tip_mm\": [{}, {}, {}], \"column_px\": {}, \"row_px\": {}, \"sigma_px\": "
              "0.02}}",
              views.empty() ? "" : ",\n", tip.x(), tip.y(), tip.z(),
              pixel.x() + random.Normal(0, 0.02), pixel.y() + random.Normal(0, 0.02));
        }
      }
    }
    Write(name, fmt::format(R"({{"format": 1, "date": "2026-11-22",
      "camera": {{"model": "brown_measured_to_ideal", "image_px": [2592, 1944],
                  "pixel_pitch_mm": 0.0022, "looks_along": "-z"}},
      "cmm_from_taper": {{"translation_mm": [0, 0, 0], "angles_rad": [0, 0, 0],
                          "sigma_mm": [0.002, 0.002, 0.002], "sigma_rad": [1e-5, 1e-5, 1e-5]}},
      "target_from_tip": {{"offset_mm": [0, 0, 0], "sigma_mm": [0.002, 0.002, 0.002]}},
      "position_sigma_mm": 0.001, "views": [{}]}})",
                            views));
  }

  // A block of 800 x 500 mm, 3 mm proud on top and on two sides; `top_mm` moves one point of it.
  void WriteBlock(double top_mm) const {
    std::string points = "id,x_mm,y_mm,z_mm,sigma_mm,surface\n";
    int number = 0;
    for (const int i : {-1, 0, 1}) {
      for (const int j : {-1, 0, 1}) {
        const double z = number == 4 ? top_mm : 103;
        points += fmt::format("t{},{},{},{},0.05,top\n", number, 350 * i, 200 * j, z);
        points += fmt::format("u{},{},{},-3,0.05,bottom\n", number, 350 * i, 200 * j);
        points += fmt::format("s{},{},{},{},0.05,side\n", number, 403, 200 * i, 50 + 30 * j);
        points += fmt::format("f{},{},{},{},0.05,front\n", number, 300 * i, -253, 50 + 30 * j);
        ++number;
      }
    }
    points += "T1,-300,-200,105,0.03,\nT2,300,-200,105,0.03,\nT3,300,200,105,0.03,\n";
    Write("points.csv", points);
    Write("part.json", R"({"format": 1, "surfaces": [
      {"id": "top", "kind": "plane", "middle_mm": [0, 0, 100], "direction": [0, 0, 1],
       "overstock_mm": 3},
      {"id": "bottom", "kind": "plane", "middle_mm": [0, 0, 0], "direction": [0, 0, -1],
       "overstock_mm": 3},
      {"id": "side", "kind": "plane", "middle_mm": [400, 0, 50], "direction": [1, 0, 0],
       "overstock_mm": 3},
      {"id": "front", "kind": "plane", "middle_mm": [0, -250, 50], "direction": [0, -1, 0],
       "overstock_mm": 3}]})");
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(AlignMetrology, AGridBecomesACameraFileAndAReport) {
  WriteGrid("grid.json", 6);
  ASSERT_THAT(Run("calibrate grid.json --out camera.json --report report"),
              Says(0, StartsWith("verdict   good")));
  const nlohmann::json camera = Read("camera.json");
  EXPECT_NEAR(double(camera["camera"]["focal_length_mm"]), 6.189, 0.003);
  EXPECT_EQ(camera["calibration"]["date"], "2026-11-22");
  EXPECT_EQ(camera["calibration"]["covariance"].size(), 13U);
  for (const char* name : {"report.html", "projection-uncertainty.png"}) {
    EXPECT_GT(fs::file_size(At(std::string("report/") + name)), 1000U) << name;
  }
  EXPECT_THAT(Run("calibrate grid.json --out camera.json").output, HasSubstr("--force"));
  const auto json = nlohmann::json::parse(Run("calibrate grid.json --json").output);
  EXPECT_EQ(json["verdict"], "good");
  EXPECT_EQ(json["cross_validation"].size(), 6U);
}

TEST_F(AlignMetrology, ACalibrationGoesWithItsModelOnly) {
  WriteGrid("grid.json", 6);
  ASSERT_EQ(Run("calibrate grid.json --out camera.json").exit_code, 0);
  ASSERT_EQ(Run("camera camera.json --model brown_measured_to_ideal --out same.json").exit_code, 0);
  EXPECT_EQ(Read("same.json")["calibration"]["covariance"],
            Read("camera.json")["calibration"]["covariance"]);
  ASSERT_THAT(Run("camera camera.json --most-error-px 1 --out other.json"),
              Says(0, "are left out"));
  EXPECT_FALSE(Read("other.json").contains("calibration"));
  EXPECT_THAT(Run("camera camera.json --pixel-pitch-mm 0.01").output, HasSubstr("has its own"));
}

TEST_F(AlignMetrology, ACameraOfOpenCvNeedsItsPitch) {
  Write(
      "cv.yaml",
      "image_width: 640\nimage_height: 480\ncamera_matrix:\n  data: [900, 0, 320, 0, 900, 240, 0, "
      "0, 1]\ndistortion_coefficients:\n  data: [-0.1, 0.02, 0.001, 0, 0]\n");
  EXPECT_THAT(Run("camera cv.yaml").output, HasSubstr("--pixel-pitch-mm"));
  ASSERT_EQ(Run("camera cv.yaml --pixel-pitch-mm 0.004 --out c.json").exit_code, 0);
  const nlohmann::json camera = Read("c.json")["camera"];
  EXPECT_NEAR(double(camera["focal_length_mm"]), 3.6, 1e-12);
  EXPECT_NEAR(double(camera["principal_point_offset_px"][0]), 0.5, 1e-12);
  EXPECT_EQ(camera["looks_along"], "+z");
  EXPECT_EQ(Run("camera table1 --model brown_measured_to_ideal --out t.json").exit_code, 0);
  EXPECT_EQ(Read("t.json")["camera"]["k1"], 2.997e-8);
  EXPECT_THAT(Run("camera table1").output, HasSubstr("off by up to"));
  EXPECT_EQ(Run("camera nothing.yaml").exit_code, 1);
}

TEST_F(AlignMetrology, AFitLeavesTargetsAndAMapOrTheReason) {
  WriteBlock(103);
  ASSERT_THAT(Run("fit points.csv --part part.json --out targets.json --report report"), Ends(0));
  const nlohmann::json targets = Read("targets.json");
  EXPECT_EQ(targets["targets"][2]["id"], "T3");
  EXPECT_NEAR(double(targets["targets"][2]["ideal_mm"][0]), 300, 1e-6);
  EXPECT_EQ(targets["targets_covariance_mm2"].size(), 9U);
  EXPECT_GT(fs::file_size(At("report/stock-allowance.png")), 1000U);
  WriteBlock(90);
  EXPECT_THAT(Run("fit points.csv --part part.json --out never.json"),
              Says(2, "point t4 is 13.000 mm inside the other points of top"));
  EXPECT_FALSE(fs::exists(At("never.json")));
}

TEST_F(AlignMetrology, ABudgetJudgesTheTolerance) {
  const auto scene = [](const char* tolerance) {
    return fmt::format(R"({{"format": 1, "targets_mm": [[0, 0, 0], [1500, 0, 0], [0, 1000, 0]],
      "target_sigma_mm": [0.0035, 0.0143, 0.0155], "box_low_mm": [0, 0, 0],
      "box_high_mm": [1500, 1000, 500], "tolerance_mm": {}, "lengths_mm": [[1000, 1000.04]]}})",
                       tolerance);
  };
  Write("scene.json", scene("[-1, 1]"));
  EXPECT_THAT(Run("budget scene.json --trials 2000"), Says(0, "full width"));
  const auto json = nlohmann::json::parse(Run("budget scene.json --json --trials 0").output);
  EXPECT_GT(double(json["axes"]["x"]["u_it_mm"]), 0.009);
  EXPECT_TRUE(json["axes"]["x"]["simulated_mm"].is_null());
  std::string unknown = scene("[-1, 1]");
  unknown.replace(1, 0, "\"repeat\": 5, ");
  Write("unknown.json", unknown);
  EXPECT_THAT(Run("budget unknown.json").output, HasSubstr("repeats"));
  Write("scene.json", scene("[-0.1, 0.1]"));
  EXPECT_EQ(Run("budget scene.json --trials 0").exit_code, 2);
  Write("scene.json", scene("[0.1, 0.1]"));
  EXPECT_EQ(Run("budget scene.json").exit_code, 1);
}

}  // namespace
}  // namespace trammel
