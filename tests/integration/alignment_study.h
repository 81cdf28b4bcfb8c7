// What the studies of part alignment share.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "from_environment.h"

namespace trammel::test {

/// Worlds of a row: TRAMMEL_STUDY_SEEDS, else as many as are reported.
inline std::uint64_t StudySeeds(std::uint64_t reported) {
  return static_cast<std::uint64_t>(
      FromEnvironment("TRAMMEL_STUDY_SEEDS", static_cast<int>(reported)));
}

/// The seed of the first: TRAMMEL_STUDY_FIRST_SEED, else that of reported figures. Development uses
/// seeds below 1000.
inline std::uint64_t StudyFirstSeed() {
  return static_cast<std::uint64_t>(FromEnvironment("TRAMMEL_STUDY_FIRST_SEED", 500'000));
}

/// Whether an answer's reason or one of its notices has any of the words, parted by |.
template <class Answer>
bool Says(const Answer& answer, std::string words) {
  for (std::size_t bar = 0; bar != std::string::npos; words = words.substr(bar + 1)) {
    bar = words.find('|');
    const std::string one = words.substr(0, bar);
    const auto has = [&](const std::string& text) { return text.find(one) != std::string::npos; };
    if (has(answer.reason) || std::any_of(answer.notices.begin(), answer.notices.end(), has)) {
      return true;
    }
    if (bar == std::string::npos) break;
  }
  return false;
}

}  // namespace trammel::test
