// Test fixture: a printer in memory, and the guard of a run on it.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "session/fake_printer.h"
#include "session/printer_state_guard.h"
#include "support/temporary_folder.h"

namespace trammel::procedure::testing {

inline constexpr const char* kMark = "RESTORE_GCODE_STATE NAME=trammel_run-1 MOVE=0";
inline constexpr const char* kNozzleOff = "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=0";

/// Once it has done what stands in `deaf_after`, it leaves the next questions for its state without
/// an answer.
class DeafPrinter : public FakePrinter {
 public:
  std::string deaf_after;
  int deaf_for = 1;  ///< questions

  Result<void> Run(std::string_view script, const machine::WaitLimit& limit) override {
    auto done = FakePrinter::Run(script, limit);
    if (scripts.back() == deaf_after) deaf_ = deaf_for;
    return done;
  }
  Result<void> CancelPrint(const machine::WaitLimit& limit) override {
    auto done = FakePrinter::CancelPrint(limit);
    if (scripts.back() == deaf_after) deaf_ = deaf_for;
    return done;
  }
  Result<machine::PrinterState> State(const machine::WaitLimit& limit) override {
    if (deaf_ > 0) {
      --deaf_;
      return Fail("no answer within 10 s", ErrorKind::kMachine);
    }
    return FakePrinter::State(limit);
  }

 private:
  int deaf_ = 0;
};

/// The printer, and the guard of a run that has it.
class GuardedPrinter : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  DeafPrinter printer_;
  settings::ScanSettings settings_;
  std::vector<std::string> said_;
  Session session_{
      printer_, {}, [this](const Progress& progress) { said_.push_back(progress.text); }};
  const std::string address_ = "voron.local";

  Result<PrinterStateGuard> Take(const std::string& run = "run-1") {
    settings_.lights_on_gcode = "LIGHTS_ON";
    return PrinterStateGuard::Take(session_, settings_,
                                   {run, "2026-11-22T10:00:00", address_, folder_.path()});
  }
  PrinterStateGuard Begun() {
    auto guard = Take();
    EXPECT_TRUE(guard.has_value());
    EXPECT_TRUE(guard->Begin(session_));
    guard->ExpectLaser();
    printer_.scripts.clear();
    return std::move(*guard);
  }
  std::size_t Journals() { return files::ReadAllJournals(folder_.path()).size(); }
};

}  // namespace trammel::procedure::testing
