// Taps that printers made and others published: shared data, not in the repository.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tap/analyse/analyse.h"
#include "tap/samples/recording.h"

namespace trammel::tap {

/// Recordings with their provenance in SOURCES.md beside them; TRAMMEL_TEST_DATA names the folder.
class RecordedTaps : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TRAMMEL_TEST_DATA");
    if (data == nullptr) {
      GTEST_SKIP() << "TRAMMEL_TEST_DATA is not set; it names the folder with tap/tap0.json";
    }
    folder_ = std::filesystem::path(data) / "tap";
  }

  /// @param name  "tap0" for tap/tap0.json.
  [[nodiscard]] Recording Read(const std::string& name) const {
    nlohmann::json json;
    std::ifstream(folder_ / (name + ".json")) >> json;
    Recording recording;
    recording.name = name;
    recording.time_s = json.at("time").get<std::vector<double>>();
    recording.force_g = json.at("force").get<std::vector<double>>();
    for (const auto& move : json.at("moves")) {
      recording.moves.push_back({move.at("print_time"), move.at("move_t"), move.at("start_v"),
                                 move.at("accel"), move.at("start_z"), move.at("z_r")});
    }
    return recording;
  }

  [[nodiscard]] TapAnalysis Analyse(const std::string& name, Method method) const {
    return TapAnalyser({.method = method}).Analyse(Read(name).View());
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace trammel::tap
