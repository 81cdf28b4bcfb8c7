// Faults in a calibration, by kind and by stage, and the permitted outcomes.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/random.h"
#include "fault_scenario.h"

namespace trammel::test {

/// The printer's own limit for the laser in every fault scenario.
inline constexpr double kLaserLimit_s = 8;
/// The pressure advance of every virtual printer here, s.
inline constexpr double kTruth_s = 0.03;

using RandomStrike = std::function<void(MachineShop&, TrammelProcess&, Random&)>;

struct FaultKind {
  const char* name;
  RandomStrike strike = {};
  /// False where trammel itself is gone or the printer never comes back: its own limits must do.
  bool reachable = true;
  /// True if the printer has a foreign job at the end, which must continue untouched.
  bool foreign_print = false;
  /// Additional setup of the scenario: limits of the process, actions after its end.
  std::function<void(Scenario&, Random&)> prepare = {};
};

/// Every kind of fault, in a fixed order.
[[nodiscard]] const std::vector<FaultKind>& FaultKinds();

/// The words on standard error with which each stage of a calibration begins, in order; the first
/// is empty: before any.
[[nodiscard]] const std::vector<std::string>& StageText();

/// The fault at a moment within the stage, both named by the seed's own random numbers.
[[nodiscard]] Scenario FaultInStage(const FaultKind& kind, const std::string& stage_word,
                                    std::uint64_t seed);

/// One sentence for everything that must not be; each begins with "unsafe", "lost", "number" or
/// what else it is about.
[[nodiscard]] std::vector<std::string> Violations(const FaultKind& kind, const Outcome& outcome);

}  // namespace trammel::test
