// Measures the errors of trammel pa setup on virtual printers whose heads are drawn by seed, and
// the coverage of its intervals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/random.h"
#include "setup_scene.h"
#include "support/matchers.h"
#include "support/study.h"

namespace trammel::test {
namespace {

// Plates without glinting bumps, and filament that can be told from them: else the mark is not
// seen, which is said.
constexpr const char* kConditions[] = {"matte-black-dark", "matte-white-dark", "pei-black-dark"};

TEST(SetupStudy, ErrorsStayWithinTheirBoundsAndIntervals) {
  const std::map<std::string, double> borne = {
      {"offset_x_mm", 0.05}, {"offset_y_mm", 0.05},   {"focus_height_mm", 0.2}, {"px_per_mm", 0.01},
      {"rotation_deg", 0.3}, {"laser_turn_deg", 0.3}, {"laser_sheet_deg", 1.0}};
  std::map<std::string, std::vector<SetupError>> errors;
  int answered = 0;
  const StudySeeds seeds = SeedsOfStudy(20);
  for (int i = 0; i < seeds.count; ++i) {
    const std::uint64_t seed = seeds.first + static_cast<std::uint64_t>(i);
    const sim::MountedRig rig = sim::DrawHeadRig(Random(seed).Fork(1));
    const auto condition = Must(sim::ParseCondition(kConditions[seed % std::size(kConditions)]));
    MachineShop shop(SetupHall(seed, rig, condition));
    const ProcessEnd end = shop.Run(SetupArguments(shop, {"--json"}));
    if (end.exit_code != 0) {
      std::printf("%lu: exit code %d: %s %s\n", static_cast<unsigned long>(seed), end.exit_code,
                  end.standard_error.c_str(), end.standard_output.c_str());
      continue;
    }
    ++answered;
    std::printf("%lu:", static_cast<unsigned long>(seed));
    for (const SetupError& error :
         SetupErrors(nlohmann::json::parse(end.standard_output), TruthOf(seed, rig, condition))) {
      errors[error.name].push_back(error);
      std::printf("  %s %+.4f%s", error.name.c_str(), error.error, error.covered ? "" : " *");
    }
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("%d of %d answered\n", answered, seeds.count);
  EXPECT_EQ(answered, seeds.count);
  for (const auto& [name, list] : errors) {
    double worst = 0, sum = 0, uncertainty = 0;
    int covered = 0;
    for (const SetupError& error : list) {
      worst = std::max(worst, std::abs(error.error));
      sum += error.error * error.error;
      uncertainty += error.standard_uncertainty;
      covered += error.covered;
    }
    const auto count = static_cast<double>(list.size());
    std::printf("%-16s rms %.4f, worst %.4f, mean u %.4f, %d of %zu covered\n", name.c_str(),
                std::sqrt(sum / count), worst, uncertainty / count, covered, list.size());
    EXPECT_LT(worst, borne.at(name)) << name;
    constexpr double kMinCovered = 0.8;  // of 20 at 95 %: fewer than 16 once in 400 studies
    EXPECT_GE(covered, kMinCovered * count) << name;
  }
}

TEST(SetupStudy, AMirroredPictureIsNamed) {
  sim::MountedRig rig;
  rig.rig.flip_x = true;
  MachineShop shop(SetupHall(7, rig));
  const PrinterLook before = shop.Look();
  EXPECT_THAT(shop.Run(SetupArguments(shop)), Prints(2, "refused", "mirrored"));
  EXPECT_FALSE(std::filesystem::exists(shop.folder() / "set" / "camera.toml"));
  EXPECT_THAT(shop.Faulty(before), testing::IsEmpty());
}

TEST(SetupStudy, ALooseMountIsNamed) {
  sim::MountedRig rig;
  rig.rig.mount_backlash_mm = 0.4;
  MachineShop shop(SetupHall(7, rig));
  const PrinterLook before = shop.Look();
  EXPECT_THAT(shop.Run(SetupArguments(shop)),
              Prints(2, testing::AnyOf(testing::HasSubstr("mount"), testing::HasSubstr("loose"),
                                       testing::HasSubstr("hangs"))));
  EXPECT_THAT(shop.Faulty(before), testing::IsEmpty());
}

}  // namespace
}  // namespace trammel::test
