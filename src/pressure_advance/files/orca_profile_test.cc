#include "pressure_advance/files/orca_profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <span>
#include <vector>

namespace trammel::files {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
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

// Of a printer with two extruders, and of one that would interpolate its own table.
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
