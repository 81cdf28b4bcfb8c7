// Questions before a first measurement, and what contradicts their answers.
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
#include "session/person.h"

namespace trammel::procedure {

struct StartQuestion {
  std::string name;      ///< of the option that answers it, without its dashes
  std::string text;      ///< what is asked, with its unit
  std::string fallback;  ///< what an empty line stands for; empty: something has to be said
  std::function<Result<void>(const std::string&)> check;
  std::string example = {};  ///< of an answer, for who has none
};

/// By the questions' names.
using StartAnswers = std::map<std::string, std::string>;

/// Asks what is not in `answers` yet, again where an answer does not do, and adds it. Three empty
/// lines, where no fallback is, end it. Without a person the fallbacks stand.
/// @param person  null: nobody can be asked
/// @param say     a piece of text for the person; no line feed is added
/// Errors: kInput for an answer given beforehand that does not do, and, without a person or one who
/// answers nothing, for what has no answer, by the options' names; kInterrupted.
[[nodiscard]] Result<void> AnswerQuestions(const std::vector<StartQuestion>& questions,
                                           Person* person,
                                           const std::function<void(const std::string&)>& say,
                                           StartAnswers& answers);

/// Numbers with commas between. Error (kInput): another count, or what is no finite number.
[[nodiscard]] Result<std::vector<double>> ParseNumbers(const std::string& text, std::size_t count);

/// "none", or boxes of six numbers with blanks between them: the numbers of all.
[[nodiscard]] Result<std::vector<double>> ParseBoxes(const std::string& text);

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
