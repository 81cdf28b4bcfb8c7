// Asks questions before a first measurement, and finds contradictions to their answers.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/linuxcnc/linuxcnc_session.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/targets/code_book.h"
#include "part_alignment/views/machine_box.h"
#include "session/operator.h"

namespace trammel::procedure {

struct StartQuestion {
  std::string name;      ///< answering option's name, without dashes
  std::string text;      ///< question text, with unit
  std::string fallback;  ///< default for an empty line; empty: an answer is required
  std::function<Result<void>(const std::string&)> check;
  std::string example = {};  ///< example answer for the undecided
};

/// Answers by the questions' names.
using StartAnswers = std::map<std::string, std::string>;

/// Asks for what `answers` lacks, again if an answer is invalid, and adds it. Three empty lines, if
/// there is no fallback, end it. Without a person the fallbacks apply.
/// @param person  null: nobody can be asked
/// @param say     prints a piece of text; no line feed is added
/// Errors: kInput for a predefined answer that is invalid, and, without a person or an answer, for
/// the unanswered questions, by the options' names; kInterrupted.
[[nodiscard]] Result<void> AnswerQuestions(const std::vector<StartQuestion>& questions,
                                           Operator* person,
                                           const std::function<void(const std::string&)>& say,
                                           StartAnswers& answers);

/// Parses numbers with commas between. Error (kInput): another count, or no finite number.
[[nodiscard]] Result<std::vector<double>> ParseNumbers(const std::string& text, std::size_t count);

/// "none", or boxes of six numbers with blanks between them: the numbers of all.
[[nodiscard]] Result<std::vector<double>> ParseBoxes(const std::string& text);

struct StartContradiction {
  std::string what;
  std::string remedy;
  /// True if no plan can be right until the fault is fixed; else it must be fixed before the
  /// measurement.
  bool forbids = false;
};

struct StartRequest {
  bool c_holds_spindle = false;  ///< else it is locked by hand
  part_alignment::MachineBox travel;
  double safe_z_mm = 0;
};

/// Returns all contradictions, those that forbid first. If a machine's link reports its state
/// alone, only that is checked.
[[nodiscard]] std::vector<StartContradiction> CheckMachine(const machine::LinuxCncFacts& facts,
                                                           const StartRequest& request);

/// Checks the answers for contradictions that need no machine.
[[nodiscard]] std::vector<StartContradiction> CheckRequest(const StartRequest& request);

/// Common prefix of the number in all target ids, and the codes missing from `book`.
struct TargetIds {
  std::string prefix;
  std::vector<StartContradiction> contradictions;
};
[[nodiscard]] TargetIds CheckIds(const std::vector<part_alignment::PartTarget>& targets,
                                 const part_alignment::CodeBook& book);

/// Formats axes, unit, travel and tools in a line.
[[nodiscard]] std::string FactsText(const machine::LinuxCncFacts& facts);

}  // namespace trammel::procedure
