// The third kind of error: a bug in trammel. Checks stay on in release builds.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace trammel {

/// Violated precondition or invariant. Not caught below main().
class Bug : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

[[noreturn]] inline void ThrowBug(const char* file, int line, const char* condition,
                                  const std::string& values) {
  throw Bug(fmt::format("{}:{}: {} does not hold; {}", file, line, condition, values));
}

}  // namespace trammel

/// TRAMMEL_CHECK(condition, format, values…): throws Bug with the values in its message.
#define TRAMMEL_CHECK(condition, ...)                                                \
  do {                                                                               \
    if (!(condition)) {                                                              \
      ::trammel::ThrowBug(__FILE__, __LINE__, #condition, fmt::format(__VA_ARGS__)); \
    }                                                                                \
  } while (false)
