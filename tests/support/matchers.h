// Values and errors of a Result, and ends of a command, in one line of a test each.
#pragma once

#include <gmock/gmock.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/measured.h"
#include "base/result.h"

namespace trammel {

/// Returns the value; fails the test with the error's message if there is none.
template <class T>
[[nodiscard]] T Must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}
template <class T>
[[nodiscard]] T Must(std::optional<T> value) {
  if (!value) throw std::runtime_error("no value");
  return std::move(*value);
}
/// Returns the run of a command; fails the test with what it said if it failed.
template <class Run>
  requires requires(Run run) { run.exit_code; }
[[nodiscard]] Run Must(Run run) {
  if (run.exit_code != 0) throw std::runtime_error(run.output);
  return run;
}

/// Returns the answer; fails the test with the reason if its verdict is not good.
template <class T>
[[nodiscard]] T Good(Result<T> result) {
  T answer = Must(std::move(result));
  if (answer.verdict != Verdict::kGood) throw std::runtime_error(answer.reason);
  return answer;
}

/// Returns the error's message; fails the test if there is a value.
template <class T>
[[nodiscard]] std::string ErrorOf(const Result<T>& result) {
  if (result) throw std::runtime_error("a value in place of an error");
  return result.error().message;
}

/// Matches a text that contains each text of `words`, and matches each matcher among them.
template <class... Words>
[[nodiscard]] ::testing::Matcher<const std::string&> Containing(const Words&... words) {
  using TextMatcher = ::testing::Matcher<const std::string&>;
  const auto matcher_of = [](const auto& one) -> TextMatcher {
    if constexpr (std::is_convertible_v<decltype(one), std::string>) {
      return ::testing::HasSubstr(std::string(one));
    } else {
      return one;
    }
  };
  return ::testing::AllOfArray(std::vector<TextMatcher>{matcher_of(words)...});
}

MATCHER_P(HasErrorMessage, message, "") {
  if (!arg) return ::testing::ExplainMatchResult(message, arg.error().message, result_listener);
  *result_listener << "which has a value";
  return false;
}
/// Matches a Result without a value, whose error says all of `words`.
template <class... Words>
[[nodiscard]] auto FailsWith(const Words&... words) {
  return HasErrorMessage(Containing(words...));
}
MATCHER_P(HasErrorKind, kind, "") { return !arg && arg.error().kind == kind; }
template <class... Words>
[[nodiscard]] auto FailsWith(ErrorKind kind, const Words&... words) {
  return ::testing::AllOf(HasErrorKind(kind), FailsWith(words...));
}

MATCHER_P2(HasVerdictAndReason, verdict, reason, "") {
  if constexpr (requires { arg.error(); }) {
    return arg && ::testing::Matches(HasVerdictAndReason(verdict, reason))(*arg);
  } else if constexpr (requires { arg.verdict(); }) {
    return arg.verdict() == verdict &&
           ::testing::ExplainMatchResult(reason, arg.reason(), result_listener);
  } else {
    return arg.verdict == verdict &&
           ::testing::ExplainMatchResult(reason, arg.reason, result_listener);
  }
}
/// Matches an answer, or a Result with one, of this verdict whose reason says all of `words`.
template <class... Words>
[[nodiscard]] auto Answers(Verdict verdict, const Words&... words) {
  return HasVerdictAndReason(verdict, Containing(words...));
}

/// Matches a run with this exit code.
MATCHER_P(Ends, code, "") { return arg.exit_code == code; }
MATCHER_P(HasStandardError, text, "") {
  return ::testing::ExplainMatchResult(text, arg.standard_error, result_listener);
}
MATCHER_P(HasStandardOutput, text, "") {
  return ::testing::ExplainMatchResult(text, arg.standard_output, result_listener);
}
MATCHER_P(HasOutput, text, "") {
  return ::testing::ExplainMatchResult(text, arg.output, result_listener);
}
/// Matches a run with this exit code that says all of `words` on standard error.
template <class... Words>
[[nodiscard]] auto Fails(int code, const Words&... words) {
  return ::testing::AllOf(Ends(code), HasStandardError(Containing(words...)));
}
/// Matches a run with exit code 0 that says all of `words` on standard error.
template <class... Words>
[[nodiscard]] auto Notes(const Words&... words) {
  return Fails(0, words...);
}
/// Matches a run with this exit code that prints all of `words` to standard output.
template <class... Words>
[[nodiscard]] auto Prints(int code, const Words&... words) {
  return ::testing::AllOf(Ends(code), HasStandardOutput(Containing(words...)));
}
/// Matches a run with this exit code that says all of `words` on either stream.
template <class... Words>
[[nodiscard]] auto Says(int code, const Words&... words) {
  return ::testing::AllOf(Ends(code), HasOutput(Containing(words...)));
}

}  // namespace trammel
