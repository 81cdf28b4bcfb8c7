#include "service/job_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/json_text.h"
#include "base/utf8.h"
#include "files/json_object.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"

namespace trammel::service {

using nlohmann::json;

std::string_view ToString(RunEnd end) {
  switch (end) {
    case RunEnd::kNone:
      return "none";
    case RunEnd::kDone:
      return "done";
    case RunEnd::kFailed:
      return "failed";
    case RunEnd::kStopped:
      return "stopped";
    case RunEnd::kUnknown:
      break;
  }
  return "unknown";
}

json JsonOf(const RunRecord& run) {
  const auto known = [](const auto& value) { return value ? json(*value) : json(); };
  const auto text = [](const std::string& value) { return value.empty() ? json() : json(value); };
  return {{"run", run.id},
          {"job", run.job},
          {"arguments", run.arguments},
          {"looks", run.looks},
          {"folder", run.folder},
          {"started", run.started},
          {"ended", text(run.ended)},
          {"phase", run.phase},
          {"progress", known(run.progress)},
          {"remaining_s", known(run.remaining_s)},
          {"message", run.message},
          {"complete", run.complete()},
          {"end", run.complete() ? json(ToString(run.end)) : json()},
          {"verdict", text(run.verdict)}};
}

std::string CompactUtc(std::string utc) {
  std::erase_if(utc, [](char c) { return c == '-' || c == ':'; });
  return utc;
}

bool IsRunId(std::string_view text) {
  constexpr std::size_t kMax = 64;
  const bool plain = std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  });
  return plain && !text.empty() && text.size() <= kMax;
}

Result<std::filesystem::path> FolderOfRun(const std::filesystem::path& recordings,
                                          const std::string& run) {
  std::error_code error;
  const std::filesystem::path folder = recordings / run;
  if (IsRunId(run) && std::filesystem::is_directory(std::filesystem::symlink_status(folder, error)))
    return folder;
  return Fail(fmt::format("there is no run '{}'", run.substr(0, 64)));
}

namespace {

namespace fs = std::filesystem;
using files::JsonObject;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;
constexpr std::size_t kMaxBytes = 1 << 20;
constexpr std::size_t kMaxArguments = 20;
constexpr std::size_t kLongestText = 4096;

constexpr std::size_t kLongestMessage = kLongestText - 16;  // before its ellipsis

// Texts of a run and of a proposal, beside "run" and "arguments".
constexpr std::pair<const char*, std::string RunRecord::*> kRunTexts[] = {
    {"job", &RunRecord::job},         {"folder", &RunRecord::folder},
    {"started", &RunRecord::started}, {"ended", &RunRecord::ended},
    {"message", &RunRecord::message}, {"verdict", &RunRecord::verdict}};
constexpr std::pair<const char*, std::string Proposal::*> kProposalTexts[] = {
    {"job", &Proposal::job}, {"folder", &Proposal::folder}};

template <class Kept, class Texts>
Json JsonOfKept(const Kept& kept, const std::string& run, const Texts& texts) {
  Json json = {{"run", run}, {"arguments", kept.arguments}};
  for (const auto& [key, text] : texts) json[key] = Utf8OrReplaced(kept.*text, kLongestMessage);
  return json;
}

Arguments ReadArguments(JsonObject& object) {
  Arguments arguments;
  const nlohmann::json* const found = object.Find("arguments");
  if (found == nullptr || !found->is_object() || found->size() > kMaxArguments) {
    object.Fault("arguments", "is no object of at most 20 texts");
    return arguments;
  }
  for (const auto& [key, value] : found->items()) {
    const bool good = IsRunId(key) && value.is_string() &&
                      value.get_ref<const std::string&>().size() <= kLongestText;
    if (!good) {
      object.Fault("arguments", "has an entry that is no text");
      return {};
    }
    arguments[key] = value.get<std::string>();
  }
  return arguments;
}

template <class Kept, class Texts>
void ReadKept(JsonObject& object, std::string& run, const Texts& texts, Kept& kept) {
  run = object.Text("run");
  if (!object.failed() && !IsRunId(run)) object.Fault("run", "is no run's name");
  kept.arguments = ReadArguments(object);
  for (const auto& [key, text] : texts) {
    kept.*text = object.Text(key);
    if ((kept.*text).size() > kLongestText) object.Fault(key, "is too long");
  }
}

RunRecord ReadRun(JsonObject object, JsonObject& file) {
  RunRecord run;
  ReadKept(object, run.id, kRunTexts, run);
  const std::string end = object.Choice("end", {"none", "done", "failed", "stopped", "unknown"});
  for (const RunEnd known : {RunEnd::kDone, RunEnd::kFailed, RunEnd::kStopped, RunEnd::kUnknown}) {
    if (end == ToString(known)) run.end = known;
  }
  run.phase = "ended";
  if (!run.complete()) {
    run.end = RunEnd::kUnknown;
    run.message = "trammel serve ended during this run; it was told to end safely";
  }
  if (const auto done = object.Finish(); !done) file.Adopt(done.error());
  return run;
}

Proposal ReadProposal(JsonObject object, JsonObject& file) {
  Proposal proposal;
  ReadKept(object, proposal.run, kProposalTexts, proposal);
  if (const auto done = object.Finish(); !done) file.Adopt(done.error());
  return proposal;
}

}  // namespace

fs::path KeptStatePath(const fs::path& state_folder, std::string_view address) {
  fs::path path = files::LockPath(state_folder, address);
  return path.replace_extension(".serve.json");
}

Result<void> WriteKeptState(const fs::path& path, const KeptState& state) {
  Json json;
  json["format"] = kFormat;
  if (state.run) {
    json["run"] = JsonOfKept(*state.run, state.run->id, kRunTexts);
    json["run"]["end"] = ToString(state.run->end);
  }
  if (state.proposal) {
    json["proposal"] = JsonOfKept(*state.proposal, state.proposal->run, kProposalTexts);
  }
  return files::WriteWholeFile(path, JsonText(json), files::IfThere::kReplace,
                               files::Readable::kByOwner);
}

Result<KeptState> ParseKeptState(std::string_view text, const std::string& file) {
  const auto json = TRY(files::ParseJson(text, file));
  JsonObject object(json, file);
  object.Integer("format", {kFormat, kFormat});
  KeptState state;
  const auto entry = [&object](const char* key) {
    const nlohmann::json* const found = object.Find(key);
    return found == nullptr || found->is_null() ? nullptr : found;
  };
  if (const auto* const run = entry("run")) state.run = ReadRun(object.Inner(*run, "run"), object);
  if (const auto* const proposal = entry("proposal")) {
    state.proposal = ReadProposal(object.Inner(*proposal, "proposal"), object);
  }
  TRY(object.Finish());
  return state;
}

Result<KeptState> ReadKeptState(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(path, ignored))) return KeptState();
  const auto text = TRY(files::ReadNamedFile(path, kMaxBytes));
  return ParseKeptState(text, path.string());
}

namespace {

constexpr std::string_view kEnding = ".png";
constexpr std::size_t kMaxRemoved = 100;  // per cleanup

/// Returns the start of a run from the name of its picture; empty if it is none:
/// JOB-TIME[-NUMBER].png.
std::string TimeIn(const std::string& name) {
  constexpr std::string_view kForm = "20260102T030405Z";
  if (!name.ends_with(kEnding)) return {};
  const std::string run = name.substr(0, name.size() - kEnding.size());
  const std::size_t dash = run.find('-');
  if (!IsRunId(run) || dash == std::string::npos || dash == 0) return {};
  const std::string time = run.substr(dash + 1, kForm.size());
  for (std::size_t i = 0; i < kForm.size(); ++i) {
    const bool digit = i < time.size() && time[i] >= '0' && time[i] <= '9';
    const bool letter = kForm[i] == 'T' || kForm[i] == 'Z';
    if (letter ? i >= time.size() || time[i] != kForm[i] : !digit) return {};
  }
  return run.substr(dash + 1);
}

void RemoveOldest(machine::Printer& printer, const machine::WaitLimit& limit) {
  const auto listed = printer.CallServer(
      "server.files.get_directory", {{"path", fmt::format("config/{}", kPictureFolder)}}, limit);
  if (!listed || !listed->is_object() || !listed->contains("files")) return;
  std::vector<std::pair<std::string, std::string>> pictures;  // time, name
  for (const json& file : (*listed)["files"]) {
    if (!file.is_object() || !file.contains("filename") || !file["filename"].is_string()) continue;
    std::string name = file["filename"].get<std::string>();
    std::string time = TimeIn(name);
    if (!time.empty()) pictures.emplace_back(std::move(time), std::move(name));
  }
  if (pictures.size() <= kMaxPictures) return;
  std::ranges::sort(pictures);
  pictures.resize(std::min(pictures.size() - kMaxPictures, kMaxRemoved));
  for (const auto& [time, name] : pictures) {
    const auto removed =
        printer.CallServer("server.files.delete_file",
                           {{"path", fmt::format("config/{}/{}", kPictureFolder, name)}}, limit);
    if (!removed) return;
  }
}

}  // namespace

bool IsResultPicture(const std::string& name) { return !TimeIn(name).empty(); }

Result<void> StorePicture(machine::Printer& printer, const std::string& run, std::string_view png,
                          const machine::WaitLimit& limit) {
  if (png.size() > kMaxPictureBytes) {
    return Fail(fmt::format("the picture of {} has {} bytes; at most {} are stored", run,
                            png.size(), kMaxPictureBytes));
  }
  auto stored =
      printer.UploadConfig(fmt::format("{}/{}{}", kPictureFolder, run, kEnding), png, limit);
  if (stored) RemoveOldest(printer, limit);
  return stored;
}

}  // namespace trammel::service
