#include "measurement/outcome.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace trammel::measurement {

namespace {

// Ordered as the enumeration.
constexpr std::array<std::string_view, 5> kNames{"pressure_advance", "tap", "tool_offset",
                                                 "part_alignment", "camera_setup"};
constexpr std::array<std::string_view, kNames.size()> kWords{
    "pressure advance", "taps", "tool offsets", "part alignment", "camera and laser"};

constexpr std::array<SubjectText, 7> kSubjectTexts{{
    {"printer", "printer", &Subject::printer},
    {"toolhead", "toolhead", &Subject::toolhead},
    {"nozzle", "nozzle", &Subject::nozzle},
    {"filament", "filament", &Subject::filament},
    {"spool", "spool", &Subject::spool},
    {"nozzle_c", "nozzle temperature", &Subject::nozzle_c},
    {"bed_c", "bed temperature", &Subject::bed_c},
}};

}  // namespace

std::string_view ToString(Instrument instrument) {
  return kNames.at(static_cast<std::size_t>(instrument));
}

std::optional<Instrument> InstrumentNamed(std::string_view name) {
  const auto found = std::ranges::find(kNames, name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<Instrument>(found - kNames.begin());
}

std::span<const std::string_view> InstrumentNames() { return kNames; }

std::string_view WordsOf(Instrument instrument) {
  return kWords.at(static_cast<std::size_t>(instrument));
}

std::span<const SubjectText> SubjectTexts() { return kSubjectTexts; }

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
