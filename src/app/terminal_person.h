// The person at the terminal.
#pragma once

#include <set>
#include <stop_token>
#include <string>

#include "session/person.h"

namespace trammel::app {

/// Asks on standard error, reads standard input. Without a terminal on both nobody can be asked,
/// and only what was answered beforehand is.
class TerminalPerson final : public procedure::Person {
 public:
  /// @param yes  questions whose answer is yes already, by their names
  TerminalPerson(std::stop_token stop, std::set<std::string> yes);

  [[nodiscard]] Result<void> CheckCanAnswer(const std::string& name) const override;
  [[nodiscard]] bool AnsweredBefore(const std::string& name) const override;
  [[nodiscard]] Result<bool> Confirm(const procedure::Question& question,
                                     const std::function<Result<void>()>& meanwhile) override;
  [[nodiscard]] Result<std::optional<std::string>> LineWithin(double time_s) override;

  /// Whether somebody can be asked.
  [[nodiscard]] bool present() const { return present_; }

 private:
  [[nodiscard]] Result<std::optional<std::string>> TakeLine();

  std::stop_token stop_;
  std::set<std::string> yes_;
  bool present_ = false;
  std::string typed_;  ///< without its line's end yet
};

}  // namespace trammel::app
