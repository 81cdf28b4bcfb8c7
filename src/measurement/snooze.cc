#include "measurement/snooze.h"

#include <nlohmann/json.hpp>
#include <system_error>

#include "files/json_object.h"
#include "files/new_file.h"
#include "measurement/json_lines.h"
#include "measurement/subject_json.h"

namespace trammel::files {
namespace {

std::optional<Snooze> ParseSnooze(std::string_view line) {
  const auto json = ParseJson(line, std::string(kSnoozedFile));
  if (!json || !json->is_object()) return std::nullopt;
  JsonObject object(*json, std::string(kSnoozedFile));
  object.Integer("format", {1, 1});
  Snooze snooze;
  snooze.until_utc = object.Text("until");
  const std::string instrument = object.Text("instrument");
  snooze.instrument = measurement::InstrumentNamed(instrument);
  snooze.subject = ReadSubjectTexts(object);
  if (!object.Faults() || (!instrument.empty() && !snooze.instrument)) return std::nullopt;
  return snooze;
}

bool Means(const Snooze& snooze, measurement::Instrument instrument,
           const measurement::Subject& subject) {
  if (snooze.instrument && *snooze.instrument != instrument) return false;
  for (const auto& [key, words, text] : measurement::SubjectTexts()) {
    if (!(snooze.subject.*text).empty() && snooze.subject.*text != subject.*text) return false;
  }
  return true;
}

}  // namespace

Result<void> NoteSnooze(const std::filesystem::path& path, const Snooze& snooze) {
  nlohmann::ordered_json json = {
      {"format", 1},
      {"until", snooze.until_utc},
      {"instrument", snooze.instrument ? ToString(*snooze.instrument) : std::string_view()}};
  AddSubject(json, snooze.subject);
  return AppendLine(path,
                    json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

Result<std::string> SnoozedUntil(const std::filesystem::path& path,
                                 measurement::Instrument instrument,
                                 const measurement::Subject& subject) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return std::string();
  std::string until;
  const auto read = ForEachLine(path, [&](std::optional<std::string_view> line, std::size_t) {
    const auto snooze = line ? ParseSnooze(*line) : std::nullopt;
    if (snooze && Means(*snooze, instrument, subject)) until = snooze->until_utc;
  });
  if (!read) return tl::unexpected(read.error());
  return until;
}

}  // namespace trammel::files
