// A calibration in which something goes wrong, and what came of it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "machine_shop.h"

namespace trammel::test {

struct Outcome;

struct Scenario {
  std::string name;
  /// Faults before trammel starts.
  std::function<void(ShopOptions&)> prepare = {};
  std::function<void(MachineShop&)> before = {};
  /// Event while it runs; waits for its moment.
  std::function<void(MachineShop&, TrammelProcess&)> strike = {};
  /// Instead of "pa calibrate --out rec --printer"; the shop's address follows a last "--printer".
  std::vector<std::string> arguments = {};
  ProcessLimits limits = {};
  double patience_s = 5;  ///< for the machine to come to rest after trammel's end
  /// Action after trammel's end, whatever its cause; throws on failure.
  std::function<void(MachineShop&, Outcome&)> after = {};
};

/// A recording after the fact.
struct RecordingLook {
  bool folder = false;  ///< true if it exists
  int videos = 0;       ///< line0.avi, line1.avi, …
  int told_frames = 0;  ///< lines in their .times
  int kept_frames = 0;  ///< pictures that are whole in the videos, as far as told
  int sweeps = 0;       ///< number in sweeps.json, including repeated ones
  bool scan = false;    ///< true if scan.json exists
  int exit_code = -1;   ///< of `trammel pa analyze --json`; -1: not run, no sweep started
  std::string verdict;  ///< empty: none was given
  std::optional<double> value_s, low_s, high_s;
  std::vector<std::string> notices;
  std::string said;  ///< reason or message
};

struct Outcome {
  std::string problem;  ///< why the scenario itself failed to occur; empty otherwise
  ProcessEnd end;
  PrinterLook before;
  PrinterLook after;                ///< some seconds after the end
  std::vector<std::string> faulty;  ///< not safe or not as it was
  RecordingLook recording;
  double laser_on_s = 0;  ///< time the laser stayed on after trammel's end
};

/// Runs it from beginning to end. Never throws.
[[nodiscard]] Outcome Play(const Scenario& scenario);

[[nodiscard]] RecordingLook LookAtRecording(const MachineShop& shop);

/// A printer that somebody has been working with: nothing as after a start.
extern const char* const kWorkedWith;

}  // namespace trammel::test
