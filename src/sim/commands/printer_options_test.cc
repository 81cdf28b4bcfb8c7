#include "sim/commands/printer_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/temporary_folder.h"

namespace trammel::app {
namespace {

using ::testing::HasSubstr;

TEST(LoadCellOf, AnUnknownCellOrATruthOfNoneIsRefused) {
  CellArguments arguments;
  arguments.name = "spoon";
  EXPECT_THAT(LoadCellOf(arguments, 1).error().message, HasSubstr("reference"));
  arguments.name.clear();
  arguments.truth = "taps.jsonl";
  EXPECT_THAT(LoadCellOf(arguments, 1).error().message, HasSubstr("--load-cell"));
}

TEST(TapTruthFile, HasALineForEachTapWithOrWithoutContact) {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "taps.jsonl").string();
  Result<TapTruthFile> file = TapTruthFile::Create(path);
  ASSERT_TRUE(file.has_value());
  EXPECT_THAT(TapTruthFile::Create(path).error().message, HasSubstr("taps.jsonl"));
  sim::VirtualKlipper klipper(sim::DefaultKlipperConfig(), {});
  sim::ProbedTap tap;
  tap.surface_z_mm = 0.25;
  klipper.history().taps.push_back(tap);
  EXPECT_TRUE(file->Write(klipper, false));
  EXPECT_EQ(std::filesystem::file_size(path), 0u) << "the nozzle is still on the bed";
  tap.truth.emplace();
  tap.truth->contact_z_mm = 0.24;
  klipper.history().taps.push_back(tap);
  EXPECT_TRUE(file->Write(klipper, false));
  EXPECT_TRUE(file->Write(klipper, true));
  std::ifstream lines(path);
  std::vector<nlohmann::json> truths;
  for (std::string line; std::getline(lines, line);) truths.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(truths.size(), 2u);
  EXPECT_EQ(truths[0]["tap"], 1);
  EXPECT_TRUE(truths[0]["contact_z_mm"].is_null());
  EXPECT_EQ(truths[1]["tap"], 2);
  EXPECT_EQ(truths[1]["contact_z_mm"], 0.24);
  EXPECT_EQ(truths[1]["surface_z_mm"], 0.25);
}

}  // namespace
}  // namespace trammel::app
