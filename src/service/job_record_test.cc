#include "service/job_record.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "session/fake_printer.h"
#include "support/temporary_folder.h"

namespace trammel::service {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

KeptState Sample() {
  KeptState state;
  state.run = RunRecord{.id = "pressure_advance-20260102T030405Z",
                        .job = "pressure_advance",
                        .arguments = {{"filament", "PLA+ 50%; \"x\""}},
                        .folder = "/home/pi/rec/a",
                        .started = "2026-01-02T03:04:05Z",
                        .ended = "2026-01-02T03:14:05Z",
                        .message = "pressure_advance = 0.0172 s",
                        .end = RunEnd::kDone,
                        .verdict = "good"};
  state.proposal =
      Proposal{state.run->id, "pressure_advance", state.run->folder, state.run->arguments};
  return state;
}

json Written(const KeptState& state) {
  const test::TemporaryFolder folder;
  const auto path = KeptStatePath(folder.path(), "ws://localhost:7125/websocket");
  const auto written = WriteKeptState(path, state);
  EXPECT_TRUE(written) << written.error().message;
  return json::parse(test::ReadWhole(path));
}

std::string FaultOf(const json& json) {
  const auto read = ParseKeptState(json.dump(), "s.json");
  return read ? "" : read.error().message;
}

TEST(KeptState, ComesBackAsItWas) {
  const test::TemporaryFolder folder;
  const auto path = KeptStatePath(folder.path(), "ws://localhost:7125/websocket");
  EXPECT_FALSE(ReadKeptState(path)->run);
  ASSERT_TRUE(WriteKeptState(path, Sample()));
  const auto read = ReadKeptState(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->run->id, Sample().run->id);
  EXPECT_EQ(read->run->arguments, Sample().run->arguments);
  EXPECT_EQ(read->run->end, RunEnd::kDone);
  EXPECT_EQ(read->run->verdict, "good");
  EXPECT_EQ(read->proposal->folder, Sample().proposal->folder);
  ASSERT_TRUE(WriteKeptState(path, {}));
  EXPECT_FALSE(ReadKeptState(path)->run || ReadKeptState(path)->proposal);
}

TEST(KeptState, ARunThatDidNotEndIsUnknown) {
  KeptState state = Sample();
  state.run->end = RunEnd::kNone;
  state.run->ended.clear();
  const auto read = ParseKeptState(Written(state).dump(), "s.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->run->end, RunEnd::kUnknown);
  EXPECT_THAT(read->run->message, HasSubstr("ended during this run"));
}

TEST(KeptState, WhatNoServiceWritesIsRefusedByItsName) {
  const auto changed = [](const auto& change) {
    json state = Written(Sample());
    change(state);
    return FaultOf(state);
  };
  EXPECT_THAT(changed([](json& s) { s["format"] = 2; }), HasSubstr("s.json: format"));
  EXPECT_THAT(changed([](json& s) { s["run"]["run"] = "../x"; }), HasSubstr("run.run"));
  EXPECT_THAT(changed([](json& s) { s["run"]["end"] = "well"; }), HasSubstr("run.end"));
  EXPECT_THAT(changed([](json& s) { s["run"]["arguments"]["filament"] = 3; }),
              HasSubstr("run.arguments"));
  EXPECT_THAT(changed([](json& s) { s["proposal"]["folder"] = std::string(5000, 'a'); }),
              HasSubstr("proposal.folder"));
  EXPECT_THAT(changed([](json& s) { s["proposal"] = 3; }), HasSubstr("proposal"));
  EXPECT_THAT(changed([](json& s) { s["more"] = 3; }), HasSubstr("more"));
  EXPECT_FALSE(ParseKeptState("{", "s.json"));
}

using procedure::testing::FakePrinter;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A printer whose config/trammel holds files; notes what is removed.
class ResultPictureTest : public ::testing::Test {
 protected:
  ResultPictureTest() {
    printer_.server = [this](const std::string& method, const json& params) -> Result<json> {
      if (method == "server.files.get_directory") {
        EXPECT_EQ(params["path"], "config/trammel");
        return listed_;
      }
      EXPECT_EQ(method, "server.files.delete_file");
      removed_.push_back(params["path"]);
      return json::object();
    };
  }
  void Holds(const std::string& name) { listed_["files"].push_back({{"filename", name}}); }
  void HoldsMonths(int months) {
    for (int i = months; i >= 1; --i) Holds(fmt::format("tap-2026{:02}02T030405Z.png", i));
  }

  FakePrinter printer_;
  json listed_ = {{"dirs", json::array()}, {"files", json::array()}};
  std::vector<std::string> removed_;
};

TEST_F(ResultPictureTest, LiesInAFolderBesideTheConfiguration) {
  ASSERT_TRUE(StorePicture(printer_, "pressure_advance-20260102T030405Z", "png", {1}));
  EXPECT_EQ(printer_.config_files["trammel/pressure_advance-20260102T030405Z.png"], "png");
  EXPECT_THAT(removed_, IsEmpty());
}

TEST_F(ResultPictureTest, TheOldestOfMoreThanTwentyAreRemoved) {
  HoldsMonths(12);
  Holds("pressure_advance-20250102T030405Z-2.png");
  for (int day = 10; day < 19; ++day) Holds(fmt::format("pa-202701{}T030405Z.png", day));
  ASSERT_TRUE(StorePicture(printer_, "pa-20270120T030405Z", "png", {1}));
  EXPECT_THAT(removed_, ElementsAre("config/trammel/pressure_advance-20250102T030405Z-2.png",
                                    "config/trammel/tap-20260102T030405Z.png"));
}

TEST_F(ResultPictureTest, FilesOfOtherNamesAreNeitherCountedNorRemoved) {
  HoldsMonths(12);
  for (int i = 0; i < 30; ++i) {
    Holds(fmt::format("holiday{}.png", i));
    Holds(fmt::format("pa-20260102T030405Z.{}.png", i));
    Holds(fmt::format("pa-2026010XT0304{:02}Z.png", i));
    Holds(fmt::format("pa-202601{:02}.png", i));
    Holds(fmt::format("../pa-202601{:02}T030405Z.png", i));
  }
  listed_["files"].push_back(5);
  listed_["files"].push_back({{"filename", 5}});
  ASSERT_TRUE(StorePicture(printer_, "pa-20270120T030405Z", "png", {1}));
  EXPECT_THAT(removed_, IsEmpty());
}

}  // namespace
}  // namespace trammel::service
