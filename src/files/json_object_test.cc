#include "files/json_object.h"

#include <gtest/gtest.h>

#include <string>

namespace trammel::files {
namespace {

std::string Set(const std::string& text, const std::string& key,
                const nlohmann::ordered_json& value, JsonStyle style = {}) {
  JsonMembers members(text, style);
  members.Set(key, value);
  return members.text();
}

TEST(JsonMembers, ReplaceOneValueAndKeepTheRestToTheByte) {
  EXPECT_EQ(Set(R"({"a" : 0.10000000000000000555 , "b":[ 1,{"a":2} ]})", "a", 5),
            R"({"a" : 5 , "b":[ 1,{"a":2} ]})");
  EXPECT_EQ(Set(R"({"b":12345678901234567890123,"x\"}":"{,:","a":"}"})", "a", {1, "2"}),
            R"({"b":12345678901234567890123,"x\"}":"{,:","a":[1,"2"]})");
  EXPECT_EQ(Set(R"({"\u0061":"\\"})", "a", 1), R"({"\u0061":1})");
}

TEST(JsonMembers, AddAMemberBehindTheOthers) {
  EXPECT_EQ(Set("{}", "a", 1), R"({"a":1})");
  EXPECT_EQ(Set(" { } ", "a", 1), R"( {"a":1 } )");
  EXPECT_EQ(Set(R"({"b":1.50 })", "a\"", "x"), R"({"b":1.50,"a\"":"x" })");
  EXPECT_EQ(Set("{\n  \"b\": 1\n}\n", "a", {1}, {.indent = 2}),
            "{\n  \"b\": 1,\n  \"a\": [\n    1\n  ]\n}\n");
}

}  // namespace
}  // namespace trammel::files
