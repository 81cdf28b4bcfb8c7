// Shared code of the studies of part alignment.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "support/study.h"

namespace trammel::test {

/// Returns the worlds of a row.
inline std::uint64_t WorldsOfStudy(int reported) {
  return static_cast<std::uint64_t>(SeedsOfStudy(reported).count);
}

/// Returns the seed of the first world.
inline std::uint64_t FirstSeedOfStudy() { return SeedsOfStudy(1, 500'000).first; }

/// True if an answer's reason or one of its notices contains any of the words, separated by |.
template <class Answer>
bool ReasonContains(const Answer& answer, std::string words) {
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
