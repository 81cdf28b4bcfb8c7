#include "measurement/subject_json.h"

#include <fmt/format.h>

#include <cstddef>
#include <string>

namespace trammel::files {

using measurement::Subject;
using measurement::SubjectTexts;

void AddSubject(nlohmann::ordered_json& json, const Subject& subject) {
  for (const auto& [key, words, text] : SubjectTexts()) {
    if (!(subject.*text).empty()) json[std::string(key)] = subject.*text;
  }
}

Subject ReadSubjectTexts(JsonObject& object) {
  constexpr std::size_t kMostBytes = 1000;
  Subject subject;
  for (const auto& [key, words, text] : SubjectTexts()) {
    const std::string name(key);
    if (!object.has(name.c_str())) continue;
    subject.*text = object.Text(name.c_str());
    if ((subject.*text).size() > kMostBytes) {
      object.Fault(name, fmt::format("has {} bytes; at most {} are kept", (subject.*text).size(),
                                     kMostBytes));
    }
  }
  return subject;
}

}  // namespace trammel::files
