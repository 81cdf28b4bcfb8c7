// A survey of a part of 2 m from a hundred drawn pictures of 12 megapixels, by the command: whether
// all codes are read and none wrong, how far the targets are off, and how long it took. Prints what
// docs/part-alignment-survey.md quotes.
//
// TRAMMEL_NETWORKS: 1 without it. TRAMMEL_NETWORKS_SEED: of the first; the reported one is 500000.
// Takes 1.2 GB of the temporary folder.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "image/png_test_support.h"
#include "part_alignment/files/survey_file.h"
#include "part_alignment/survey/survey.h"
#include "part_alignment/survey/survey_picture_test_support.h"
#include "part_alignment/survey/survey_world_test_support.h"
#include "part_alignment/targets/code_book.h"
#include "support/run_trammel.h"

namespace trammel {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using nlohmann::json;
using part_alignment::test::SurveyWorld;

std::uint64_t FromEnvironment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

constexpr std::size_t kFirstNumber = 1000;  // of the pictures' files, in their order

double SecondsOf(const Clock::duration& time) {
  return std::chrono::duration<double>(time).count();
}

json BarsOf(const SurveyWorld& world) {
  json list = json::array();
  for (const auto& bar : world.bars) {
    list.push_back({{"from", bar.from},
                    {"to", bar.to},
                    {"length_mm", bar.length_mm},
                    {"sigma_mm", bar.sigma_mm}});
  }
  return {{"format", 1}, {"scale_bars", list}};
}

/// How many observations lie farther from the target's place in the picture than any sigma
/// explains: a code that was misread. The lens bends nothing and its middle is the picture's.
int Misread(const SurveyWorld& world, const std::vector<part_alignment::SurveyPicture>& pictures) {
  int misread = 0;
  for (const part_alignment::SurveyPicture& picture : pictures) {
    const auto shot_number = std::stoul(fs::path(picture.name).stem().string()) - kFirstNumber;
    const auto& shot = world.shots.at(shot_number);
    for (const auto& seen : picture.observations) {
      const auto target = world.targets.find(seen.target);
      if (target == world.targets.end()) {
        ++misread;
        continue;
      }
      const Eigen::Vector3d ray = target->second.at_mm - shot.place_mm;
      const Eigen::Vector2d at(shot.focal_px * ray.dot(shot.right) / ray.dot(shot.ahead) +
                                   0.5 * (world.scene.width_px - 1),
                               shot.focal_px * ray.dot(shot.down) / ray.dot(shot.ahead) +
                                   0.5 * (world.scene.height_px - 1));
      constexpr double kFar_px = 2;
      misread += (at - Eigen::Vector2d(seen.column_px, seen.row_px)).norm() > kFar_px ? 1 : 0;
    }
  }
  return misread;
}

/// No target lies on another one's rings or quiet zone, as whoever sticks them on sees to.
constexpr double kApart_mm = 2 * 3.75 * 13;

TEST(SurveyPictureStudy, MeasuresAPartFromAHundredPictures) {
  const auto book = part_alignment::MakeCodeBook(20);
  ASSERT_TRUE(book);
  for (std::uint64_t i = 0; i < FromEnvironment("TRAMMEL_NETWORKS", 1); ++i) {
    const std::uint64_t seed = FromEnvironment("TRAMMEL_NETWORKS_SEED", 500000) + i;
    part_alignment::test::SurveyScene scene;
    scene.apart_mm = kApart_mm;
    SurveyWorld world = part_alignment::test::MakeSurveyWorld(scene, seed);
    part_alignment::test::NumberBarEnds(world, 61);
    const test::TemporaryFolder folder;
    fs::create_directory(folder.path() / "pictures");
    Random random(seed);
    for (std::size_t s = 0; s < world.shots.size(); ++s) {
      std::ofstream(folder.path() / "pictures" / fmt::format("{}.png", kFirstNumber + s),
                    std::ios::binary)
          << image::PngOf(part_alignment::test::PictureOf(world, world.shots[s], *book, random));
    }
    std::ofstream(folder.path() / "bars.json") << BarsOf(world).dump();
    const Clock::time_point begin = Clock::now();
    const auto run = test::RunTrammel(
        "align survey pictures --bits 20 --scale-bars bars.json --keep-observations seen.json "
        "--json",
        folder.path());
    const Clock::time_point found = Clock::now();
    ASSERT_EQ(run.exit_code, 0) << run.output;
    const auto again = test::RunTrammel(
        "align survey --observations seen.json --scale-bars bars.json --json", folder.path());
    const Clock::time_point end = Clock::now();
    ASSERT_EQ(again.exit_code, 0) << again.output;

    const auto pictures = files::ReadSurveyFile(folder.path() / "seen.json");
    ASSERT_TRUE(pictures) << pictures.error().message;
    part_alignment::SurveyInput input;
    input.pictures = *pictures;
    input.bars = world.bars;
    const auto survey = part_alignment::SolveSurvey(input, {});
    ASSERT_TRUE(survey);
    const auto errors = part_alignment::test::ErrorsOf(world, *survey);
    std::size_t observations = 0;
    for (const auto& picture : *pictures) observations += picture.observations.size();
    const int misread = Misread(world, *pictures);
    const double rms_um = 1e3 * std::sqrt(errors.coordinates.squaredNorm() /
                                          static_cast<double>(errors.coordinates.size()));
    fmt::print(
        "seed {}: {} observations, {} misread; {} of {} targets given, {} observations left out; "
        "rms "
        "{:.1f} um, worst {:.0f} um, stated {:.1f} um; NEES / freedom {:.3f}; pictures to answer "
        "{:.1f} s, "
        "of which the adjustment {:.1f} s\n",
        seed, observations, misread, survey->targets.size(), world.targets.size(),
        survey->outliers.size(), rms_um, 1e3 * errors.coordinates.cwiseAbs().maxCoeff(),
        1e3 *
            std::sqrt(survey->covariance.trace() / static_cast<double>(errors.coordinates.size())),
        errors.nees / errors.freedom, SecondsOf(found - begin), SecondsOf(end - found));
    std::fflush(stdout);
    EXPECT_EQ(misread, 0);
    EXPECT_LE(rms_um, 15);
    std::set<std::string> given;
    for (const auto& target : survey->targets) given.insert(target.id);
    for (const auto& [id, target] : world.targets) EXPECT_TRUE(given.contains(id)) << id;
  }
}

}  // namespace
}  // namespace trammel
