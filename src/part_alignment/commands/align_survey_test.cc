// trammel align survey: from pictures, and from what was seen in them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "image/png_test_support.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/files/survey_file.h"
#include "part_alignment/files/target_file.h"
#include "part_alignment/survey/survey_world_test_support.h"
#include "part_alignment/targets/code_book.h"
#include "support/matchers.h"
#include "support/run_trammel.h"
#include "support/target_picture.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;

using nlohmann::json;
using part_alignment::Survey;
using part_alignment::test::SurveyScene;
using part_alignment::test::SurveyWorld;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class AlignSurvey : public testing::Test {
 protected:
  [[nodiscard]] test::CommandResult Run(const std::string& arguments) const {
    return test::RunTrammel("align survey " + arguments, folder_.path());
  }
  [[nodiscard]] fs::path At(const std::string& name) const { return folder_.path() / name; }
  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(At(name), std::ios::binary) << bytes;
  }
  void WriteBars(const std::vector<part_alignment::ScaleBar>& bars) const {
    json list = json::array();
    for (const auto& bar : bars) {
      list.push_back({{"from", bar.from},
                      {"to", bar.to},
                      {"length_mm", bar.length_mm},
                      {"sigma_mm", bar.sigma_mm}});
    }
    Write("bars.json", json({{"format", 1}, {"scale_bars", list}}).dump());
  }
  /// A survey's observations and bars as files, and the world that they are of.
  SurveyWorld WriteObservations(int plain = 0) const {
    SurveyScene scene;
    scene.codes = 40;
    scene.pictures = 40;
    scene.plain = plain;
    SurveyWorld world = part_alignment::test::MakeSurveyWorld(scene, 31);
    const auto input = part_alignment::test::Photograph(world, 31);
    Write("observations.json", files::SurveyFileText(input.pictures));
    WriteBars(input.bars);
    return world;
  }

  test::TemporaryFolder folder_;
};

/// Targets and covariance as --json has them.
Survey SurveyOf(const json& answer) {
  Survey survey;
  for (const json& entry : answer.at("targets")) {
    const auto at = entry.at("ideal_mm").get<std::vector<double>>();
    survey.targets.push_back({});
    survey.targets.back().id = entry.at("id").get<std::string>();
    survey.targets.back().at_mm = {at[0], at[1], at[2]};
  }
  const auto rows = answer.at("targets_covariance_mm2").get<std::vector<std::vector<double>>>();
  survey.covariance.resize(static_cast<Eigen::Index>(rows.size()),
                           static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      survey.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = rows[i][k];
    }
  }
  return survey;
}

TEST_F(AlignSurvey, LeavesPlainTargetsForTheFit) {
  constexpr int kPlain = 30;
  WriteObservations(kPlain);
  ASSERT_THAT(
      Run("--observations observations.json --scale-bars bars.json --out targets.json --points "
          "points.csv --surface top --report report"),
      Prints(0, "plain targets of", "target    P1 "));
  const json answer = json::parse(test::ReadWhole(At("targets.json")));
  const json& plain = answer.at("plain_targets");
  ASSERT_GE(plain.size(), 20U);
  EXPECT_EQ(plain.size(), answer.at("plain").at("targets"));
  EXPECT_EQ(plain[0].at("id"), "P1");
  EXPECT_GT(plain[0].at("covariance_mm2")[2][2].get<double>(), 0);
  // Those that a camera in the spindle can read are targets of align solve.
  const auto targets = Must(files::ReadTargetFile(At("targets.json")));
  const auto points = Must(files::ReadPointTable(At("points.csv")));
  ASSERT_EQ(points.size(), targets.targets.size() + plain.size());
  EXPECT_EQ(points.back().surface, "top");
  EXPECT_EQ(points.front().surface, "");
  EXPECT_THAT(test::ReadWhole(At("report/report.html")), HasSubstr("plain targets of"));
  EXPECT_THAT(Run("--observations observations.json --surface a,b").standard_error,
              HasSubstr("--surface a,b"));
}

TEST_F(AlignSurvey, SaysWhatIsMissingAndWritesNoTargets) {
  WriteObservations();
  const auto run = Run("--observations observations.json --out targets.json --json");
  EXPECT_EQ(run.exit_code, 2) << run.output;
  const json answer = json::parse(run.standard_output);
  EXPECT_EQ(answer.at("verdict"), "cannot_tell");
  EXPECT_THAT(answer.at("reason").get<std::string>(), HasSubstr("no scale bar"));
  EXPECT_TRUE(answer.at("targets").is_null());
  EXPECT_FALSE(fs::exists(At("targets.json")));
}

TEST_F(AlignSurvey, NamesABarAloneAsUncheckedInTheHeadOfEveryAnswer) {
  const SurveyWorld world = WriteObservations();
  WriteBars({world.bars[0]});
  const std::string arguments = "--observations observations.json --scale-bars bars.json ";
  ASSERT_THAT(
      Run(arguments + "--report report"),
      Prints(0, StartsWith("verdict   good\nunchecked the scale rests on one bar alone, 901-902")));
  const json answer = json::parse(Run(arguments + "--json").standard_output);
  ASSERT_EQ(answer.at("unchecked").size(), 1U);
  EXPECT_TRUE(answer.at("scale_bars")[0].at("detectable_mm").is_null());
  const std::string page = test::ReadWhole(At("report/report.html"));
  EXPECT_LT(page.find("Unchecked: the scale rests"), page.find("</section>"));
}

TEST_F(AlignSurvey, RefusesWhatCannotBeByName) {
  EXPECT_THAT(Run("").standard_error, HasSubstr("pictures, --observations FILE, or both"));
  fs::create_directory(At("empty"));
  EXPECT_THAT(Run("empty").standard_error, HasSubstr("empty: no picture"));
  EXPECT_THAT(Run("none.jpg").standard_error, HasSubstr("none.jpg"));
  EXPECT_THAT(Run("--observations none.json").standard_error, HasSubstr("none.json"));
  Write("bars.json", R"({"format": 1, "bars": []})");
  EXPECT_THAT(Run("--scale-bars bars.json --observations none.json"),
              Fails(1, "bars.json: scale_bars is missing"));
  Write("observations.json",
        R"({"format": 1, "pictures": [{"name": "a", "image_px": [4000, 3000], "observations":
            [{"target": 1, "column_px": 3, "row_px": 4, "sigma_px": -1}]}]})");
  EXPECT_THAT(Run("--observations observations.json").standard_error,
              HasSubstr("pictures[0].observations[0].sigma_px"));
}

// Eight discs among codes, dots of codes within them, one code half covered, a lamp's image.
TEST_F(AlignSurvey, TakesDiscsThatAreNoPartOfACodeForPlainPoints) {
  const auto book = Must(part_alignment::MakeCodeBook(14));
  std::vector<test::DrawnTarget> drawn;
  std::vector<Eigen::Vector2d> discs;
  for (int i = 0; i < 8; ++i) {
    test::DrawnTarget code = test::AffineTarget(120 + 150.3 * i, 150.7, 10, 0.3, 0.4 * i);
    code.bits = book.bits;
    code.word = book.words.at(static_cast<std::size_t>(i));
    drawn.push_back(code);
    discs.emplace_back(130.4 + 150 * i, 600.2 + 7 * i);
    drawn.push_back(test::AffineTarget(discs.back().x(), discs.back().y(), 7, 0.5, 0.6 * i));
  }
  test::Look look;
  look.paper = 60;
  look.ink = 200;
  look.gloss = {700, 400, 6, 400};
  Random random(33);
  test::GreyImage image = test::Draw(1400, 900, drawn, look);
  for (int row = 100; row < 200; ++row) {
    for (int column = 1180; column < 1250; ++column)
      image.values[static_cast<std::size_t>(row * 1400 + column)] = 60;
  }
  const Page page = test::Expose(image, 1.0, random);
  Write("one.png", image::PngOf(page));
  EXPECT_EQ(Run("one.png --plain --keep-observations kept.json").exit_code, 2);
  const auto kept = Must(files::ReadSurveyFile(At("kept.json")));
  const auto& picture = kept.front();
  EXPECT_EQ(picture.observations.size(), 7U);
  ASSERT_EQ(picture.plain.size(), discs.size());
  for (const auto& point : picture.plain) {
    const Eigen::Vector2d at(point.column_px, point.row_px);
    const bool known = std::any_of(discs.begin(), discs.end(), [&](const Eigen::Vector2d& disc) {
      constexpr double kFiveSigmas = 5;
      return (disc - at).cwiseAbs().maxCoeff() < kFiveSigmas * point.sigma_px + 0.02;
    });
    EXPECT_TRUE(known) << at.transpose();
    ASSERT_TRUE(point.disc);
    EXPECT_NEAR(point.disc->semi_major_px, 7, 0.2);
  }
  EXPECT_EQ(Run("one.png --keep-observations coded.json").exit_code, 2);
  const auto coded = Must(files::ReadSurveyFile(At("coded.json")));
  EXPECT_TRUE(coded.front().plain.empty());
}

TEST_F(AlignSurvey, MeasuresAPartFromItsPictures) {
  SurveyScene scene;
  scene.codes = 24;
  scene.pictures = 24;
  scene.width_px = 1600;
  scene.height_px = 1200;
  scene.focal_px = 1109;
  SurveyWorld world = part_alignment::test::MakeSurveyWorld(scene, 32);
  part_alignment::test::NumberBarEnds(world, 41);  // from the 14-bit book
  const auto book = Must(part_alignment::MakeCodeBook(14));
  fs::create_directory(At("pictures"));
  Random random(32);
  for (std::size_t s = 0; s < world.shots.size(); ++s) {
    Write("pictures/" + std::to_string(100 + s) + ".png",
          image::PngOf(part_alignment::test::PictureOf(world, world.shots[s], book, random)));
  }
  WriteBars(world.bars);
  const auto run =
      Must(Run("pictures --scale-bars bars.json --keep-observations observations.json --json"));
  const Survey survey = SurveyOf(json::parse(run.standard_output));
  EXPECT_GE(survey.targets.size(), 12U);
  const auto errors = part_alignment::test::ErrorsOf(world, survey);
  constexpr double kFiveSigma = 5;
  for (Eigen::Index i = 0; i < errors.coordinates.size(); ++i) {
    EXPECT_LT(std::abs(errors.coordinates[i]), kFiveSigma * std::sqrt(survey.covariance(i, i)));
  }
  EXPECT_LT(errors.coordinates.cwiseAbs().maxCoeff(), 0.5);
  // Pictures that come one by one yield the same observations.
  for (std::size_t s = 0; s < 3; ++s) {
    const std::string before = s == 0 ? "" : " --observations few.json";
    (void)Run("pictures/" + std::to_string(100 + s) + ".png" + before +
              " --keep-observations few.json --force");
  }
  const json few = json::parse(test::ReadWhole(At("few.json"))).at("pictures");
  const json all = json::parse(test::ReadWhole(At("observations.json"))).at("pictures");
  ASSERT_EQ(few.size(), 3U);
  for (std::size_t s = 0; s < few.size(); ++s) EXPECT_EQ(few[s], all[s]);
  EXPECT_THAT(Run("pictures/100.png --observations few.json").standard_error,
              HasSubstr("100.png: few.json has a picture of that name already"));
  // The stored observations yield the same answer.
  const auto again = Run("--observations observations.json --scale-bars bars.json --json");
  EXPECT_EQ(json::parse(again.standard_output).at("targets"),
            json::parse(run.standard_output).at("targets"));
}

}  // namespace
}  // namespace trammel
