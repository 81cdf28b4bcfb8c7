#include "measurement/outcome_file.h"

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <utility>

#include "base/json_text.h"
#include "base/measured_json.h"
#include "files/json_object.h"
#include "files/whole_file.h"

namespace trammel::files {
namespace {

using measurement::Answer;
using measurement::Instrument;
using measurement::Outcome;
using nlohmann::ordered_json;

constexpr std::size_t kMaxAnswers = 1000;
constexpr std::size_t kMaxTexts = 1000;

ordered_json AnswerJson(const Answer& answer) {
  ordered_json json = {{"name", answer.name}, {"unit", answer.unit}};
  json.update(MeasuredJson(answer.value));
  return json;
}

/// True if a 95 % interval is possible for a standard uncertainty: its half-width is 1.96 of them
/// for a normal distribution, 12.7 for Student's with one degree of freedom.
bool Plausible(double standard_uncertainty, double width) {
  constexpr double kMin = 1;
  constexpr double kMax = 100;
  return kMin * standard_uncertainty <= width / 2 && width / 2 <= kMax * standard_uncertainty;
}

/// Reads a value with its uncertainty if the verdict is good, else none.
Measured ReadMeasured(JsonObject& object) {
  const std::string verdict = object.Choice("verdict", {"good", "cannot_tell", "refused"});
  std::string reason = object.Text("reason");
  for (const char* key : {"value", "standard_uncertainty", "interval95"}) {
    const nlohmann::json* const value = object.Find(key);
    const bool there = value != nullptr && !value->is_null();
    if (there != (verdict == "good") && !object.failed()) {
      object.Fault(key, there ? "stands beside a verdict that is not good"
                              : "is missing beside the verdict good");
    }
  }
  if (object.failed()) return {};
  if (verdict == "cannot_tell") return Measured::CannotTell(std::move(reason));
  if (verdict == "refused") return Measured::Refused(std::move(reason));
  const Quantity quantity{object.Number("value"), object.Number("standard_uncertainty", {0}), {}};
  const std::vector<double> ends = object.Numbers("interval95", 2, 2);
  if (object.failed()) return {};
  if (!(ends[0] <= quantity.value && quantity.value <= ends[1])) {
    object.Fault("interval95", "does not hold the value");
    return {};
  }
  if (!Plausible(quantity.standard_uncertainty, ends[1] - ends[0])) {
    object.Fault("interval95", fmt::format("is {} wide, which no standard uncertainty of {} gives",
                                           ends[1] - ends[0], quantity.standard_uncertainty));
    return {};
  }
  return Measured::Good({quantity.value, quantity.standard_uncertainty, {ends[0], ends[1]}});
}

std::vector<std::string> ReadTexts(JsonObject& object, const char* key) {
  std::vector<std::string> texts;
  for (const nlohmann::json& entry : object.List(key, 0, kMaxTexts)) {
    if (!entry.is_string()) {
      object.Fault(key, fmt::format("has {}; it must hold texts", Show(entry)));
      return {};
    }
    texts.push_back(entry.get<std::string>());
  }
  return texts;
}

/// Reads the subject, if noted; ignores other keys.
measurement::Subject ReadSubject(JsonObject& object) {
  constexpr std::size_t kMaxBytes = 1000;
  const nlohmann::json* const json = object.Find("subject");
  if (json == nullptr || object.failed()) return {};
  JsonObject inner = object.Inner(*json, "subject");
  measurement::Subject subject;
  for (const auto& [key, words, text] : measurement::SubjectTexts()) {
    const std::string name(key);
    if (!inner.has(name.c_str())) continue;
    subject.*text = inner.Text(name.c_str());
    const std::size_t bytes = (subject.*text).size();
    if (bytes > kMaxBytes) {
      inner.Fault(name, fmt::format("has {} bytes; at most {} are kept", bytes, kMaxBytes));
    }
  }
  if (const auto read = inner.Faults(); !read) object.Adopt(read.error());
  return subject;
}

std::filesystem::path ResultIn(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored) ? path / kResultFile : path;
}

/// Reads all keys of a result except its details; check Finish() before use.
Outcome ReadKeys(JsonObject& object) {
  object.Integer("format", {1, 1});
  Outcome outcome;
  const auto instrument =
      measurement::InstrumentNamed(object.Choice("instrument", measurement::InstrumentNames()));
  if (instrument) outcome.provenance.instrument = *instrument;
  outcome.provenance.program = object.Text("program");
  outcome.provenance.utc = object.Text("utc");
  outcome.provenance.sources = ReadTexts(object, "sources");
  const std::string verdict = object.Choice("verdict", {"good", "cannot_tell", "refused"});
  object.Text("reason");
  std::size_t i = 0;
  for (const nlohmann::json& entry : object.List("answers", 0, kMaxAnswers)) {
    JsonObject inner = object.Inner(entry, fmt::format("answers[{}]", i++));
    Answer answer{inner.Text("name"), inner.Text("unit"), ReadMeasured(inner)};
    if (outcome.Find(answer.name) != nullptr) {
      inner.Fault("name", fmt::format("{} stands there twice", answer.name));
    }
    if (const auto read = inner.Finish(); !read) object.Adopt(read.error());
    outcome.answers.push_back(std::move(answer));
  }
  if (verdict != ToString(outcome.verdict())) {
    object.Fault("verdict", fmt::format("is {}, but that of the answers is {}", verdict,
                                        ToString(outcome.verdict())));
  }
  outcome.notices = ReadTexts(object, "notices");
  outcome.subject = ReadSubject(object);
  return outcome;
}

}  // namespace

ordered_json JsonOf(const Outcome& outcome) {
  ordered_json json = {{"format", 1},
                       {"instrument", ToString(outcome.provenance.instrument)},
                       {"program", outcome.provenance.program},
                       {"utc", outcome.provenance.utc},
                       {"sources", outcome.provenance.sources},
                       {"verdict", ToString(outcome.verdict())},
                       {"reason", outcome.reason()},
                       {"answers", ordered_json::array()},
                       {"notices", outcome.notices}};
  for (const Answer& answer : outcome.answers) json["answers"].push_back(AnswerJson(answer));
  if (outcome.subject != measurement::Subject{}) AddSubject(json["subject"], outcome.subject);
  return json;
}

std::string ToJson(const Outcome& outcome, const ordered_json& details) {
  ordered_json json = JsonOf(outcome);
  if (!details.is_null()) json["details"] = details;
  return JsonText(json);
}

void AddSubject(ordered_json& json, const measurement::Subject& subject) {
  for (const auto& [key, words, text] : measurement::SubjectTexts()) {
    if (!(subject.*text).empty()) json[std::string(key)] = subject.*text;
  }
}

std::string Fingerprint(const Outcome& outcome) {
  std::uint64_t hash = 14695981039346656037U;
  for (const unsigned char c :
       JsonOf(outcome).dump(-1, ' ', false, ordered_json::error_handler_t::replace)) {
    hash = (hash ^ c) * 1099511628211U;
  }
  return fmt::format("{:016x}", hash);
}

Result<Outcome> ParseOutcome(std::string_view text, const std::string& file) {
  const auto json = TRY(ParseJson(text, file));
  JsonObject object(json, file);
  if (json.is_object() && !json.contains("instrument") && json.contains("verdict")) {
    return Fail(file +
                ": is no kept result, but looks like what --json printed: give the file that "
                "--result wrote, or the folder of the recording");
  }
  Outcome outcome = ReadKeys(object);
  object.Find("details");
  TRY(object.Finish());
  return outcome;
}

Result<Outcome> ReadOutcome(const std::filesystem::path& path) {
  const std::filesystem::path file = ResultIn(path);
  const auto text = TRY(ReadNamedFile(file, kMaxResultBytes));
  return ParseOutcome(text, file.string());
}

Result<Outcome> ReadOutcome(const std::filesystem::path& path, Instrument instrument) {
  auto outcome = ReadOutcome(path);
  if (!outcome) return outcome;
  const Instrument found = outcome->provenance.instrument;
  if (found == instrument) return outcome;
  return Fail(fmt::format("{} is a result of {}, not of {}: name one of those",
                          ResultIn(path).string(), measurement::WordsOf(found),
                          measurement::WordsOf(instrument)));
}

Result<void> KeepOutcome(const std::filesystem::path& folder, const Outcome& outcome,
                         const ordered_json& details) {
  const std::filesystem::path path = folder / kResultFile;
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) {
    const auto earlier = ReadOutcome(path, outcome.provenance.instrument);
    if (!earlier) {
      return Fail(earlier.error().message + "; nothing was written over it");
    }
  }
  return WriteWholeFile(path, ToJson(outcome, details), IfThere::kReplace);
}

}  // namespace trammel::files
