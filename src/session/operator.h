// Operator beside the machine: is asked before it moves, and does what it cannot do itself.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "base/result.h"

namespace trammel::procedure {

/// Question with the answers yes and no.
struct Question {
  std::string name;  ///< one word, by which the answer can be given beforehand
  std::string text;  ///< effect of yes
};

class Operator {
 public:
  virtual ~Operator() = default;

  /// Checks that the question can be asked, or was answered beforehand: to be called before any
  /// step that leads to it. Errors (kInput): neither, with the missing option.
  [[nodiscard]] virtual Result<void> CheckCanAnswer(const std::string& name) const = 0;

  /// True if the user approved this very question beforehand.
  [[nodiscard]] virtual bool AnsweredBefore(const std::string& name) const = 0;

  /// Asks, and waits for the answer; ignores input typed before the question.
  /// @param meanwhile  called about once a second; its error ends the question. May be empty
  /// Errors: kInterrupted if the user stops it, or the terminal is gone; kInput as CheckCanAnswer.
  [[nodiscard]] virtual Result<bool> Confirm(const Question& question,
                                             const std::function<Result<void>()>& meanwhile) = 0;

  /// Returns a line typed within the time; only waits if there is no input.
  /// Errors: kInterrupted.
  [[nodiscard]] virtual Result<std::optional<std::string>> LineWithin(double time_s) = 0;
};

}  // namespace trammel::procedure
