// trammel pa apply, and taking a value back, on the virtual printer.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apply_kills.h"
#include "files/new_file.h"
#include "machine_shop.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"
#include "sim/moonraker/spoolman.h"
#include "support/lag_recording.h"
#include "support/matchers.h"
#include "support/study.h"

namespace trammel::test {
namespace {

using files::Application;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class Apply : public ::testing::Test {
 protected:
  [[nodiscard]] ProcessEnd Run(std::vector<std::string> words) const {
    words.insert(words.begin(), {"pa", "apply"});
    words.insert(words.end(), {"--printer", shop_.address()});
    return shop_.Run(words);
  }
  [[nodiscard]] double InForce() const { return shop_.Look().settings.at("pressure advance"); }
  [[nodiscard]] std::vector<files::NotedApplication> Noted() const {
    const auto noted =
        files::Applications(state_ / files::kAppliedFile, measurement::Instrument::kPressureAdvance,
                            [](const std::string&) { return true; });
    return noted ? *noted : std::vector<files::NotedApplication>();
  }
  /// The newest first, with what was applied of them.
  [[nodiscard]] std::vector<files::HistoryEntry> History() const {
    auto history = files::ReadHistory(shop_.folder(), {});
    if (!history) return {};
    EXPECT_TRUE(files::AddApplications(state_ / files::kAppliedFile, *history));
    return history->entries;
  }

  MachineShop shop_{WithoutCamera()};
  std::filesystem::path state_ = shop_.folder() / "state/trammel";
};

TEST_F(Apply, UndoBringsBackWhatWasInForceAndNothingTwice) {
  EXPECT_THAT(Run({"--undo"}), Fails(1, "notes no value that was set on"));
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.031");
  ASSERT_THAT(Run({"0.047"}), Prints(0, "trammel pa apply --undo --printer " + shop_.address()));
  EXPECT_NEAR(InForce(), 0.047, 1e-6);
  EXPECT_THAT(Run({"--undo", "--dry-run"}), Ends(0));
  EXPECT_NEAR(InForce(), 0.047, 1e-6);
  EXPECT_THAT(Run({"--undo"}), Prints(0, "0.0470  ->  0.0310 s"));
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
  EXPECT_THAT(Run({"--undo"}), Fails(1, "was taken back"));
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
}

TEST_F(Apply, UndoLeavesAValueThatSomebodySetSince) {
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.031");
  ASSERT_EQ(Run({"0.047"}).exit_code, 0);
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.06");
  EXPECT_THAT(Run({"--undo"}), Fails(4, "somebody set another value since"));
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
  measurement::Outcome outcome = FoundPressureAdvance(0.055);
  outcome.subject = {"voron.local", "0.60", "PETG Orange"};
  KeepIn(shop_.folder() / "petg", outcome);
  const double before_s = InForce();
  EXPECT_THAT(Run({"petg", "--filament", "PLA"}), Fails(1, "is of the filament 'PETG Orange'"));
  EXPECT_EQ(InForce(), before_s);
  EXPECT_THAT(Run({"petg"}), Prints(0, "measured on voron.local", "with a nozzle of 0.60 mm"));
}

TEST_F(Apply, AResultIsNotSetOnAnotherToolhead) {
  measurement::Outcome outcome = FoundPressureAdvance(0.055);
  outcome.subject.toolhead = "extruder1";
  KeepIn(shop_.folder() / "t1", outcome);
  const double before_s = InForce();
  EXPECT_THAT(Run({"t1"}), Fails(1, "of the toolhead 'extruder1'", "'extruder' is active"));
  EXPECT_EQ(InForce(), before_s);
  EXPECT_THAT(Run({"t1", "--force"}), Ends(0));
  EXPECT_NEAR(InForce(), 0.055, 1e-6);
}

class ApplyToSpool : public Apply {
 protected:
  explicit ApplyToSpool(const char* version = "0.26.1")
      : spoolman_(std::make_shared<sim::VirtualSpoolman>(version)) {}
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

  std::shared_ptr<sim::VirtualSpoolman> spoolman_;
  MachineShop there_{WithSpoolman(spoolman_)};
};

TEST_F(ApplyToSpool, KeepsTheValueOnSpoolAndFilamentBesideWhatOthersWrote) {
  const int spool = spoolman_->AddSpool("Prusament", "PETG \"Jet\" 50% ;", "PETG");
  spoolman_->SetExtra("filament", spool, "note", "text", "\"mine\"");
  spoolman_->SetExtra("spool", spool, "pressure_advance_matrix", "text",
                      R"("{\"0.6_high_flow\":0.02}")");
  EXPECT_THAT(RunThere({"0.0472", "--dry-run"}), Prints(0, "nothing was changed"));
  EXPECT_EQ(spoolman_->Extra("filament", spool, "pressure_advance"), std::nullopt);
  ASSERT_THAT(RunThere({"0.0472"}),
              Prints(0, "pressure_advance (none) -> 0.0472", "kept in           Spoolman"));
  EXPECT_EQ(spoolman_->Extra("filament", spool, "pressure_advance"), "0.0472");
  EXPECT_EQ(spoolman_->Extra("filament", spool, "note"), "\"mine\"");
  EXPECT_EQ(spoolman_->Extra("spool", spool, "pressure_advance_matrix"),
            R"("{\"0.6_high_flow\":0.02,\"0.4_standard\":0.0472}")");  // others' stay first
  EXPECT_NEAR(InForceThere(), 0.0472, 1e-6);
  EXPECT_THAT(RunThere({"0.05"}).standard_output, HasSubstr("pressure_advance 0.0472 -> 0.0500"));
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
  EXPECT_THAT(Run({"0.0472", "--spoolman"}), Fails(1, "knows of no Spoolman"));
}

TEST_F(ApplyToSpool, WhileThePrinterStartsItSaysThat) {
  spoolman_->AddSpool("", "PLA", "PLA");
  ShopOptions options = WithSpoolman(spoolman_);
  options.faults.startup_s = 1e6;
  const MachineShop slow{std::move(options)};
  EXPECT_THAT(slow.Run({"pa", "apply", "0.0472", "--spoolman", "--printer", slow.address()}),
              Fails(3, "the printer is \"startup\""));
  EXPECT_EQ(spoolman_->Extra("filament", 1, "pressure_advance"), std::nullopt);
}

// With the setting, an offline store does not prevent setting the value on the printer.
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
  // Printed with the answer, which a printer's screen shows, not with the progress.
  EXPECT_THAT(away.standard_output, HasSubstr("not kept          in Spoolman: Spoolman is away"));
  EXPECT_NEAR(InForceThere(), 0.05, 1e-6);
  spoolman_->SetFault(sim::VirtualSpoolman::Fault::kMeddled);
  EXPECT_THAT(run("0.06"),
              Prints(0, "SET_PRESSURE_ADVANCE ADVANCE=0.0600: read back",
                     "in Spoolman       the filament's value was sent and does not read back as it "
                     "was, and the spool's was not sent: the fields of filament 1 read "
                     "otherwise"));
}

TEST_F(ApplyToSpool, LeavesAloneWhatOthersWriteAtTheSameTime) {
  const int spool = spoolman_->AddSpool("", "PLA", "PLA");
  for (const char* entity : {"filament", "spool"}) {
    spoolman_->SetExtra(entity, spool, "note", "text", "\"mine\"");
  }
  spoolman_->SetFault(sim::VirtualSpoolman::Fault::kCrossed);
  EXPECT_THAT(RunThere({"0.0472"}), Ends(0));
  for (const char* entity : {"filament", "spool"}) {
    EXPECT_EQ(spoolman_->Extra(entity, spool, "note"), "\"theirs\"") << entity;
  }
  EXPECT_EQ(spoolman_->Extra("filament", spool, "pressure_advance"), "0.0472");
}

// Whatever came into a field before its definition, Spoolman refuses it only where it is sent.
TEST_F(ApplyToSpool, AnotherFieldsMisfitDoesNotKeepTheValueOut) {
  const int spool = spoolman_->AddSpool("", "PLA", "PLA");
  spoolman_->SetExtra("filament", spool, "flow", "float", "\"fast\"");
  EXPECT_THAT(RunThere({"0.0472"}), Ends(0));
  EXPECT_EQ(spoolman_->Extra("filament", spool, "flow"), "\"fast\"");
  EXPECT_EQ(spoolman_->Extra("filament", spool, "pressure_advance"), "0.0472");
}

TEST_F(ApplyToSpool, SaysThatTheSpoolIsArchived) {
  const int spool = spoolman_->AddSpool("", "PLA", "PLA");
  spoolman_->Archive(spool);
  EXPECT_THAT(RunThere({"0.0472"}), Prints(0, "spool 1 is archived"));
}

TEST_F(ApplyToSpool, AResultIsNotKeptOnAnotherSpoolThanItsOwn) {
  const int first = spoolman_->AddSpool("", "PLA", "PLA");
  measurement::Outcome outcome = FoundPressureAdvance(0.055);
  outcome.subject.filament = "PLA";
  outcome.subject.spool = std::to_string(first);
  KeepIn(there_.folder() / "measured", outcome);
  const int second = spoolman_->AddSpool("", "PLA", "PLA");
  const double before_s = InForceThere();
  EXPECT_THAT(RunThere({"measured"}),
              Fails(1, "of spool 1, and Spoolman has spool 2 on this printer"));
  EXPECT_EQ(InForceThere(), before_s);
  EXPECT_EQ(RunThere({"measured", "--force"}).exit_code, 0);
  EXPECT_TRUE(spoolman_->Extra("spool", second, "pressure_advance_matrix"));
  spoolman_->Activate(first);
  EXPECT_EQ(RunThere({"measured"}).exit_code, 0);
  EXPECT_TRUE(spoolman_->Extra("spool", first, "pressure_advance_matrix"));
}

// Before 0.26 a change of one extra field took a filament's others away, before 0.22 a spool's.
class ApplyToOlderSpool : public ApplyToSpool, public ::testing::WithParamInterface<const char*> {
 protected:
  ApplyToOlderSpool() : ApplyToSpool(GetParam()) {}
};

TEST_P(ApplyToOlderSpool, OtherFieldsStayAsTheyAre) {
  const int spool = spoolman_->AddSpool("", "PLA", "PLA");
  for (const char* entity : {"filament", "spool"}) {
    spoolman_->SetExtra(entity, spool, "note", "text", R"("\u20ac 5; \"mine\"")");
  }
  EXPECT_THAT(RunThere({"0.0472"}), Ends(0));
  for (const char* entity : {"filament", "spool"}) {
    EXPECT_EQ(spoolman_->Extra(entity, spool, "note"), R"("\u20ac 5; \"mine\"")") << entity;
  }
  EXPECT_EQ(spoolman_->Extra("filament", spool, "pressure_advance"), "0.0472");
}

INSTANTIATE_TEST_SUITE_P(Versions, ApplyToOlderSpool,
                         ::testing::Values("0.18.1", "0.22.1", "0.25.0", "a fork"));

TEST_F(ApplyToSpool, SaysThatAnotherProgramWroteAtTheSameTime) {
  spoolman_->AddSpool("", "PLA", "PLA");
  spoolman_->SetFault(sim::VirtualSpoolman::Fault::kMeddled);
  const ProcessEnd end = RunThere({"0.0472"});
  EXPECT_THAT(end, Fails(3, "another program wrote there"));
  EXPECT_THAT(end.standard_output, HasSubstr("in Spoolman       the filament's value was sent"));
}

TEST(ApplyKilled, AtAnyMomentLeavesTheOldValueOrTheNewOneAndARecordOfIt) {
  constexpr int kShowing = 100;  // with fewer, all may miss the moment between two notes
  const StudySeeds seeds = SeedsOfStudy(15, 61);
  const KilledApplies killed = KillApplies(seeds.count, seeds.first);
  std::printf("of %d killed runs %d had noted nothing, %d were open, %d were noted to their end\n",
              seeds.count, killed.unnoted, killed.open, killed.finished);
  if (seeds.count >= kShowing) EXPECT_GE(killed.open, 1);
}

TEST_F(Apply, OfTwoAtOnceEachIsNotedAsItCameIntoForce) {
  ASSERT_EQ(Run({"0.0310"}).exit_code, 0);
  for (int round = 0; round < 5; ++round) {
    SCOPED_TRACE(round);
    std::vector<std::unique_ptr<TrammelProcess>> both;
    for (const double base_s : {0.0410, 0.0510}) {
      both.push_back(std::make_unique<TrammelProcess>(
          std::vector<std::string>{"pa", "apply", fmt::format("{:.4f}", base_s + 0.0001 * round),
                                   "--printer", shop_.address()},
          shop_.folder()));
    }
    for (const auto& process : both) {
      EXPECT_THAT(process->Wait(), Ends(0));
    }
    const auto noted = Noted();
    ASSERT_GE(noted.size(), 2u);
    for (std::size_t i = 1; i < noted.size(); ++i) {
      EXPECT_EQ(noted[i].application.step, Application::Step::kApplied);
      EXPECT_NEAR(noted[i].application.before.value_or(0),
                  noted[i - 1].application.value.value_or(1), 1e-6);
    }
    EXPECT_NEAR(noted.back().application.value.value_or(0), InForce(), 1e-6);
  }
}

TEST_F(Apply, NamesWhoeverHasThePrinterAndSetsNothing) {
  ASSERT_EQ(Run({"0.0310"}).exit_code, 0);
  const auto lock = Must(files::FileLock::Take(
      files::LockPath(state_, procedure::PlainAddress(shop_.address())), "process 5, since noon,"));
  EXPECT_THAT(Run({"0.0470"}), Fails(3, "process 5, since noon, holds"));
  EXPECT_EQ(Run({"0.0470", "--dry-run"}).exit_code, 0);
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
  EXPECT_EQ(Noted().size(), 1u);
}

// Else the next run would bring back its value over what is set now.
TEST_F(Apply, EndsFirstWhatADeadRunLeft) {
  ASSERT_EQ(Run({"0.0310"}).exit_code, 0);
  shop_.Script("SAVE_GCODE_STATE NAME=trammel_dead1\nSET_PRESSURE_ADVANCE ADVANCE=0.02");
  const std::string address = procedure::PlainAddress(shop_.address());
  files::RunJournal journal;
  journal.run = "dead1";
  journal.address = address;
  journal.started = "yesterday";
  journal.before["pressure_advance extruder"] = 0.031;
  journal.given["pressure_advance extruder"] = {0.02};
  ASSERT_TRUE(files::WriteJournal(files::JournalPath(state_, address), journal));
  const ProcessEnd applied = Run({"0.0470"});
  EXPECT_THAT(applied, Notes("the run of yesterday died here"));
  EXPECT_THAT(applied.standard_output, HasSubstr("0.0310  ->  0.0470 s"));
  EXPECT_NEAR(InForce(), 0.047, 1e-6);
  EXPECT_FALSE(std::filesystem::exists(files::JournalPath(state_, address)));
}

// A new analysis of an old recording is a result of its own, in place of the old one.
TEST_F(Apply, ANewAnalysisIsListedAndNotedAsSuch) {
  const auto folder = shop_.folder() / "rec";
  std::filesystem::create_directory(folder);
  WriteRecording({}, folder);
  ASSERT_THAT(Run({"rec"}), Ends(0));
  std::filesystem::last_write_time(
      folder / "scan.json",
      std::filesystem::last_write_time(folder / files::kResultFile) + std::chrono::seconds(1));
  std::this_thread::sleep_for(std::chrono::seconds(1));  // results state seconds
  EXPECT_EQ(Run({"rec", "--dry-run"}).exit_code, 0);
  ASSERT_EQ(History().size(), 1u);
  ASSERT_THAT(Run({"rec"}), Ends(0));
  ASSERT_EQ(Run({"rec"}).exit_code, 0);
  const auto entries = History();
  ASSERT_EQ(entries.size(), 1u);
  ASSERT_EQ(entries[0].applied.size(), 2u);
  EXPECT_EQ(entries[0].applied.back().step, Application::Step::kApplied);
  EXPECT_THAT(entries[0].outcome.notices, Contains(HasSubstr("analysing again")));
}

// Given a full disk, a value that cannot be noted is not set, and no half line remains.
TEST_F(Apply, SetsNothingThatItCannotNote) {
  ASSERT_EQ(Run({"0.0310"}).exit_code, 0);
  const auto applied = state_ / files::kAppliedFile;
  const std::string line = ReadWhole(applied);
  int set = 0;
  for (std::uintmax_t more = 0; more < line.size() + 40; more += 23) {
    SCOPED_TRACE(more);
    const double old_s = InForce();
    const double new_s = 0.032 + 1e-4 * static_cast<double>(more);
    const std::string had = ReadWhole(applied);
    TrammelProcess process(
        {"pa", "apply", fmt::format("{:.4f}", new_s), "--printer", shop_.address()}, shop_.folder(),
        {.file_bytes = had.size() + more});
    const ProcessEnd end = process.Wait();
    const std::string has = ReadWhole(applied);
    EXPECT_TRUE(has.starts_with(had) && has.ends_with('\n')) << has;
    if (end.exit_code == 0) {
      ++set;
      EXPECT_NEAR(InForce(), new_s, 1e-6);
      EXPECT_NEAR(Noted().back().application.value.value_or(0), new_s, 1e-9);
    } else {
      EXPECT_EQ(end.exit_code, 1) << end.standard_error;
      EXPECT_THAT(end.standard_error, HasSubstr("nothing was set"));
      EXPECT_NEAR(InForce(), old_s, 1e-6);
    }
  }
  EXPECT_GE(set, 1);
  EXPECT_EQ(Run({"0.0310"}).exit_code, 0);
  EXPECT_EQ(Noted().back().application.step, Application::Step::kApplied);
}

TEST_F(Apply, BlamesTheOptionThatIsWrong) {
  EXPECT_THAT(Run({"0.04", "--filament", "a\tb"}).standard_error,
              HasSubstr("--filament: the filament's name holds a control character"));
  EXPECT_THAT(shop_
                  .Run({"pa", "calibrate", "--dry-run", "--material", "plastic", "--printer",
                        shop_.address()})
                  .standard_error,
              AllOf(HasSubstr("--material: [filament] material: \"plastic\""),
                    Not(HasSubstr("trammel.toml"))));
}

TEST_F(Apply, WantsAValueOrUndoAndNotBoth) {
  EXPECT_EQ(Run({}).exit_code, 1);
  EXPECT_EQ(Run({"0.04", "--undo"}).exit_code, 1);
}

}  // namespace
}  // namespace trammel::test
