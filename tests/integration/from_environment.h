// Numbers and texts by which a study is told its seeds.
#pragma once

#include <cstdlib>
#include <string>

namespace trammel::test {

/// Reads a whole number of the environment; the fallback where it is not set.
inline int FromEnvironment(const char* name, int fallback) {
  const char* text = std::getenv(name);
  return text == nullptr ? fallback : std::atoi(text);
}

/// Reads a text of the environment; empty where it is not set.
inline std::string TextFromEnvironment(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? "" : text;
}

}  // namespace trammel::test
