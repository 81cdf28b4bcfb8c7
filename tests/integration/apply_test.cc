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
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/random.h"
#include "machine_shop.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "sim/moonraker/spoolman.h"

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

// A run that died, or was refused, between its note and the printer.
TEST_F(Apply, UndoPassesOverWhatWasNeverSet) {
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.031");
  ASSERT_EQ(Run({"0.047"}).exit_code, 0);
  ASSERT_TRUE(files::NoteApplication(
      shop_.folder() / "state/trammel/applied.jsonl", measurement::Instrument::kPressureAdvance, "",
      {"2030-01-01T00:00:00Z", shop_.address(), files::Application::Step::kBegun, 0.047, 0.06}));
  const ProcessEnd undone = shop_.Run(
      {"pa", "apply", "--undo", "--printer", "http://" + shop_.address() + "/"});  // spelled anew
  EXPECT_EQ(undone.exit_code, 0) << undone.standard_error;
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
}

TEST_F(Apply, AResultIsNotKeptForAnotherFilament) {
  const auto folder = shop_.folder() / "petg";
  std::filesystem::create_directory(folder);
  measurement::Outcome outcome;
  outcome.provenance = {
      measurement::Instrument::kPressureAdvance, "trammel", "2026-01-02T03:04:05Z", {}};
  outcome.answers = {{"pressure_advance", "s", Measured::Good({0.055, 0.001, {0.053, 0.057}})}};
  outcome.subject = {"voron.local", "0.60", "PETG Orange"};
  ASSERT_TRUE(files::KeepOutcome(folder, outcome));
  const double before_s = InForce();
  const ProcessEnd refused = Run({"petg", "--filament", "PLA"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.standard_error, HasSubstr("is of the filament 'PETG Orange'"));
  EXPECT_EQ(InForce(), before_s);
  const ProcessEnd applied = Run({"petg"});
  EXPECT_EQ(applied.exit_code, 0) << applied.standard_error;
  EXPECT_THAT(applied.standard_output, testing::AllOf(HasSubstr("measured on voron.local"),
                                                      HasSubstr("with a nozzle of 0.60 mm")));
}

class ApplyToSpool : public Apply {
 protected:
  // The printer of the base stands beside, unused.
  static ShopOptions WithSpoolman(const std::shared_ptr<sim::VirtualSpoolman>& spoolman) {
    ShopOptions options = WithoutCamera();
    options.spoolman = spoolman;
    return options;
  }
  [[nodiscard]] ProcessEnd RunThere(std::vector<std::string> words) const {
    words.insert(words.begin(), {"pa", "apply"});
    words.insert(words.end(), {"--spoolman", "--printer", there_.address()});
    return there_.Run(words);
  }
  [[nodiscard]] double InForceThere() const {
    return there_.Look().settings.at("pressure advance");
  }

  std::shared_ptr<sim::VirtualSpoolman> spoolman_ = std::make_shared<sim::VirtualSpoolman>();
  MachineShop there_{WithSpoolman(spoolman_)};
};

TEST_F(ApplyToSpool, KeepsTheValueOnSpoolAndFilamentBesideWhatOthersWrote) {
  const int spool = spoolman_->AddSpool("Prusament", "PETG \"Jet\" 50% ;", "PETG");
  spoolman_->SetExtra("filament", spool, "note", "text", "\"mine\"");
  spoolman_->SetExtra("spool", spool, "pressure_advance_matrix", "text",
                      R"("{\"0.6_high_flow\":0.02}")");
  const ProcessEnd looked = RunThere({"0.0472", "--dry-run"});
  EXPECT_EQ(looked.exit_code, 0) << looked.standard_error;
  EXPECT_THAT(looked.standard_output, HasSubstr("nothing was changed"));
  EXPECT_EQ(spoolman_->Extra("filament", spool, "pressure_advance"), std::nullopt);
  const ProcessEnd done = RunThere({"0.0472"});
  ASSERT_EQ(done.exit_code, 0) << done.standard_error;
  EXPECT_THAT(done.standard_output, HasSubstr("pressure_advance (none) -> 0.0472"));
  EXPECT_THAT(done.standard_output, HasSubstr("kept in           Spoolman"));
  EXPECT_EQ(spoolman_->Extra("filament", spool, "pressure_advance"), "0.0472");
  EXPECT_EQ(spoolman_->Extra("filament", spool, "note"), "\"mine\"");
  EXPECT_EQ(spoolman_->Extra("spool", spool, "pressure_advance_matrix"),
            R"("{\"0.4_standard\":0.0472,\"0.6_high_flow\":0.02}")");
  EXPECT_NEAR(InForceThere(), 0.0472, 1e-6);
  const ProcessEnd again = RunThere({"0.05"});
  EXPECT_THAT(again.standard_output, HasSubstr("pressure_advance 0.0472 -> 0.0500"));
}

// Whatever cannot be kept is said before anything is set.
TEST_F(ApplyToSpool, SetsNothingWhereSpoolmanCannotTakeIt) {
  const auto refused = [&](const std::string& reason) {
    const double before_s = InForceThere();
    const ProcessEnd end = RunThere({"0.0472"});
    EXPECT_NE(end.exit_code, 0);
    EXPECT_THAT(end.standard_error, HasSubstr(reason));
    EXPECT_EQ(InForceThere(), before_s);
  };
  refused("no spool on this printer");
  const int spool = spoolman_->AddSpool("", "", "PLA");
  spoolman_->SetFault(sim::VirtualSpoolman::Fault::kAway);
  refused("Spoolman is away");
  spoolman_->SetFault(sim::VirtualSpoolman::Fault::kRubbish);
  refused("another form");
  spoolman_->SetFault(sim::VirtualSpoolman::Fault::kNone);
  spoolman_->SetExtra("filament", spool, "pressure_advance", "text", "\"0.03\"");
  refused("is of the type 'text'");
  spoolman_->SetExtra("filament", spool, "pressure_advance", "float", std::nullopt);
  spoolman_->SetExtra("spool", spool, "pressure_advance_matrix", "text", "\"0.04 by hand\"");
  refused("no list of values by nozzle");
  spoolman_->Activate(99);
  refused("No spool with ID 99");
  const ProcessEnd none = Run({"0.0472", "--spoolman"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.standard_error, HasSubstr("knows of no Spoolman"));
}

// By the settings a store that is away does not keep the value from the printer.
TEST_F(ApplyToSpool, TheSettingKeepsWhatItCanAndSaysWhatItCannot) {
  const auto run = [&](const std::string& value) {
    return there_.Run({"pa", "apply", value, "--printer", there_.address(), "--set",
                       "moonraker.keep_in_spoolman=true"});
  };
  const int spool = spoolman_->AddSpool("", "PLA", "PLA");
  EXPECT_EQ(run("0.0472").exit_code, 0);
  EXPECT_EQ(spoolman_->Extra("filament", spool, "pressure_advance"), "0.0472");
  spoolman_->SetFault(sim::VirtualSpoolman::Fault::kAway);
  const ProcessEnd away = run("0.05");
  EXPECT_EQ(away.exit_code, 0) << away.standard_error;
  EXPECT_THAT(away.standard_error, HasSubstr("not kept in Spoolman: Spoolman is away"));
  EXPECT_NEAR(InForceThere(), 0.05, 1e-6);
}

TEST_F(ApplyToSpool, SaysThatAnotherProgramWroteAtTheSameTime) {
  spoolman_->AddSpool("", "PLA", "PLA");
  spoolman_->SetFault(sim::VirtualSpoolman::Fault::kMeddled);
  const ProcessEnd end = RunThere({"0.0472"});
  EXPECT_EQ(end.exit_code, 3);
  EXPECT_THAT(end.standard_error, HasSubstr("another program wrote there"));
  EXPECT_THAT(end.standard_output, HasSubstr("not in Spoolman"));
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
      const auto noted = files::Applications(shop_.folder() / "state/trammel/applied.jsonl",
                                             measurement::Instrument::kPressureAdvance,
                                             [](const std::string&) { return true; });
      ASSERT_TRUE(noted && !noted->empty());
      EXPECT_NEAR(noted->back().application.value.value_or(0), new_s, 1e-9);
      EXPECT_NEAR(noted->back().application.before.value_or(0), old_s, 1e-6);
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
