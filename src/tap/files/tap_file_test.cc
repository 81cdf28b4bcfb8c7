#include "tap/files/tap_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "support/little_memory.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"
#include "tap/files/moves_from_z.h"
#include "tap/files/tap_csv.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using tap::Recording;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr const char* kMoves =
    R"([{"print_time":1,"move_t":2,"start_v":3,"accel":4,"start_x":7,"start_y":8,"start_z":5,"x_r":0,"y_r":0,"z_r":-1}])";

std::string Tap(const std::string& more = "") {
  return fmt::format(R"({{"time":[0.1,0.2],"force":[-1.5,2],"moves":{}{}}})", kMoves, more);
}

std::string FaultOf(const std::string& text) {
  const auto taps = ParseTaps(text, "f.json");
  return taps ? "no fault" : taps.error().message;
}

TEST(TapFile, AFileOfNothingButBracesIsRefusedInLittleMemory) {
  const test::TemporaryFolder folder;
  constexpr std::size_t kBytes = 60'000'000;
  struct Bomb {
    std::string start;
    std::string again;
  };
  for (const Bomb& bomb : {Bomb{"", "{\"\":"}, Bomb{"[", "[],"}, Bomb{"", "["}, Bomb{"[", "{},"},
                           Bomb{"[", "1,"}, Bomb{"[", "\"\","}}) {
    std::string text = bomb.start;
    text.reserve(kBytes);
    while (text.size() + bomb.again.size() <= kBytes) text += bomb.again;
    const fs::path path = folder.path() / "f.json";
    test::WriteWhole(path, text);
    text = {};
    EXPECT_THAT(test::WithLittleMemory(
                    [&] {
                      const auto taps = ReadTaps(path);
                      return taps ? std::string("read") : taps.error().message;
                    },
                    {.bytes = 900ULL << 20U}),
                testing::AnyOf(HasSubstr("16 deep"), HasSubstr("512 MB of memory")))
        << bomb.again;
  }
}

TEST(TapFile, MovesAreReadFromARegularFileOnly) {
  const test::TemporaryFolder folder;
  test::WriteWhole(folder.path() / "a.csv", "0,1\n1,2\n");
  ASSERT_EQ(mkfifo((folder.path() / "a.moves.csv").c_str(), 0600), 0);
  EXPECT_THAT(ReadTaps(folder.path() / "a.csv"), FailsWith("a.moves.csv: is not a regular file"));
}

TEST(TapFile, ReadsEveryFieldOfATap) {
  const auto taps = Must(ParseTaps(
      Tap(R"(,"tap_pos":[1,2,0.25],"is_valid":true,"z":[1,2],"x_nozzle_temperature_c":150)"),
      "f.json"));
  ASSERT_THAT(taps, SizeIs(1));
  const Recording& tap = taps.front();
  EXPECT_EQ(tap.name, "f.json");
  EXPECT_THAT(tap.time_s, testing::ElementsAre(0.1, 0.2));
  EXPECT_THAT(tap.force_g, testing::ElementsAre(-1.5, 2));
  ASSERT_THAT(tap.moves, SizeIs(1));
  EXPECT_EQ(tap.moves[0].start_time_s, 1);
  EXPECT_EQ(tap.moves[0].duration_s, 2);
  EXPECT_EQ(tap.moves[0].start_velocity_mm_s, 3);
  EXPECT_EQ(tap.moves[0].acceleration_mm_s2, 4);
  EXPECT_EQ(tap.moves[0].start_z_mm, 5);
  EXPECT_EQ(tap.moves[0].z_direction, -1);
  EXPECT_EQ(tap.x_mm, 7);
  EXPECT_EQ(tap.y_mm, 8);
  EXPECT_EQ(tap.firmware_z_mm, 0.25);
  EXPECT_THAT(tap.z_mm, testing::ElementsAre(1, 2));
  EXPECT_EQ(tap.nozzle_temperature_c, 150);
}

TEST(TapFile, FindsTapsInListsNotificationsAndJsonLinesInTheirOrder) {
  const std::string second = R"({"time":[5],"force":[6],"moves":[]})";
  const std::string inner = R"({"method":"m","params":{"tap":)" + Tap() + "}}";
  for (const std::string& text :
       {"[" + Tap() + "," + second + "]", Tap() + "\n" + second + "\n",
        inner + "\n\n{\"params\":{\"tap\":" + second + "}}",
        "{\"taps\":[" + Tap() + ",\n" + second + "]}",
        "{\"id\":1,\"result\":{\"header\":[\"probe_tap_event\"]}}\n" + inner + "\n" + second,
        "\xEF\xBB\xBF[" + inner + ",{\"tap\":" + second + "}]"}) {
    const auto taps = ParseTaps(text, "f");
    ASSERT_TRUE(taps) << taps.error().message << "\n" << text;
    ASSERT_THAT(*taps, SizeIs(2)) << text;
    EXPECT_EQ((*taps)[0].time_s[0], 0.1);
    EXPECT_EQ((*taps)[1].time_s[0], 5);
    EXPECT_EQ((*taps)[1].name, "f tap 2");
  }
}

TEST(TapFile, FaultsNameFileTapKeyValueAndRemedy) {
  const std::pair<std::string, std::vector<std::string>> cases[] = {
      {"", {"f.json", "is not JSON"}},
      {"{}", {"time is missing", "lists time and force"}},
      {"[]", {"holds no tap", "time, force and moves"}},
      {"3", {"content is 3", "object"}},
      {"[1,2]", {"[0] is 1", "object"}},
      {R"({"time":[1]})", {"force is missing"}},
      {R"({"time":[1,2],"force":[1]})", {"force has 1 entries and time has 2"}},
      {R"({"time":[1],"force":["1"]})", {"force[0] is \"1\"", "number"}},
      {R"({"time":1,"force":[1]})", {"time is 1", "list"}},
      {R"([{"time":[1],"force":[1]},{"time":[1],"force":[1],"moves":[{"print_time":1}]}])",
       {"[1].moves[0].move_t is missing"}},
      {R"({"time":[1],"force":[1],"moves":[{"print_time":"soon"}]})",
       {"moves[0].print_time is \"soon\""}},
      {R"({"time":[1],"force":[NaN]})", {"is not JSON", "NaN"}},
      {R"({"time":[1],"force":[Infinity]})", {"is not JSON"}},
      {R"({"time":[1],"force":[1e999]})", {"f.json"}},
      {Tap() + "\n" + Tap().substr(0, 30), {"f.json line 2", "cut off"}},
      {Tap().substr(0, 30), {"cut off"}},
      {std::string(100'000, '['), {"f.json"}},
      {std::string(40, '[') + std::string(40, ']'), {"nested more than 16"}},
  };
  for (const auto& [text, wanted] : cases) {
    for (const std::string& word : wanted) {
      EXPECT_THAT(FaultOf(text), HasSubstr(word)) << text.substr(0, 200);
    }
  }
}

TEST(TapFile, TenMillionSamplesAreRefusedWithoutBeingKept) {
  std::string numbers = "0";
  for (int i = 1; i < 10'000'000; ++i) numbers += ",1";
  EXPECT_THAT(FaultOf("{\"time\":[" + numbers + "],\"force\":[1]}"),
              HasSubstr("time has 10000000 entries"));
  std::string table;
  for (int i = 0; i < 10'000'000; ++i) table += "1,2\n";
  EXPECT_THAT(ParseTapCsv(table, "f.csv"), FailsWith("more than 1200000 samples"));
}

TEST(TapCsv, ReadsTablesWithAndWithoutNames) {
  for (const std::string text : {"0.5,-3\n0.6,4\n", "time,force\n0.5,-3\n0.6,4",
                                 "# cell 1\n\nforce;z;time\r\n-3;1;0.5\r\n4;2;0.6\r\n",
                                 "\xEF\xBB\xBFtime_s\tforce_g\n0.5\t-3\n0.6\t4\n"}) {
    const auto tap = Must(ParseTapCsv(text, "f.csv"));
    EXPECT_THAT(tap.time_s, testing::ElementsAre(0.5, 0.6)) << text;
    EXPECT_THAT(tap.force_g, testing::ElementsAre(-3, 4)) << text;
  }
}

TEST(TapCsv, FaultsNameLineColumnAndValue) {
  const std::pair<const char*, const char*> cases[] = {
      {"1\n", "one column"},
      {"time,weight\n", "no column 'force'"},
      {"1,2\n3\n", "f.csv:2: has 1 columns"},
      {"1,2\n3,four\n", "f.csv:2: force is \"four\""},
      {"1,2,3\n3,4\n", "f.csv:2: has 2 columns, none for z"},
  };
  for (const auto& [text, wanted] : cases) {
    EXPECT_THAT(ParseTapCsv(text, "f.csv"), FailsWith(wanted)) << text;
  }
  const auto strange = ParseTapCsv("nan,inf\n,\n", "f.csv");
  ASSERT_TRUE(strange) << "left to the analysis";
  EXPECT_THAT(strange->time_s, SizeIs(2));
}

TEST(TapCsv, TakesMovesFromTheFileBesideIt) {
  const test::TemporaryFolder folder;
  test::WriteWhole(folder.path() / "a.csv", "time,force\n1,2\n");
  test::WriteWhole(
      folder.path() / "a.moves.csv",
      "print_time,move_t,start_v,accel,start_z,z_r,start_x,start_y\n1,2,3,4,5,-1,6,7\n");
  const auto taps = Must(ReadTaps(folder.path() / "a.csv"));
  ASSERT_THAT(taps.front().moves, SizeIs(1));
  EXPECT_EQ(taps.front().moves[0].start_z_mm, 5);
  EXPECT_EQ(taps.front().y_mm, 7);
  test::WriteWhole(folder.path() / "a.moves.csv", "print_time,move_t\n1,2\n");
  EXPECT_THAT(ReadTaps(folder.path() / "a.csv"), FailsWith("a.moves.csv", "'start_v'"));
}

// z of a tap: approach at 2 mm/s, a rest, 0.3 mm/s up after a ramp of 1 ms, at 320 samples/s.
struct HeightWorld {
  std::vector<double> time_s;
  std::vector<double> z_mm;
  double halt_s = 0.35, pull_s = 0.62, speed_mm_s = 0.3, ramp_s = 1e-3, low_mm = -0.04,
         way_mm = 0.1;

  HeightWorld() {
    const double leave_s = pull_s + way_mm / speed_mm_s;
    for (double t = 0.0007; t < 1.2; t += 1 / 320.0) {
      time_s.push_back(100 + t);
      const double up = t < pull_s + ramp_s
                            ? speed_mm_s * (t - pull_s) * (t - pull_s) / (2 * ramp_s)
                            : speed_mm_s * (t - pull_s - ramp_s / 2);
      const double z = t < halt_s   ? low_mm + 2 * (halt_s - t)
                       : t < pull_s ? low_mm
                                    : low_mm + (t < leave_s ? up : way_mm);
      z_mm.push_back(z);
    }
  }
};

TEST(TapFile, OversizedJsonIsRefusedByItsBeginning) {
  const test::TemporaryFolder folder;
  for (const char* start : {"[{\"time\": [", "{\n\"time\": [1,\n2"}) {
    const auto file = folder.path() / "huge.json";
    test::WriteWhole(file, start);
    std::filesystem::resize_file(file, std::uintmax_t{900} << 20);  // a hole: it takes no room
    EXPECT_THAT(ReadTaps(file), FailsWith("is 900 MB of JSON in one piece and at most 64 MB"));
  }
}

TEST(MovesFromZ, FindsTheCornersToATenthOfASample) {
  const HeightWorld world;
  const auto moves = MovesFromZ(world.time_s, world.z_mm);
  ASSERT_THAT(moves, SizeIs(5));
  constexpr double kTenthOfASample_s = 1 / 3200.0;
  EXPECT_NEAR(moves[0].start_velocity_mm_s, 2, 1e-6);
  EXPECT_NEAR(moves[1].start_time_s, 100 + world.halt_s, kTenthOfASample_s);
  EXPECT_NEAR(moves[3].start_velocity_mm_s, world.speed_mm_s, 1e-6);
  // The cruise passes through the same heights as the true one, whatever the ramp.
  const double at_s = 100 + 0.8;
  EXPECT_NEAR(moves[3].start_z_mm + moves[3].start_velocity_mm_s * (at_s - moves[3].start_time_s),
              world.low_mm + world.speed_mm_s * (0.8 - world.pull_s - world.ramp_s / 2), 1e-6);
  EXPECT_NEAR(moves[4].start_time_s + moves[4].duration_s,
              100 + world.pull_s + world.way_mm / world.speed_mm_s, 2 / 320.0);
}

TEST(MovesFromZ, GivesNoneWhereZIsNoTap) {
  const HeightWorld world;
  auto z = world.z_mm;
  z[10] = std::nan("");
  EXPECT_TRUE(MovesFromZ(world.time_s, z).empty());
  z = world.z_mm;
  z[20] += 0.01;
  EXPECT_TRUE(MovesFromZ(world.time_s, z).empty());
  EXPECT_TRUE(MovesFromZ(world.time_s, std::vector(z.size(), 1.0)).empty());
  auto time = world.time_s;
  std::swap(time[5], time[6]);
  EXPECT_TRUE(MovesFromZ(time, world.z_mm).empty());
  EXPECT_TRUE(MovesFromZ({}, {}).empty());
}

TEST(TapFile, ReadsEveryRealTap) {
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  if (data == nullptr) GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with tap/";
  int read = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(data) / "tap")) {
    const auto taps = Must(ReadTaps(entry.path()));
    ASSERT_THAT(taps, SizeIs(1));
    EXPECT_GT(taps.front().time_s.size(), 300u) << entry.path();
    EXPECT_GE(taps.front().moves.size(), 5u) << entry.path();
    ++read;
  }
  EXPECT_GE(read, 8);
}

TEST(MovesFromZ, AgreesWithTheMovesOfARealTap) {
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  if (data == nullptr) GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with tap/";
  const auto taps = Must(ReadTaps(fs::path(data) / "tap" / "workbench_tail640.json"));
  const Recording& tap = taps.front();
  const auto moves = MovesFromZ(tap.time_s, tap.z_mm);
  ASSERT_THAT(moves, SizeIs(5));
  // Heights during the cruise, from the recorded moves and from ours.
  const double at_s = 545.3;
  const auto height = [&](const tap::Move& move) {
    return move.start_z_mm + move.start_velocity_mm_s * (at_s - move.start_time_s);
  };
  EXPECT_NEAR(height(moves[3]), height(tap.moves[3]), 1e-5);
  EXPECT_NEAR(moves[1].start_time_s, 544.85, 1e-3);  // the author's home_end_time: 544.8496
}

}  // namespace
}  // namespace trammel::files
