#include "support/analyze_result.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

namespace trammel::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

// A value's five keys, wherever they stand.
void ExpectMeasured(const json& value, const std::string& where) {
  const std::string verdict = value.at("verdict");
  EXPECT_TRUE(verdict == "good" || verdict == "cannot_tell" || verdict == "refused") << where;
  const bool good = verdict == "good";
  EXPECT_EQ(value.at("reason").get<std::string>().empty(), good) << where;
  for (const char* key : {"pressure_advance_s", "standard_uncertainty_s", "interval95_s"}) {
    EXPECT_EQ(value.at(key).is_null(), !good) << where << key;
  }
  if (!good) return;
  const double answer = value.at("pressure_advance_s");
  EXPECT_GT(value.at("standard_uncertainty_s").get<double>(), 0) << where;
  ASSERT_EQ(value.at("interval95_s").size(), 2U) << where;
  EXPECT_LT(value.at("interval95_s")[0].get<double>(), answer) << where;
  EXPECT_GT(value.at("interval95_s")[1].get<double>(), answer) << where;
}

void ExpectKeys(const json& object, const std::vector<std::string>& keys,
                const std::string& where) {
  for (const std::string& key : keys) EXPECT_TRUE(object.contains(key)) << where << key;
  EXPECT_EQ(object.size(), keys.size()) << where << object.dump();
}

// A value with its uncertainty that is there whenever its owner is.
void ExpectTold(const json& value, const std::string& key, const std::string& where) {
  const double told = value.at(key);
  const std::string suffix = key == "value" ? "" : "_s";
  EXPECT_GT(value.at("standard_uncertainty" + suffix).get<double>(), 0) << where;
  EXPECT_LE(value.at("interval95" + suffix)[0].get<double>(), told) << where;
  EXPECT_GT(value.at("interval95" + suffix)[1].get<double>(), told) << where;
}

void ExpectLaw(const json& law) {
  ExpectKeys(law,
             {"pressure_advance_s", "standard_uncertainty_s", "interval95_s", "weight", "crossings",
              "slow_lag_s", "fast_lag_s", "slip", "lag_scatter_s", "shared_misfit", "lines",
              "learnt_from_mm"},
             "law.");
  ExpectTold(law, "pressure_advance_s", "law.");
  ExpectTold(law.at("crossings"), "pressure_advance_s", "law.crossings.");
  for (const char* key : {"slow_lag_s", "fast_lag_s", "slip"}) {
    ExpectTold(law.at(key), "value", std::string("law.") + key + ".");
  }
  EXPECT_GE(law.at("weight").get<double>(), 0);
  EXPECT_LE(law.at("weight").get<double>(), 1);
}

// docs/reference/formats.md, key by key.
void ExpectFormat(const json& answer) {
  ExpectKeys(
      answer,
      {"format", "method", "verdict", "reason", "pressure_advance_s", "standard_uncertainty_s",
       "interval95_s", "print_next_s", "acceleration", "deceleration", "corners", "law", "scale",
       "flow_ratio", "lines", "deviation", "repeat", "notices", "report"},
      "");
  EXPECT_EQ(answer.at("format"), 1);
  ExpectMeasured(answer, "");
  for (const char* transition : {"acceleration", "deceleration"}) {
    const json& part = answer.at(transition);
    const std::string where = std::string(transition) + ".";
    ExpectKeys(part,
               {"verdict", "reason", "pressure_advance_s", "standard_uncertainty_s", "interval95_s",
                "excess_s"},
               where);
    ExpectMeasured(part, where);
    EXPECT_EQ(part.at("excess_s").size(), answer.at("lines").size()) << where;
  }
  if (!answer.at("law").is_null()) ExpectLaw(answer.at("law"));
  for (const json& line : answer.at("lines")) {
    ExpectKeys(line,
               {"pattern", "pressure_advance_s", "used", "reason", "deviation_px", "height_mm",
                "area_mm2"},
               "lines[].");
    EXPECT_EQ(line.at("reason").get<std::string>().empty(), line.at("used").get<bool>()) << line;
  }
  ExpectKeys(answer.at("deviation"), {"best_s", "cubic_minimum_s", "r_squared", "cubic"},
             "deviation.");
  for (const json& notice : answer.at("notices")) EXPECT_TRUE(notice.is_string());
}

}  // namespace

json AnalyzeToJson(const std::string& arguments, const std::filesystem::path& folder,
                   const RunLimits& limits) {
  const CommandResult run = RunTrammel("-q pa analyze " + arguments + " --json", folder, limits);
  json answer = json::parse(run.standard_output, nullptr, false);
  if (!answer.is_object()) {
    ADD_FAILURE() << arguments << " gave no JSON object but " << run.output;
    return nullptr;
  }
  EXPECT_EQ(run.standard_error, "") << arguments;
  try {
    ExpectFormat(answer);
    EXPECT_EQ(run.exit_code, answer.at("verdict") == "good" ? 0 : 2) << arguments;
  } catch (const json::exception& error) {
    ADD_FAILURE() << arguments << ": " << error.what() << " in " << answer;
  }
  return answer;
}

void ExpectRejected(const std::string& arguments, const std::filesystem::path& folder,
                    const std::vector<std::string>& words) {
  const CommandResult run = RunTrammel("pa analyze " + arguments + " --json", folder);
  EXPECT_EQ(run.exit_code, 1) << arguments << run.output;
  EXPECT_EQ(run.standard_output, "") << arguments;
  for (const std::string& word : words) {
    EXPECT_THAT(run.standard_error, HasSubstr(word)) << arguments;
  }
  EXPECT_THAT(run.standard_error, Not(HasSubstr("bug"))) << arguments;
}

void ExpectRefused(const std::string& arguments, const std::filesystem::path& folder,
                   const std::vector<std::string>& words) {
  const json answer = AnalyzeToJson(arguments, folder);
  if (answer.is_null()) return;
  EXPECT_NE(answer.at("verdict"), "good") << arguments;
  for (const std::string& word : words) {
    EXPECT_THAT(answer.at("reason").get<std::string>(), HasSubstr(word)) << arguments;
  }
}

void ExpectRefusalText(const std::string& arguments, const std::filesystem::path& folder,
                       const std::vector<std::string>& words) {
  const CommandResult run = RunTrammel("pa analyze " + arguments, folder);
  EXPECT_EQ(run.exit_code, 2) << arguments << run.output;
  for (const std::string& word : words) EXPECT_THAT(run.output, HasSubstr(word)) << arguments;
  EXPECT_THAT(run.output, Not(HasSubstr("SET_PRESSURE_ADVANCE"))) << arguments;
  EXPECT_THAT(run.output, Not(HasSubstr("pressure advance  "))) << arguments;
}

}  // namespace trammel::test
