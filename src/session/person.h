// Whoever stands beside the machine: is asked before it moves, and does what it cannot do itself.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "base/result.h"

namespace trammel::procedure {

/// Answered by yes or no.
struct Question {
  std::string name;  ///< one word, by which the answer can be given beforehand
  std::string text;  ///< what yes leads to
};

class Person {
 public:
  virtual ~Person() = default;

  /// That the question can be asked, or was answered beforehand: to be looked at before anything
  /// that leads to it. Errors (kInput): neither, with what to give.
  [[nodiscard]] virtual Result<void> CheckCanAnswer(const std::string& name) const = 0;

  /// Whether yes was given beforehand, for this very question.
  [[nodiscard]] virtual bool AnsweredBefore(const std::string& name) const = 0;

  /// Asks, and waits for the answer; what was typed before the question answers nothing.
  /// @param meanwhile  called about once a second; its error ends the question. May be empty
  /// Errors: kInterrupted where the user stops it, or nobody is there any more; kInput as
  /// CheckCanAnswer.
  [[nodiscard]] virtual Result<bool> Confirm(const Question& question,
                                             const std::function<Result<void>()>& meanwhile) = 0;

  /// A line, where one is typed within the time; where nobody can type it only waits.
  /// Errors: kInterrupted.
  [[nodiscard]] virtual Result<std::optional<std::string>> LineWithin(double time_s) = 0;
};

}  // namespace trammel::procedure
