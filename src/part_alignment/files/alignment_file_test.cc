#include "part_alignment/files/alignment_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using part_alignment::CameraConvention;
using part_alignment::LooksAlong;
using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

constexpr const char* kCamera = R"({"model": "brown_measured_to_ideal", "image_px": [2592, 1944],
  "pixel_pitch_mm": 0.0022, "focal_length_mm": 6.189, "principal_point_offset_px": [-8.732, 27.52],
  "k1": 2.997e-08, "k2": -1.937e-15, "p1": -6.188e-08, "p2": 3.408e-07,
  "taper_from_camera": {"translation_mm": [-2.139, 0.301, -320.3],
                        "angles_rad": [-0.003, -0.009, 0.03]}, "looks_along": "-z"})";

class AlignmentFileTest : public testing::Test {
 protected:
  // The file's text with `from` replaced by `to`.
  static std::string Text(const std::string& from = "", const std::string& to = "") {
    std::string text = std::string(R"({"format": 1, "camera": )") + kCamera + R"(,
      "targets": [{"id": 7, "ideal_mm": [1, 2, 3]}, {"id": "T2", "ideal_mm": [100, -2.5, 0]}],
      "views": [{"spindle_mm": [10, 20, 500],
                 "spindle_rotation": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
                 "observations": [{"target": 7, "column_px": 0, "row_px": 1943.4, "sigma_px": 0.05},
                                  {"target": "T2", "column_px": -0.4, "row_px": 7, "sigma_px": 0.1}]},
                {"spindle_mm": [0, 0, 0], "picture": "b.png"}],
      "unknowns": ["pose", "clamp_tilt"], "x_note": "mine"})";
    if (from.empty()) return text;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  }
  [[nodiscard]] Result<AlignmentInput> Read(const std::string& text) const {
    test::WriteWhole(Path("seen.json"), text);
    return ReadAlignmentFile(Path("seen.json"));
  }
  [[nodiscard]] std::string Refusal(const std::string& from, const std::string& to) const {
    return ErrorOf(Read(Text(from, to)));
  }
  [[nodiscard]] std::filesystem::path Path(const std::string& name) const {
    return folder_.path() / name;
  }

  TemporaryFolder folder_;
};

TEST_F(AlignmentFileTest, ReadsEveryNumberWhereItBelongs) {
  const auto input = Must(Read(Text()));
  const part_alignment::Camera& camera = input.measurement.camera;
  EXPECT_EQ(camera.convention, CameraConvention::kBrownMeasuredToIdeal);
  EXPECT_EQ(camera.looks_along, LooksAlong::kMinusZ);
  EXPECT_EQ(camera.width_px, 2592);
  EXPECT_EQ(camera.height_px, 1944);
  EXPECT_EQ(camera.principal_point_offset_px, Eigen::Vector2d(-8.732, 27.52));
  EXPECT_EQ(camera.k2, -1.937e-15);
  EXPECT_EQ(camera.p1, -6.188e-08);
  EXPECT_EQ(camera.p2, 3.408e-07);
  EXPECT_EQ(camera.taper_from_camera.translation_mm, Eigen::Vector3d(-2.139, 0.301, -320.3));
  EXPECT_EQ(camera.taper_from_camera.angles_rad, Eigen::Vector3d(-0.003, -0.009, 0.03));
  ASSERT_EQ(input.measurement.targets.size(), 2U);
  EXPECT_EQ(input.measurement.targets[0].id, "7");
  EXPECT_EQ(input.measurement.targets[1].ideal_mm, Eigen::Vector3d(100, -2.5, 0));
  EXPECT_THAT(input.numeric_ids, UnorderedElementsAre("7"));
  ASSERT_EQ(input.measurement.views.size(), 2U);
  const part_alignment::View& view = input.measurement.views[0];
  EXPECT_EQ(view.spindle_mm, Eigen::Vector3d(10, 20, 500));
  EXPECT_EQ(view.spindle_rotation.row(1), Eigen::RowVector3d(0, 0, -1));  // rows, not columns
  ASSERT_EQ(view.observations.size(), 2U);
  EXPECT_EQ(view.observations[1].target, "T2");
  EXPECT_EQ(view.observations[1].column_px, -0.4);
  EXPECT_EQ(view.observations[1].row_px, 7);
  EXPECT_EQ(view.observations[1].sigma_px, 0.1);
  EXPECT_EQ(input.measurement.views[1].spindle_rotation, Eigen::Matrix3d::Identity());
  EXPECT_THAT(NamesOf(input.unknowns), ElementsAre("pose", "clamp_tilt"));
}

TEST_F(AlignmentFileTest, WhatIsUncertainBesideThePixelsAndThePicturesAreKept) {
  const auto exact = Must(Read(Text()));
  EXPECT_FALSE(exact.inputs.target_mm);
  EXPECT_EQ(AlignmentFileText(exact).find("input_uncertainty"), std::string::npos);
  EXPECT_THAT(exact.pictures, ElementsAre("", "b.png"));
  const auto input = Must(Read(Text(R"("x_note")", R"("input_uncertainty": {"machine_mm": 0.005,
      "target_mm": 0.04, "clamp_angle_rad": 0.001, "clamp_eccentricity_mm": 0.015,
      "clamp_tilt_rad": 0.002, "focal_length_mm": 0.003, "camera_offset_mm": 0.02}, "x_note")")));
  const auto again = Must(Read(AlignmentFileText(input)));
  EXPECT_THAT(again.pictures, ElementsAre("", "b.png"));
  for (const part_alignment::InputUncertainty& inputs : {input.inputs, again.inputs}) {
    EXPECT_EQ(inputs.machine_mm, 0.005);
    EXPECT_EQ(inputs.target_mm, 0.04);
    EXPECT_EQ(inputs.clamp_angle_rad, 0.001);
    EXPECT_EQ(inputs.clamp_eccentricity_mm, 0.015);
    EXPECT_EQ(inputs.clamp_tilt_rad, 0.002);
    EXPECT_EQ(inputs.focal_length_mm, 0.003);
    EXPECT_EQ(inputs.camera_offset_mm, 0.02);
  }
  for (const char* wrong : {R"({"target_mm": -1})", R"({"target_mm": 1e9})",
                            R"({"target_mm": null})", R"({"targets_mm": 1})", "7"}) {
    const auto refused =
        Refusal(R"("x_note")", fmt::format(R"("input_uncertainty": {}, "x_note")", wrong));
    EXPECT_THAT(refused, HasSubstr("input_uncertainty")) << wrong;
  }
  EXPECT_THAT(Refusal(R"("b.png")", "5"), HasSubstr("views[1].picture"));
}

TEST_F(AlignmentFileTest, WhatWasWrittenReadsBackToTheLastBit) {
  const auto input = Must(Read(Text()));
  AlignmentInput changed = input;
  changed.measurement.camera.convention = CameraConvention::kBrownIdealToDistorted;
  changed.measurement.camera.looks_along = LooksAlong::kPlusZ;
  changed.measurement.views[0].observations[0].column_px = 100.0 / 3;
  const std::string text = AlignmentFileText(changed);
  const auto again = Must(Read(text));
  EXPECT_EQ(again.measurement.views[0].observations[0].column_px, 100.0 / 3);
  EXPECT_EQ(again.measurement.camera.looks_along, LooksAlong::kPlusZ);
  EXPECT_EQ(AlignmentFileText(again), text);
  EXPECT_THAT(text, Containing(R"("id": 7)", R"("target": "T2")"));
}

TEST_F(AlignmentFileTest, TheCameraMayStandInAFileOfItsOwn) {
  std::string text = Text();
  const std::size_t at = text.find(kCamera);
  text.replace(at, std::string(kCamera).size(), R"("cameras/spindle.json")");
  std::filesystem::create_directory(Path("cameras"));
  EXPECT_THAT(Read(text).error().message, HasSubstr("cameras/spindle.json"));

  const auto input = Must(Read(Text()));
  const CameraFile file{input.measurement.camera,
                        part_alignment::CalibrationRecord{"2026-11-22", 395, 1430}};
  test::WriteWhole(Path("cameras/spindle.json"), CameraFileText(file));
  const auto with_file = Must(Read(text));
  EXPECT_EQ(with_file.measurement.camera.k1, input.measurement.camera.k1);
  ASSERT_TRUE(with_file.calibration);
  EXPECT_EQ(with_file.calibration->date, "2026-11-22");
  EXPECT_EQ(with_file.calibration->farthest_mm, 1430);
  // Written out, the camera stands within, and what is known of it beside it.
  const std::string within = AlignmentFileText(with_file);
  const auto again = Must(Read(within));
  ASSERT_TRUE(again.calibration);
  EXPECT_EQ(again.calibration->nearest_mm, 395);
  EXPECT_EQ(AlignmentFileText(again), within);
}

TEST_F(AlignmentFileTest, TheTargetsMayStandInAFileOfTheirOwnWithTheirCovariance) {
  auto text = nlohmann::json::parse(Text());
  nlohmann::json file = {{"format", 1}, {"verdict", "good"}, {"targets", text["targets"]}};
  file["targets"].push_back({{"id", "A"}, {"ideal_mm", {1, 2, 3}}});
  file["bar_ends"] = {"A"};
  file["whatever else fit tells"] = 1;
  const std::size_t rows = 3 * file["targets"].size();
  for (std::size_t i = 0; i < rows; ++i) {
    file["targets_covariance_mm2"].push_back(std::vector<double>(rows, 0.1 / 3));
    file["targets_covariance_mm2"][i][i] = 1.0 / 3;
  }
  text["targets"] = "targets.json";
  EXPECT_THAT(Read(text.dump()).error().message, HasSubstr("targets.json"));
  test::WriteWhole(Path("targets.json"), file.dump());
  const auto input = Must(Read(text.dump()));
  EXPECT_EQ(input.measurement.targets.size(), file["targets"].size() - 1)
      << "no view shows the scale bar's end";
  ASSERT_TRUE(input.target_covariance);
  const auto size = static_cast<Eigen::Index>(rows) - 3;
  EXPECT_EQ(input.target_covariance->rows(), size);
  EXPECT_EQ((*input.target_covariance)(0, size - 1), 0.1 / 3);
  // Written out, they stand within.
  const std::string within = AlignmentFileText(input);
  const auto again = Must(Read(within));
  EXPECT_EQ(*again.target_covariance, *input.target_covariance);
  EXPECT_EQ(AlignmentFileText(again), within);

  const auto refusal = [&](const auto& change) {
    nlohmann::json changed = file;
    change(changed);
    test::WriteWhole(Path("targets.json"), changed.dump());
    const auto read = Read(text.dump());
    return read ? std::string("read") : read.error().message;
  };
  EXPECT_THAT(refusal([](auto& of) { of["verdict"] = "refused"; }), HasSubstr("refused"));
  EXPECT_THAT(refusal([](auto& of) { of["targets_covariance_mm2"][0][1] = 2; }),
              HasSubstr("not symmetric"));
  EXPECT_THAT(refusal([](auto& of) { of["targets_covariance_mm2"][0][0] = -1; }),
              HasSubstr("below 0"));
  EXPECT_THAT(refusal([](auto& of) { of["targets_covariance_mm2"][0][0] = "x"; }),
              HasSubstr("row 0"));
  EXPECT_THAT(refusal([](auto& of) { of["targets_covariance_mm2"].erase(0); }),
              HasSubstr("targets_covariance_mm2"));
  EXPECT_THAT(refusal([](auto& of) { of["targets"].erase(2); }), HasSubstr("targets need"));
}

TEST_F(AlignmentFileTest, ACamerasCovarianceComesBackToTheLastBit) {
  const auto input = Must(Read(Text()));
  part_alignment::CameraCovariance covariance = part_alignment::CameraCovariance::Identity() / 3;
  covariance(2, 7) = covariance(7, 2) = 0.1;
  const CameraFile file{input.measurement.camera,
                        part_alignment::CalibrationRecord{"2026-11-22", 395, 1430, covariance}};
  const std::string text = CameraFileText(file);
  const auto read = [this](const std::string& of) {
    test::WriteWhole(Path("camera.json"), of);
    return ReadCameraFile(Path("camera.json"));
  };
  ASSERT_TRUE(read(text));
  EXPECT_EQ(read(text)->calibration->covariance, covariance);
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    changed.replace(at, from.size(), to);
    const auto refused = read(changed);
    return refused ? std::string() : refused.error().message;
  };
  EXPECT_THAT(refusal("\"beta_rad\"", "\"gamma\""), HasSubstr("it must be beta_rad"));
  EXPECT_THAT(refusal("\"parameters\"", "\"x_parameters\""), HasSubstr("parameters is missing"));
  EXPECT_THAT(refusal("0.1,", "0.2,"), HasSubstr("not symmetric"));
  EXPECT_THAT(refusal("0.1,", "null,"), HasSubstr("no 13 numbers in row 2"));
}

TEST_F(AlignmentFileTest, ACameraFileSaysWhatIsWrongWithIt) {
  const auto refusal = [this](const std::string& text) {
    test::WriteWhole(Path("camera.json"), text);
    const auto read = ReadCameraFile(Path("camera.json"));
    return read ? std::string() : read.error().message;
  };
  const std::string camera = kCamera;
  EXPECT_EQ(refusal(R"({"format": 1, "camera": )" + camera + "}"), "");
  EXPECT_THAT(refusal(R"({"format": 2, "camera": )" + camera + "}"), HasSubstr("format is 2"));
  EXPECT_THAT(refusal(R"({"format": 1})"), HasSubstr("camera is missing"));
  EXPECT_THAT(refusal("%YAML:1.0\n---\ncamera_matrix: 1\n"),
              HasSubstr("trammel align camera FILE"));
  EXPECT_THAT(refusal(R"({"format": 1, "camera": 3})"), HasSubstr("camera is 3"));
  const std::string head = R"({"format": 1, "camera": )" + camera + R"(, "calibration": )";
  EXPECT_THAT(refusal(head + R"({"date": "yesterday", "distance_mm": [1, 2]}})"),
              HasSubstr(R"(calibration.date is "yesterday")"));
  EXPECT_THAT(refusal(head + R"({"date": "2026-11-22", "distance_mm": [9, 2]}})"),
              HasSubstr("calibration.distance_mm is [9, 2]"));
}

TEST_F(AlignmentFileTest, NamesThePlaceOfEveryFault) {
  EXPECT_THAT(Refusal(R"("format": 1)", R"("format": 3)"), HasSubstr("seen.json: format is 3"));
  EXPECT_THAT(Refusal("brown_measured_to_ideal", "opencv"),
              HasSubstr(R"(camera.model is "opencv")"));
  EXPECT_THAT(Refusal(R"("k1": 2.997e-08,)", ""), HasSubstr("camera.k1 is missing"));
  EXPECT_THAT(Refusal(R"("k1": 2.997e-08,)", R"("k1": 0, "k3": 1,)"),
              HasSubstr("camera.\"k3\" is not a known key"));
  EXPECT_THAT(Refusal("[2592, 1944]", "[2592.5, 1944]"), HasSubstr("image_px has 2592.5"));
  EXPECT_THAT(Refusal("0.0022", "2.2"), HasSubstr("camera.pixel_pitch_mm is 2.2"));
  EXPECT_THAT(Refusal("-0.009", "-9.0"), HasSubstr("camera.taper_from_camera.angles_rad[1] is -9"));
  EXPECT_THAT(Refusal(R"("-z")", R"("down")"), HasSubstr(R"(camera.looks_along is "down")"));
  EXPECT_THAT(Refusal("[1, 2, 3]", "[1, 2]"), HasSubstr("targets[0].ideal_mm has 2 entries"));
  EXPECT_THAT(Refusal("[1, 2, 3]", "[1, 2, NaN]"), HasSubstr("is not JSON"));
  EXPECT_THAT(Refusal("[1, 2, 3]", "[1, 2, 1e999]"), HasSubstr("1e999"));
  EXPECT_THAT(Refusal("[1, 2, 3]", "[1, 2, 1e9]"), HasSubstr("targets[0].ideal_mm[2] is 1"));
  EXPECT_THAT(Refusal(R"({"id": 7,)", R"({"id": 7.5,)"), HasSubstr("targets[0].id is 7.5"));
  EXPECT_THAT(Refusal(R"({"id": "T2",)", R"({"id": "7",)"),
              HasSubstr("targets[1].id is 7, which another target has already"));
  EXPECT_THAT(Refusal(R"({"target": "T2",)", R"({"target": "T3",)"),
              HasSubstr("views[0].observations[1].target is T3, which is none of the targets"));
  EXPECT_THAT(Refusal(R"({"target": "T2",)", R"({"target": 7,)"), HasSubstr("seen twice"));
  EXPECT_THAT(Refusal("1943.4", "1943.6"), HasSubstr("observations[0].row_px is 1943.6"));
  EXPECT_THAT(Refusal(R"("sigma_px": 0.05)", R"("sigma_px": 0)"), HasSubstr("sigma_px is 0"));
  EXPECT_THAT(Refusal("[0, 0, -1]", "[0, 0, 1]"),
              HasSubstr("views[0].spindle_rotation is no rotation"));
  EXPECT_THAT(Refusal("[0, 0, -1]", "[0, 0, -1.1]"), HasSubstr("is no rotation"));
  EXPECT_THAT(Refusal("[0, 0, -1]", "[0, 0]"), HasSubstr("has the row [0,0]"));
  EXPECT_THAT(Refusal(R"("views": [)", R"("extra": 1, "views": [)"),
              HasSubstr("\"extra\" is not a known key"));
  EXPECT_THAT(Refusal(R"("pose", )", ""), HasSubstr("unknowns leave out pose"));
  EXPECT_THAT(Refusal(R"("clamp_tilt")", R"("zoom")"), HasSubstr("unknowns name zoom"));
  EXPECT_THAT(Refusal(R"("clamp_tilt")", R"("pose")"), HasSubstr("unknowns name pose twice"));
  EXPECT_THAT(Refusal(R"("clamp_tilt")", "3"), HasSubstr("unknowns name 3"));
}

TEST_F(AlignmentFileTest, NoTruncationOfAFileIsReadAsOne) {
  const std::string text = Text();
  for (std::size_t length = 0; length < text.size(); length += 7) {
    EXPECT_FALSE(Read(text.substr(0, length))) << length;
  }
}

}  // namespace
}  // namespace trammel::files
