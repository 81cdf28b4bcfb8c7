#include "pressure_advance/files/orca_profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "files/whole_file.h"

namespace trammel::files {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;
using Json = nlohmann::ordered_json;

constexpr const char* kProfile = R"({
    "type": "filament",
    "name": "My PLA",
    "from": "User",
    "inherits": "Generic PLA @System",
    "version": "2.3.0.2",
    "filament_settings_id": ["My PLA"],
    "nozzle_temperature": ["215"],
    "pressure_advance": ["0.02"]
})";

TEST(OrcaProfile, ChangesThePressureAdvanceAlone) {
  const auto made = WithPressureAdvance(kProfile, "pla.json", 0.01724);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_THAT(made->notices, IsEmpty());
  Json expected = Json::parse(kProfile);
  expected["pressure_advance"] = {"0.0172"};
  expected["enable_pressure_advance"] = {"1"};
  EXPECT_EQ(Json::parse(made->text), expected);
}

// Given a printer with two extruders, one of which would interpolate its own table.
TEST(OrcaProfile, SetsEachExtruderAndSwitchesTheTableOff) {
  Json profile = Json::parse(kProfile);
  profile["pressure_advance"] = {"0.02", "0.03"};
  profile["enable_pressure_advance"] = {"0", "0"};
  profile["adaptive_pressure_advance"] = {"0", "1"};
  const auto made = WithPressureAdvance(profile.dump(), "pla.json", 0.05);
  ASSERT_TRUE(made) << made.error().message;
  const Json json = Json::parse(made->text);
  EXPECT_EQ(json["pressure_advance"], Json({"0.0500", "0.0500"}));
  EXPECT_EQ(json["enable_pressure_advance"], Json({"1", "1"}));
  EXPECT_EQ(json["adaptive_pressure_advance"], Json({"0", "0"}));
  EXPECT_THAT(made->notices, SizeIs(1));
}

// Value, flow, acceleration; the values below cannot stand in one another's column.
TEST(OrcaProfile, WritesTheTableInTheSlicersOwnOrder) {
  const auto row = [](double flow_mm3_s, double acceleration_mm_s2, double value_s) {
    pressure_advance::FlowPoint point;
    point.flow_mm3_s = flow_mm3_s;
    point.acceleration_mm_s2 = acceleration_mm_s2;
    point.pressure_advance_s = {value_s, 0.001, {value_s - 0.002, value_s + 0.002}};
    return point;
  };
  const std::vector rows = {row(3.79, 1000, 0.075), row(15.14, 1000, 0.065), row(3.79, 4000, 0.04),
                            row(15.14, 4000, 0.03)};
  const auto made = WithPressureAdvance(kProfile, "pla.json", 0.0525, rows);
  ASSERT_TRUE(made) << made.error().message;
  const Json json = Json::parse(made->text);
  EXPECT_EQ(json["adaptive_pressure_advance"], Json({"1"}));
  EXPECT_EQ(json["pressure_advance"], Json({"0.0525"}));
  EXPECT_EQ(json["adaptive_pressure_advance_model"],
            Json({"0.0750,3.79,1000\n0.0650,15.14,1000\n0.0400,3.79,4000\n0.0300,15.14,4000"}));
  const auto lone = WithPressureAdvance(kProfile, "pla.json", 0.05, std::span(rows).first(3));
  ASSERT_FALSE(lone);
  EXPECT_THAT(lone.error().message, HasSubstr("4000 mm/s2 has one flow"));
}

// Numbers are foreign; other programs than OrcaSlicer write lists of them, too.
TEST(OrcaProfile, SwitchesATableOffHoweverItIsOn) {
  for (const char* on : {"[1]", "1", "\"1\"", "true", "[true]", "[\"true\"]", "[\"0\", 1]",
                         "[[\"1\"]]", "{}", "[0.5]"}) {
    Json profile = Json::parse(kProfile);
    profile["adaptive_pressure_advance"] = Json::parse(on);
    const auto made = WithPressureAdvance(profile.dump(), "pla.json", 0.05);
    ASSERT_TRUE(made) << made.error().message;
    const Json written = Json::parse(made->text);
    for (const Json& entry : written["adaptive_pressure_advance"]) {
      EXPECT_EQ(entry, "0") << on;
    }
    EXPECT_THAT(made->notices, SizeIs(1)) << on;
  }
  for (const char* off : {"[0]", "\"0\"", "false", "[\"\"]", "null", "[]"}) {
    Json profile = Json::parse(kProfile);
    profile["adaptive_pressure_advance"] = Json::parse(off);
    const auto made = WithPressureAdvance(profile.dump(), "pla.json", 0.05);
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_THAT(made->notices, IsEmpty()) << off;
  }
}

TEST(OrcaProfile, KeepsEveryByteOfTheRest) {
  const std::string before =
      "\xef\xbb\xbf{\r\n\t\"big\": 12345678901234567890123, \"digits\": [1.50, 1e2, -0.0, "
      "0.1000000000000000055],\n"
      "\"te\\\"xt\": \"a, b: {[\\\\\", \"filament_settings_id\": [\"My PLA\"],\"pressure_advance\"";
  const std::string between = ":[\"0.02\"]";
  const std::string after =
      ", \"\\u00e4\": {\"pressure_advance\": [\"0.9\"]}, \"enable_pressure_advance\":[ \"1\" ] }";
  const auto made = WithPressureAdvance(before + between + after, "pla.json", 0.03);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_THAT(made->text, StartsWith(before));
  EXPECT_THAT(made->text, HasSubstr("12345678901234567890123"));
  EXPECT_THAT(made->text, HasSubstr("[1.50, 1e2, -0.0, 0.1000000000000000055]"));
  EXPECT_THAT(made->text, HasSubstr("\"\\u00e4\": {\"pressure_advance\": [\"0.9\"]}"));
  EXPECT_EQ(Json::parse(made->text)["pressure_advance"], Json({"0.0300"}));
}

TEST(OrcaProfile, ABundleIsNamedWithTheWayOut) {
  const auto made = WithPressureAdvance("PK\3\4xxxx", "My PLA.orca_filament", 0.03);
  ASSERT_FALSE(made);
  EXPECT_EQ(
      made.error().message,
      "My PLA.orca_filament: is a ZIP archive as OrcaSlicer's bundles are: unpack it and give "
      "the filament's .json");
}

TEST(OrcaProfile, RefusesWhatIsNoFilamentProfile) {
  const auto why = [](std::string_view text, double value_s = 0.02) {
    const auto made = WithPressureAdvance(text, "x.json", value_s);
    return made ? std::string("accepted") : made.error().message;
  };
  EXPECT_THAT(why("{"), HasSubstr("x.json"));
  EXPECT_THAT(why("[]"), HasSubstr("no filament profile"));
  EXPECT_THAT(why(R"({"printer_settings_id": ["Voron"]})"), HasSubstr("no filament profile"));
  EXPECT_THAT(why(R"({"filament_settings_id": ["a"], "pressure_advance": 0.02})"),
              HasSubstr("list of 1 ... 16 texts"));
  EXPECT_THAT(why(R"({"filament_settings_id": ["a"], "pressure_advance": []})"),
              HasSubstr("list of 1 ... 16 texts"));
  EXPECT_THAT(why(kProfile, 2.1), HasSubstr("0 ... 2"));
  EXPECT_THAT(why(kProfile, std::nan("")), HasSubstr("0 ... 2"));
}

}  // namespace
}  // namespace trammel::files
