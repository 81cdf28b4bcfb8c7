// The examples of examples/tap, run as their readers would.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tap/analyse/analyse.h"
#include "tap/contact/press_test_support.h"

namespace trammel::tap {
namespace {

struct CommandOutput {
  int exit_code = -1;
  std::string text;
};

CommandOutput RunCommand(const std::string& command) {
  CommandOutput said;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) {
    return said;
  }
  std::array<char, 512> buffer{};
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) {
    said.text += buffer.data();
  }
  const int status = pclose(pipe);
  said.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return said;
}

std::string ExpectedText(const test::PressTap& tap) {
  TapAnalyser analyser({});
  const TapAnalysis analysis = analyser.Analyse(tap.View());
  return fmt::format("good: contact at z = {:.5f} mm, 95 % interval {:.5f} to {:.5f} mm",
                     analysis.contact_mm.value, analysis.contact_mm.interval95.lo,
                     analysis.contact_mm.interval95.hi);
}

std::filesystem::path File(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / name;
}

TEST(TapExamples, TheOneInCReadsACsvFile) {
  const test::PressTap tap = test::MakePressTap({}, 1000);
  const auto path = File("trammel_tap_example.csv");
  {
    std::ofstream file(path);
    for (std::size_t i = 0; i < tap.time_s.size(); ++i) {
      file << fmt::format("sample,{},{}\n", tap.time_s[i], tap.force_g[i]);
    }
    for (const Move& m : tap.moves) {
      file << fmt::format("move,{},{},{},{},{},{}\n", m.start_time_s, m.duration_s,
                          m.start_velocity_mm_s, m.acceleration_mm_s2, m.start_z_mm, m.z_direction);
    }
  }
  const CommandOutput said = RunCommand(fmt::format("{} {}", TAP_EXAMPLE, path.string()));
  EXPECT_EQ(said.exit_code, 0) << said.text;
  EXPECT_EQ(said.text.substr(0, said.text.find('\n')), ExpectedText(tap));
  std::filesystem::remove(path);
}

TEST(TapExamples, TheOneInPythonReadsADumpOfTaps) {
  if (std::string(TAP_PYTHON).empty()) GTEST_SKIP() << "Python does not load the library";
  const test::PressTap tap = test::MakePressTap({}, 1000);
  nlohmann::json json = {{"time", tap.time_s}, {"force", tap.force_g}};
  for (const Move& m : tap.moves) {
    json["moves"].push_back({{"print_time", m.start_time_s},
                             {"move_t", m.duration_s},
                             {"start_v", m.start_velocity_mm_s},
                             {"accel", m.acceleration_mm_s2},
                             {"start_z", m.start_z_mm},
                             {"z_r", m.z_direction}});
  }
  const auto path = File("trammel_tap_example.json");
  std::ofstream(path) << json;
  const CommandOutput said =
      RunCommand(fmt::format("{} {} {} {}", TAP_PYTHON, TAP_SCRIPT, TAP_LIBRARY, path.string()));
  EXPECT_EQ(said.exit_code, 0) << said.text;
  EXPECT_EQ(said.text.substr(0, said.text.find('\n')), ExpectedText(tap));
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace trammel::tap
