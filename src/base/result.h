// The first of the three kinds of error: an external failure (a file, a device, a setting).
#pragma once

#include <string>
#include <tl/expected.hpp>
#include <type_traits>
#include <utility>

namespace trammel {

/// Kind of an external failure; decides the exit code of the command line.
enum class ErrorKind {
  kInput,        ///< A file, a setting or an argument: exit 1.
  kMeasurement,  ///< The recording does not hold what its description promises: exit 2.
  kMachine,      ///< Unreachable, busy, or it answered with an error: exit 3.
  kSafety,       ///< Refused because it could do harm: exit 4.
  kInterrupted,  ///< The user stopped it: exit 130.
};

/// Message with the attempt, the cause and the remedy.
struct Error {
  ErrorKind kind = ErrorKind::kInput;
  std::string message;
};

/// Value, or the external cause of its absence. An untrustworthy measurement is not an error but a
/// verdict (base/measured.h); a bug is a failed TRAMMEL_CHECK (base/check.h).
template <class T>
using Result = tl::expected<T, Error>;

/// Builds the failed branch of a Result.
[[nodiscard]] inline tl::unexpected<Error> Fail(std::string message,
                                                ErrorKind kind = ErrorKind::kInput) {
  return tl::unexpected<Error>(Error{kind, std::move(message)});
}

/// Moves the value out of a result; for TRY.
template <class T, class E>
T ValueOf([[maybe_unused]] tl::expected<T, E>&& result) {
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

}  // namespace trammel

/// Returns the value of an expression of type Result, or returns its error from the function:
/// `const Page page = TRY(ReadPage(path));`. Uses a statement expression of g++ and clang.
#define TRY(...)                                                \
  __extension__({                                               \
    auto trammel_result = (__VA_ARGS__);                        \
    if (!trammel_result) {                                      \
      return tl::unexpected(std::move(trammel_result).error()); \
    }                                                           \
    ::trammel::ValueOf(std::move(trammel_result));              \
  })
