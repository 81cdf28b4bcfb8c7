#include "base/bounded_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace trammel {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string Refusal(std::string_view text, const JsonBounds& bounds = {}) {
  const Result<json> parsed = ParseBoundedJson(text, "a peer", bounds);
  return parsed ? "taken: " + parsed->dump().substr(0, 100) : parsed.error().message;
}

std::string Repeated(std::string_view piece, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += piece;
  return text;
}

TEST(BoundedJson, ReadsWhatTheLibraryReads) {
  for (const char* text : {"null", "true", "-1", "18446744073709551615", "1.5e3", R"("a\u00e4b")",
                           "[]", "{}", R"([1, [2, {"a": [{}, []]}], "x", null])",
                           R"({"a": {"b": [1, 2, 3], "c": null}, "d": 1})", " \n[1]\n "}) {
    const Result<json> parsed = ParseBoundedJson(text, "a peer");
    ASSERT_TRUE(parsed) << parsed.error().message;
    EXPECT_EQ(*parsed, json::parse(text)) << text;
    EXPECT_EQ(parsed->dump(), json::parse(text).dump());
  }
}

TEST(BoundedJson, AMillionLevelsAreRefusedAtTheFirstTooMany) {
  for (const char* level : {"[", "{\"\":", "[{\"a\":"}) {
    const std::string text = Repeated(level, 1'000'000);
    EXPECT_THAT(Refusal(text), HasSubstr("a peer: objects and lists are nested more than 64 deep"));
  }
  EXPECT_THAT(Refusal(std::string(1'000'000, '[') + std::string(1'000'000, ']')),
              HasSubstr("nested more than 64 deep"));
}

TEST(BoundedJson, AsManyLevelsAsAllowedAreRead) {
  const auto nested = [](int levels) {
    return std::string(levels, '[') + std::string(levels, ']');
  };
  EXPECT_TRUE(ParseBoundedJson(nested(64), "a peer"));
  EXPECT_FALSE(ParseBoundedJson(nested(65), "a peer"));
  EXPECT_TRUE(ParseBoundedJson(nested(2), "a peer", {.max_levels = 2}));
  EXPECT_FALSE(ParseBoundedJson(nested(3), "a peer", {.max_levels = 2}));
}

TEST(BoundedJson, ManySmallValuesAreRefusedBeforeTheyFillTheMemory) {
  const JsonBounds bounds{.max_memory_bytes = 1 << 20};
  for (const char* piece : {"0,", "[],", "{},", "\"\",", "{\"\":0},"}) {
    EXPECT_THAT(Refusal("[" + Repeated(piece, 200'000) + "0]", bounds),
                HasSubstr("more than the 1 MB of memory"));
  }
  std::string members = "{";
  for (int i = 0; i < 20'000; ++i) members += "\"" + std::to_string(i) + "\":0,";
  EXPECT_THAT(Refusal(members + "\"\":0}", bounds), HasSubstr("more than the 1 MB of memory"));
  EXPECT_TRUE(ParseBoundedJson("[" + Repeated("0,", 2'000) + "0]", "a peer", bounds));
}

TEST(BoundedJson, LongTextsAreCountedWithTheirLength) {
  const JsonBounds bounds{.max_memory_bytes = 1 << 20};
  const std::string text = "\"" + std::string(20'000, 'x') + "\"";
  EXPECT_THAT(Refusal("[" + Repeated(text + ",", 60) + "0]", bounds),
              HasSubstr("more than the 1 MB of memory"));
  EXPECT_TRUE(ParseBoundedJson("[" + Repeated(text + ",", 40) + "0]", "a peer", bounds));
}

TEST(BoundedJson, ATextThatIsTooLongIsNotEvenRead) {
  EXPECT_THAT(Refusal(std::string(101, ' '), {.max_bytes = 100}),
              HasSubstr("is 101 bytes of JSON; at most 100 are read"));
}

TEST(BoundedJson, SaysWhereATextIsNoJson) {
  for (const char* text : {"", "{", "[1,]", "{\"a\"}", "NaN", "[Infinity]", "[1] 2", "\"\xff\"",
                           "\"\\ud800\"", "{\"a\":1,}", "tru", "'a'", "]"}) {
    EXPECT_THAT(Refusal(text), AllOf(StartsWith("a peer:1: is not JSON: "))) << text;
  }
  EXPECT_THAT(Refusal("{\n\"a\": 1,\n\"b\": x}"), StartsWith("a peer:3: is not JSON"));
  EXPECT_THAT(Refusal("1e999"), HasSubstr("number overflow"));
}

TEST(BoundedJson, AKeyGivenTwiceIsAnErrorOnlyWhereAsked) {
  const char* text = R"({"a": 1, "b": {"a": 2, "c": 3, "c": 4}})";
  EXPECT_EQ((*ParseBoundedJson(text, "a peer"))["b"]["c"], 4);
  EXPECT_EQ(Refusal(text, {.unique_keys = true}), "a peer: the key \"c\" is given twice");
}

// The library ends there as if the text did, and passes over what stands behind.
TEST(BoundedJson, AByteOfZeroIsNoEndOfTheText) {
  for (const std::string& text : {std::string("[1]\0 [", 7), std::string("{}\0", 3),
                                  std::string("[1,\n\0 2]", 8), std::string("\0", 1)}) {
    EXPECT_THAT(Refusal(text), HasSubstr("is not JSON: it holds a byte of zero")) << text;
  }
  EXPECT_THAT(Refusal(std::string("[1,\n\0 2]", 8)), StartsWith("a peer:2:"));
}

TEST(BoundedJson, ATextWithACharacterOfZeroIsRefusedWhereOthersWouldCutIt) {
  EXPECT_THAT(Refusal(R"(["a\u0000b"])"), StartsWith("taken"));
  EXPECT_THAT(Refusal(R"(["a\u0000b"])", {.zeros = false}),
              HasSubstr("holds the character U+0000"));
  EXPECT_THAT(Refusal(R"({"a\u0000b": 1})", {.zeros = false}),
              HasSubstr("holds the character U+0000"));
}

TEST(BoundedJson, AForeignFileIsNamedForWhatItIs) {
  EXPECT_EQ(Refusal("PK\3\4xxxx"),
            "a peer: is a ZIP archive, not JSON: unpack it, and give the file that is in it");
  EXPECT_THAT(Refusal(std::string("\xff\xfe{\0}\0", 6)),
              HasSubstr("is text in UTF-16, not JSON: save it as UTF-8"));
  EXPECT_THAT(Refusal("<!doctype html>"), HasSubstr("is a web page, not JSON"));
}

}  // namespace
}  // namespace trammel
