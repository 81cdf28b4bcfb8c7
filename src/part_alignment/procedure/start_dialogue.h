// Questions with options that answer them beforehand: asked at the terminal, or taken from a
// script.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/result.h"
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

}  // namespace trammel::procedure
