// trammel pa apply, and taking a value back, on the virtual printer.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "base/random.h"
#include "machine_shop.h"
#include "measurement/history.h"

namespace trammel::test {
namespace {

using ::testing::HasSubstr;

class Apply : public testing::Test {
 protected:
  static ShopOptions WithoutCamera() {
    ShopOptions options;
    options.with_camera = false;
    return options;
  }
  [[nodiscard]] ProcessEnd Run(std::vector<std::string> words) const {
    words.insert(words.begin(), {"pa", "apply"});
    words.insert(words.end(), {"--printer", shop_.address()});
    return shop_.Run(words);
  }
  [[nodiscard]] double InForce() const { return shop_.Look().settings.at("pressure advance"); }

  MachineShop shop_{WithoutCamera()};
};

TEST_F(Apply, UndoBringsBackWhatWasInForceAndNothingTwice) {
  const ProcessEnd nothing = Run({"--undo"});
  EXPECT_EQ(nothing.exit_code, 1);
  EXPECT_THAT(nothing.standard_error, HasSubstr("notes no value that was set on"));
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.031");
  ASSERT_EQ(Run({"0.047"}).exit_code, 0);
  EXPECT_NEAR(InForce(), 0.047, 1e-6);
  const ProcessEnd looked = Run({"--undo", "--dry-run"});
  EXPECT_EQ(looked.exit_code, 0) << looked.standard_error;
  EXPECT_NEAR(InForce(), 0.047, 1e-6);
  const ProcessEnd undone = Run({"--undo"});
  EXPECT_EQ(undone.exit_code, 0) << undone.standard_error;
  EXPECT_THAT(undone.standard_output, HasSubstr("0.0470  ->  0.0310 s"));
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
  const ProcessEnd twice = Run({"--undo"});
  EXPECT_EQ(twice.exit_code, 1);
  EXPECT_THAT(twice.standard_error, HasSubstr("was taken back"));
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
}

TEST_F(Apply, UndoLeavesAValueThatSomebodySetSince) {
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.031");
  ASSERT_EQ(Run({"0.047"}).exit_code, 0);
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.06");
  const ProcessEnd refused = Run({"--undo"});
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_THAT(refused.standard_error, HasSubstr("somebody set another value since"));
  EXPECT_NEAR(InForce(), 0.06, 1e-6);
  EXPECT_EQ(Run({"--undo", "--force"}).exit_code, 0);
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
}

// Twelve kills, or as many as TRAMMEL_APPLY_KILLS says.
TEST_F(Apply, KilledAtAnyMomentLeavesTheOldValueOrTheNewOneAndARecordOfIt) {
  const char* const more = std::getenv("TRAMMEL_APPLY_KILLS");
  const int kills = more == nullptr ? 12 : std::atoi(more);
  constexpr std::uint64_t kSeed = 61;
  Random random(kSeed);
  double old_s = 0.03;
  const ProcessEnd whole = Run({"0.0300"});
  ASSERT_EQ(whole.exit_code, 0) << whole.standard_error;
  int set = 0;
  for (int kill = 0; kill < kills; ++kill) {
    SCOPED_TRACE(fmt::format("seed {}, kill {}", kSeed, kill));
    const double new_s = 0.0301 + 0.0001 * kill;
    TrammelProcess process(
        {"pa", "apply", fmt::format("{:.4f}", new_s), "--printer", shop_.address()},
        shop_.folder());
    std::this_thread::sleep_for(
        std::chrono::duration<double>(random.Uniform(0, 1.1 * whole.elapsed_s)));
    process.Send(SIGKILL);
    (void)process.Wait(10);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));  // what was sent comes into force
    const double now_s = InForce();
    const bool is_new = std::abs(now_s - new_s) < 1e-6;
    EXPECT_TRUE(is_new || std::abs(now_s - old_s) < 1e-6) << now_s;
    if (is_new) {
      ++set;
      const auto last =
          files::LastApplication(shop_.folder() / "state/trammel/applied.jsonl",
                                 measurement::Instrument::kPressureAdvance, shop_.address());
      ASSERT_TRUE(last.has_value() && last->has_value());
      EXPECT_NEAR((*last)->application.value.value_or(0), new_s, 1e-9);
      EXPECT_NEAR((*last)->application.before.value_or(0), old_s, 1e-6);
    }
    old_s = now_s;
  }
  std::printf("%d of %d killed runs had set their value\n", set, kills);
}

TEST_F(Apply, WantsAValueOrUndoAndNotBoth) {
  EXPECT_EQ(Run({}).exit_code, 1);
  EXPECT_EQ(Run({"0.04", "--undo"}).exit_code, 1);
}

}  // namespace
}  // namespace trammel::test
