// What a machine says of itself against what a measurement on it needs.
#pragma once

#include <string>
#include <vector>

#include "machine/linuxcnc/linuxcnc_session.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/targets/code_book.h"
#include "part_alignment/views/machine_box.h"

namespace trammel::procedure {

struct StartContradiction {
  std::string what;
  std::string remedy;
  /// No plan can be right until it is mended; else it has to be before the measurement alone.
  bool forbids = false;
};

struct StartRequest {
  bool c_holds_spindle = false;  ///< else it is locked by hand
  part_alignment::MachineBox travel;
  double safe_z_mm = 0;
};

/// All of them, those that forbid first. Of a machine whose link tells its state alone only that
/// is looked at.
[[nodiscard]] std::vector<StartContradiction> CheckMachine(const machine::LinuxCncFacts& facts,
                                                           const StartRequest& request);

/// The same of answers that no machine has to be asked for.
[[nodiscard]] std::vector<StartContradiction> CheckRequest(const StartRequest& request);

/// What stands before the number in all ids of targets, and the codes that `book` does not have.
struct TargetIds {
  std::string prefix;
  std::vector<StartContradiction> contradictions;
};
[[nodiscard]] TargetIds CheckIds(const std::vector<part_alignment::PartTarget>& targets,
                                 const part_alignment::CodeBook& book);

/// In a line: axes, unit, travel, tools.
[[nodiscard]] std::string FactsText(const machine::LinuxCncFacts& facts);

}  // namespace trammel::procedure
