// Tests beside a LinuxCNC that runs with a scripted screen.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "machine/linuxcnc/linuxcnc.h"
#include "real_linuxcnc.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"

namespace trammel::test {

inline constexpr double kMicron_mm = 1e-3;

class LinuxCncFixture : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    (void)RealLinuxCnc::EnterOwnNetwork();
    why_not_ = RealLinuxCnc::WhyNot();
    if (why_not_.empty()) linuxcnc_ = new RealLinuxCnc;
  }
  static void TearDownTestSuite() {
    delete linuxcnc_;
    linuxcnc_ = nullptr;
  }
  void SetUp() override {
    if (!why_not_.empty()) {
      fmt::print(stderr, "\n*** SKIPPED, NOT TESTED against LinuxCNC: {}\n\n", why_not_);
      GTEST_SKIP() << why_not_;
    }
    ASSERT_TRUE(linuxcnc_->up()) << linuxcnc_->log();
    ASSERT_EQ(Screen("ready")["homed"], nlohmann::json({1, 1, 1, 1}));
  }

  static nlohmann::json Screen(const std::string& words) {
    linuxcnc_->AskScreen(words);
    return StatedMachine();
  }
  static nlohmann::json StatedMachine() {
    const std::string told = linuxcnc_->ScreenText();
    EXPECT_FALSE(told.empty()) << linuxcnc_->log();
    return told.empty() ? nlohmann::json::object() : nlohmann::json::parse(told);
  }
  static Eigen::Vector3d At(const nlohmann::json& screen) {
    const nlohmann::json& at = screen["at"];
    return Eigen::Vector3d(at[0], at[1], at[2]);
  }
  static machine::LinuxCncOptions Options() {
    machine::LinuxCncOptions options;
    options.session.time_limit_s = 20;
    options.joints = 4;
    options.c_holds_spindle = true;
    return options;
  }
  static std::unique_ptr<machine::LinuxCnc> Joined() {
    return Must(machine::LinuxCnc::Connect(Options(), {}));
  }

  static inline std::string why_not_;
  static inline RealLinuxCnc* linuxcnc_ = nullptr;
  TemporaryFolder folder_;
};

}  // namespace trammel::test
