// Operator at the terminal.
#pragma once

#include <set>
#include <stop_token>
#include <string>

#include "session/operator.h"

namespace trammel::app {

/// Asks on standard error, reads standard input. If either is no terminal, only questions answered
/// beforehand are answered.
class TerminalOperator final : public procedure::Operator {
 public:
  /// @param yes  questions whose answer is yes already, by their names
  TerminalOperator(std::stop_token stop, std::set<std::string> yes);

  [[nodiscard]] Result<void> CheckCanAnswer(const std::string& name) const override;
  [[nodiscard]] bool AnsweredBefore(const std::string& name) const override;
  [[nodiscard]] Result<bool> Confirm(const procedure::Question& question,
                                     const std::function<Result<void>()>& meanwhile) override;
  [[nodiscard]] Result<std::optional<std::string>> LineWithin(double time_s) override;

  /// True if somebody can answer questions.
  [[nodiscard]] bool present() const { return present_; }

 private:
  [[nodiscard]] Result<std::optional<std::string>> TakeLine();

  std::stop_token stop_;
  std::set<std::string> yes_;
  bool present_ = false;
  std::string typed_;  ///< typed so far, without line end
};

}  // namespace trammel::app
