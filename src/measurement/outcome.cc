#include "measurement/outcome.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace trammel::measurement {

std::string_view ToString(Instrument instrument) {
  constexpr std::array<std::string_view, 4> kNames{"pressure_advance", "tap", "tool_offset",
                                                   "part_alignment"};
  return kNames.at(static_cast<std::size_t>(instrument));
}

std::optional<Instrument> InstrumentNamed(std::string_view name) {
  for (const Instrument instrument : {Instrument::kPressureAdvance, Instrument::kTap,
                                      Instrument::kToolOffset, Instrument::kPartAlignment}) {
    if (ToString(instrument) == name) return instrument;
  }
  return std::nullopt;
}

std::string_view WordsOf(Instrument instrument) {
  constexpr std::array<std::string_view, 4> kWords{"pressure advance", "taps", "tool offsets",
                                                   "part alignment"};
  return kWords.at(static_cast<std::size_t>(instrument));
}

Verdict Outcome::verdict() const {
  if (answers.empty()) return Verdict::kRefused;
  return std::ranges::max(answers, {}, [](const Answer& answer) { return answer.value.verdict(); })
      .value.verdict();
}

std::string Outcome::reason() const {
  std::vector<std::string_view> reasons;
  std::string text;
  for (const Answer& answer : answers) {
    const std::string& reason = answer.value.reason();
    if (answer.value.good() || std::ranges::find(reasons, reason) != reasons.end()) continue;
    reasons.push_back(reason);
    text += (text.empty() ? "" : "; ") + reason;
  }
  return answers.empty() ? "nothing was measured" : text;
}

const Answer* Outcome::Find(std::string_view name) const {
  const auto found = std::ranges::find(answers, name, &Answer::name);
  return found == answers.end() ? nullptr : &*found;
}

}  // namespace trammel::measurement
