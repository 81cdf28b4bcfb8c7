// The macro TRAMMEL_TAP on a virtual printer, over real sockets, with trammel tap watch --answer in
// a process of its own: what is handed back, and when.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "machine_shop.h"
#include "support/matchers.h"

namespace trammel::test {
namespace {

constexpr double kMacroWaits_s = 5;    // tap_answer_seconds of klipper/trammel.cfg
constexpr double kAnswerWithin_s = 3;  // tap watch's own limit

ShopOptions WithLoadCell() {
  ShopOptions options = WithoutCamera();
  options.hurry = 1;
  sim::LoadCellConfig cell;
  cell.cell = *sim::CellByName("reference");
  cell.surface_z_mm = -0.1;
  cell.seed = 7;
  options.klipper.load_cell = cell;
  sim::AddTapMacros(options.klipper, kMacroWaits_s);
  return options;
}

/// Returns when the printer first read a line with this text.
std::optional<double> WhenRead(const sim::VirtualKlipper& klipper, const std::string& text) {
  for (const sim::ReadLine& line : klipper.history().lines) {
    if (line.text.find(text) != std::string::npos) return line.time_s;
  }
  return std::nullopt;
}

class TapAnswer : public testing::Test {
 protected:
  void Start(ShopOptions options) {
    shop_ = std::make_unique<MachineShop>(std::move(options));
    shop_->Script("G28\nG1 X100 Y100 Z1 F6000");
  }

  void Watch() {
    process_ = std::make_unique<TrammelProcess>(
        std::vector<std::string>{"tap", "watch", "--answer", "--printer", shop_->address(), "--out",
                                 "taps.jsonl"},
        shop_->folder());
    shop_->WaitUntilSaid("watching for taps", *process_);
  }

  /// Taps, and @returns what the macro was told, once it was.
  std::map<std::string, std::string> Tap(const std::string& parameters = "") {
    shop_->With([](sim::VirtualKlipper& klipper) { klipper.kept.clear(); });
    shop_->Script("_TRAMMEL_TAP PROBE_SPEED=2 " + parameters);
    std::map<std::string, std::string> told;
    shop_->WaitUntil(
        [&told](sim::VirtualKlipper& klipper) {
          told = klipper.kept["TRAMMEL_TAP_RESULT"];
          return !told.empty() && !klipper.busy();
        },
        "the macro had an answer", *process_);
    return told;
  }

  double Delay() const {
    double delay_s = 0;
    shop_->With([&delay_s](sim::VirtualKlipper& klipper) {
      delay_s = WhenRead(klipper, "TRAMMEL_TAP_RESULT").value_or(1e9) -
                WhenRead(klipper, "_TRAMMEL_TAP_ASK").value_or(0);
    });
    return delay_s;
  }

  double TrueContact() const {
    double z_mm = NAN;
    shop_->With([&z_mm](sim::VirtualKlipper& klipper) {
      z_mm = klipper.history().taps.back().truth->contact_z_mm;
    });
    return z_mm;
  }

  void ExpectTheContact() {
    const auto told = Tap();
    ASSERT_EQ(told.at("VERDICT"), "good") << process_->StandardErrorSoFar();
    // Four of its own standard uncertainties: exceeded by one tap in 15 000.
    EXPECT_NEAR(std::stod(told.at("Z")), TrueContact(), 4 * std::stod(told.at("U")));
    EXPECT_LT(Delay(), kAnswerWithin_s);
  }

  void ExpectFailure(const std::string& because) const {
    shop_->WaitUntilSaid("no contact, " + because, *process_);
  }

  std::unique_ptr<MachineShop> shop_;
  std::unique_ptr<TrammelProcess> process_;
};

TEST_F(TapAnswer, TheContactIsHandedBackInTime) {
  Start(WithLoadCell());
  Watch();
  ExpectTheContact();
  process_->Send(SIGINT);
  EXPECT_THAT(process_->Wait(), Notes("after the macro asked"));
}

TEST_F(TapAnswer, SoIsThatOfAForkThatPullsBackByItself) {
  ShopOptions options = WithLoadCell();
  options.klipper.load_cell->pulls_back = true;
  Start(options);
  Watch();
  ExpectTheContact();
}

TEST_F(TapAnswer, ARefusalIsHandedBackWithoutAHeightAndTheMacroFails) {
  ShopOptions options = WithLoadCell();
  Start(options);
  Watch();
  ASSERT_EQ(Tap().at("VERDICT"), "good");
  // From now on the contact never ends: the earlier height would be the wrong answer.
  shop_->Script("G1 Z1 F600");
  const auto told = Tap("RISE=0.03");
  EXPECT_EQ(told.at("VERDICT"), "refused");
  EXPECT_EQ(told.at("REASON"), "still_in_contact");
  EXPECT_FALSE(told.contains("Z"));
  EXPECT_FALSE(told.contains("U"));
  ExpectFailure("refused: still_in_contact");
}

TEST_F(TapAnswer, TapsInARowAreEachReportedOnceBesideThePrintersOwnHeight) {
  Start(WithLoadCell());
  Watch();
  shop_->Script("PROBE_ACCURACY SAMPLES=3 PROBE_SPEED=2");  // lifts of 2 mm: no taps
  for (int i = 0; i < 3; ++i) ASSERT_NO_FATAL_FAILURE(ExpectTheContact());
  process_->Send(SIGINT);
  EXPECT_THAT(process_->Wait(),
              Prints(0, "taps              3, 3 good", "mm) in the mean over 3 taps"));
}

TEST_F(TapAnswer, WithoutAProbeTheMacroIsToldThatNoTapCame) {
  Start(WithLoadCell());
  Watch();
  shop_->Script("_TRAMMEL_TAP_ASK");
  ExpectFailure("refused: no_tap");
  EXPECT_GE(Delay(), kAnswerWithin_s - 0.1);
  EXPECT_LT(Delay(), kMacroWaits_s);
}

TEST_F(TapAnswer, WithoutTrammelTheMacroGivesUpByItself) {
  Start(WithLoadCell());
  Watch();
  process_->Send(SIGKILL);
  (void)process_->Wait();
  shop_->Script("_TRAMMEL_TAP");
  std::map<std::string, std::string> told;
  const double until_s = sim::MonotonicNow() + kMacroWaits_s + 30;
  while (told.empty() && sim::MonotonicNow() < until_s) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    shop_->With(
        [&told](sim::VirtualKlipper& klipper) { told = klipper.kept["TRAMMEL_TAP_RESULT"]; });
  }
  EXPECT_EQ(told["REASON"], "no_answer");
  EXPECT_FALSE(told.contains("Z"));
  EXPECT_NEAR(Delay(), kMacroWaits_s, 0.01);
}

}  // namespace
}  // namespace trammel::test
