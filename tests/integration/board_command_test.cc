// Path from a printed sheet and drawn pictures of it to a camera file, by the commands of a user.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "base/statistics.h"
#include "board_scene.h"
#include "geometry/linear_systems.h"
#include "image/png_test_support.h"
#include "part_alignment/files/camera_file.h"
#include "sim/spindle/spindle_camera.h"
#include "support/matchers.h"
#include "support/run_trammel.h"

namespace trammel {
namespace {

using nlohmann::json;

constexpr double kRadius_mm = 3;

std::string NameOf(std::size_t stop) { return "p" + std::to_string(stop + 10) + ".png"; }

class BoardCommand : public testing::Test {
 protected:
  [[nodiscard]] test::CommandResult Run(const std::string& arguments) const {
    return test::RunTrammel("align " + arguments, folder_.path());
  }
  [[nodiscard]] std::filesystem::path At(const std::string& name) const {
    return folder_.path() / name;
  }
  [[nodiscard]] json ReadJson(const std::string& name) const {
    std::ifstream file(At(name));
    return json::parse(file);
  }
  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(At(name), std::ios::binary) << bytes;
  }

  /// The sheet of `align targets`, printed 0.2 % too wide and bent, under the camera.
  [[nodiscard]] sim::BoardWorld PrintedBoard(const json& layout, std::uint64_t seed) const {
    sim::BoardSetup setup = test::BoardScene();
    setup.stops.clear();
    for (const auto& [count, c_rad] :
         {std::pair(10, 0.0), std::pair(6, std::numbers::pi), std::pair(4, 0.0)}) {
      for (const auto& stop : sim::BoardStations(setup, count, 5, 60, 170, 380, {c_rad})) {
        setup.stops.push_back(stop);
      }
    }
    setup.touched = {};
    auto world = sim::DrawBoardWorld(setup, seed);
    world.marks_mm.clear();
    world.normals.clear();
    for (const json& target : layout.at("targets")) {
      const double x = 1.002 * (target.at("x_mm").get<double>() - 105);
      const double y = 0.999 * (148 - target.at("y_mm").get<double>());
      const double z = 0.3 * (x * x / 1e4);
      world.marks_mm.push_back(world.machine_from_sheet.Out({x, y, z}));
      world.normals.push_back(
          sim::operator*(world.machine_from_sheet.turn, sim::UnitOf({-0.6 * x / 1e4, 0, 1})));
    }
    return world;
  }

  void TakePictures(const sim::BoardWorld& world, const json& layout) const {
    sim::SpindlePicture like;
    like.light.white = 30;  // black prints on white paper
    like.light.dark = 205;
    like.light.surface = 190;
    like.light.vignetting = 0.2;
    std::vector<sim::RingPattern> patterns;
    for (const json& target : layout.at("targets")) {
      sim::RingPattern& pattern = patterns.emplace_back();
      pattern.bits = layout.at("bits").get<int>();
      pattern.word = target.at("word").get<std::uint32_t>();
      pattern.dot_radius_mm = kRadius_mm;
      pattern.ring_inner_mm = 2 * kRadius_mm;
      pattern.ring_outer_mm = 3 * kRadius_mm;
      pattern.ground_radius_mm = 3.7 * kRadius_mm;
    }
    for (std::size_t stop = 0; stop < world.setup.stops.size(); ++stop) {
      const auto picture = sim::BoardPictureAt(world, stop, patterns, like);
      const auto page = Must(sim::TakePicture(picture, world.noise.Fork(stop)));
      test::WriteWhole(At(NameOf(stop)), image::PngOf(page));
    }
  }

  [[nodiscard]] json BoardJson(const sim::BoardWorld& world) const {
    json views = json::array();
    for (std::size_t stop = 0; stop < world.setup.stops.size(); ++stop) {
      const auto& at = world.setup.stops[stop];
      views.push_back({{"picture", NameOf(stop)},
                       {"spindle_mm", at.stated_mm},
                       {"c_deg", at.c_rad * 180 / std::numbers::pi}});
    }
    return {{"format", 1},
            {"date", "2026-11-22"},
            {"sheet", "sheet.json"},
            {"camera",
             {{"model", "brown_measured_to_ideal"},
              {"image_px", {world.setup.lens.width_px, world.setup.lens.height_px}},
              {"pixel_pitch_mm", world.setup.lens.pixel_pitch_mm},
              {"lens_focal_length_mm", 6},
              {"looks_along", "+z"}}},
            {"place", {{"at_mm", {-2, 0, -320}}, {"sigma_mm", {1, 1, 0.5}}}},
            {"views", views}};
  }

  test::TemporaryFolder folder_;
};

TEST_F(BoardCommand, CalibratesACameraByPicturesOfAPrintedSheet) {
  ASSERT_EQ(Run("targets --count 40 --radius 3 --out sheet.pdf --layout sheet.json").exit_code, 0);
  const json layout = ReadJson("sheet.json");
  const auto world = PrintedBoard(layout, 77);
  TakePictures(world, layout);
  Write("board.json", BoardJson(world).dump());
  ASSERT_THAT(Run("calibrate --board board.json --keep-observations seen.json --out camera.json "
                  "--report page"),
              Prints(0, "not seen  the machine's own scale"));
  EXPECT_TRUE(std::filesystem::exists(At("page/report.html")));
  const auto camera = Must(files::ReadCameraFile(At("camera.json")));
  const auto error = test::BoardError(world, camera.camera);
  const double nees = geometry::SquaredMahalanobisDistance(*camera.calibration->covariance, error);
  EXPECT_LT(nees, ChiSquareQuantile(0.9999, part_alignment::kCameraParameters));
  EXPECT_LT(std::abs(error[0]) / camera.camera.pixel_pitch_mm, 1);  // px of 2813
  EXPECT_LT(error.segment<2>(1).norm(), 1);                         // px

  // From here on the stored observations suffice.
  const auto again = Must(Run(
      "calibrate --board board.json --observations seen.json --out camera.json --force --json"));
  EXPECT_EQ(json::parse(again.standard_output).at("verdict"), "good");

  json wrong = BoardJson(world);
  for (json& view : wrong.at("views")) {
    view.at("spindle_mm")[0] = -view.at("spindle_mm")[0].get<double>();
  }
  Write("board.json", wrong.dump());
  EXPECT_THAT(Run("calibrate --board board.json --observations seen.json"),
              Says(2, "mirror image"));

  json fewer = BoardJson(world);
  fewer.at("views").erase(0);
  Write("board.json", fewer.dump());
  EXPECT_THAT(Run("calibrate --board board.json --observations seen.json"),
              Says(1, "no view names the picture p10.png"));
}

}  // namespace
}  // namespace trammel
