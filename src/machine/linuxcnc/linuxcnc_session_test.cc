// Invalid messages of a helper; tests of the controller itself:
// tests/integration/linuxcnc_session_test.cc.
#include "machine/linuxcnc/linuxcnc_session.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "machine/linuxcnc/linuxcnc.h"
#include "machine/linuxcnc/session_script.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

// A program in Python's place that says one thing at first and another to every request.
class LinuxCncSessionAnswers : public testing::Test {
 protected:
  Result<std::unique_ptr<LinuxCncSession>> Join(const std::string& hello,
                                                const std::string& answer) const {
    const auto python = folder_.path() / "python3";
    test::WriteWhole(python, fmt::format("#!/bin/sh\ncat <<'E'\n{}\nE\nwhile read -r line; do cat "
                                         "<<'E'\n{}\nE\ndone\n",
                                         hello, answer));
    std::filesystem::permissions(python, std::filesystem::perms::owner_all);
    return LinuxCncSession::Join({.helper = {python}, .time_limit_s = 5}, {});
  }

 private:
  test::TemporaryFolder folder_;
};

// Python takes modules of the current folder first, unless it is told not to.
TEST(LinuxCncSessionPython, RunsNothingOfTheCurrentFolder) {
  const test::TemporaryFolder folder;
  const auto ran = folder.path() / "ran";
  for (const char* module : {"json", "signal", "os", "linuxcnc", "sitecustomize", "pwd"}) {
    test::WriteWhole(folder.path() / (std::string(module) + ".py"),
                     fmt::format("open('{}', 'w')\n", ran.string()));
  }
  const auto python = folder.path() / "python";
  test::WriteWhole(python,
                   fmt::format("#!/bin/sh\ncd {}\nPYTHONPATH=.: exec /usr/bin/python3 \"$@\"\n",
                               folder.path().string()));
  std::filesystem::permissions(python, std::filesystem::perms::owner_all);
  const auto joined = LinuxCncSession::Join(
      {.helper = {python, "-I", "-c", kSessionScript}, .time_limit_s = 20}, {});
  EXPECT_FALSE(std::filesystem::exists(ran));
  EXPECT_FALSE(joined);  // no LinuxCNC runs here
}

TEST_F(LinuxCncSessionAnswers, WhatIsNoAnswerIsNamedAndNothingIsMadeOfIt) {
  for (const char* answer :
       {"[]", "{}", R"({"id": 1})", R"({"id": 1, "error": 3})",
        R"({"id": 1, "position": [1, 2, 3], "mode": "MDI", "idle": true, "spindle_stopped": true})",
        R"({"id": 1, "position": [1, 2, 3, 4], "mode": "MDI", "idle": true,)"
        R"( "spindle_stopped": true})",
        R"({"id": 1, "position": [1, 2, 3, "4"], "mode": "MDI", "idle": true,)"
        R"( "spindle_stopped": true})",
        R"({"id": 1, "position": [1, 2, 3, 4], "mode": 3, "idle": true, "spindle_stopped": true})",
        R"({"id": 1, "position": [1, 2, 3, 1e999], "mode": "MDI", "idle": 1})"}) {
    const auto session = Must(Join(R"({"id": 0})", answer));
    EXPECT_THAT(session->Motion({}), FailsWith(ErrorKind::kMachine, "no answer")) << answer;
  }
}

constexpr const char* kInches =
    R"({"id": 1, "position": [1, 2, 3, 0], "commanded": [1, 2, 3, 0], "mode": "MANUAL", "idle": true,)"
    R"( "spindle_stopped": true, "estop": false, "on": true, "metric": false, "c_axis": false,)"
    R"( "feed_override": 1, "fastest_mm_s": 10, "homed": [1, 0, 1], "axes": "XYZ", "unit_mm": 25.4,)"
    R"( "joints": 3, "tool": 7, "tool_length": 2, "tools": 4, "low": [0, 0, -1e99, 0],)"
    R"( "high": [10, 20, 0, 0]})";

TEST_F(LinuxCncSessionAnswers, FactsAreInMillimetresWhateverTheMachinesOwnUnit) {
  const auto session = Must(Join(R"({"id": 0})", kInches));
  const auto facts = Must(session->Facts({}));
  EXPECT_FALSE(facts.state.metric);
  EXPECT_FALSE(facts.state.homed);
  EXPECT_EQ(facts.not_homed, std::vector<int>{1});
  EXPECT_TRUE(facts.HasAxis('Z'));
  EXPECT_FALSE(facts.HasAxis('C'));
  EXPECT_EQ(facts.tool, 7);
  EXPECT_DOUBLE_EQ(facts.tool_length_mm, 50.8);
  EXPECT_EQ(facts.travel.low_mm, Eigen::Vector3d(0, 0, -kFarthest_mm));
  EXPECT_EQ(facts.travel.high_mm, Eigen::Vector3d(254, 508, 0));
}

TEST_F(LinuxCncSessionAnswers, FactsThatCannotBeAreNamed) {
  for (const auto& [was, is] : std::vector<std::pair<std::string, std::string>>{
           {"\"joints\": 3", "\"joints\": 0"},
           {"\"joints\": 3", "\"joints\": 9"},
           {"\"unit_mm\": 25.4", "\"unit_mm\": -1"},
           {"\"unit_mm\": 25.4", "\"unit_mm\": \"mm\""},
           {"\"high\": [10, 20, 0, 0]", "\"high\": [10, 20]"},
           {"\"axes\": \"XYZ\"", "\"axes\": 7"}}) {
    std::string answer = kInches;
    answer.replace(answer.find(was), was.size(), is);
    const auto session = Must(Join(R"({"id": 0})", answer));
    EXPECT_THAT(session->Facts({}), FailsWith("no answer")) << is;
  }
}

TEST_F(LinuxCncSessionAnswers, ATakeOverIsAMatterOfSafety) {
  const auto session =
      Must(Join(R"({"id": 0})", R"({"id": 1, "error": "somebody took over", "kind": "taken"})"));
  EXPECT_THAT(session->Move("G53 G1 X1", {}), FailsWith(ErrorKind::kSafety));
}

}  // namespace
}  // namespace trammel::machine
