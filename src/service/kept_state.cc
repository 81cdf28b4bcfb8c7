#include "service/kept_state.h"

#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "base/json_text.h"
#include "base/utf8.h"
#include "files/json_object.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "session/run_journal.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using files::JsonObject;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;
constexpr std::size_t kMostBytes = 1 << 20;
constexpr std::size_t kMostArguments = 20;
constexpr std::size_t kLongestText = 4096;

constexpr std::size_t kLongestMessage = kLongestText - 16;  // before its ellipsis

Json JsonOfKept(const RunRecord& run) {
  return {{"run", run.id},
          {"job", run.job},
          {"arguments", run.arguments},
          {"folder", run.folder},
          {"started", run.started},
          {"ended", run.ended},
          {"message", Utf8OrReplaced(run.message, kLongestMessage)},
          {"end", ToString(run.end)},
          {"verdict", run.verdict}};
}

Json JsonOfKept(const Proposal& proposal) {
  return {{"run", proposal.run},
          {"job", proposal.job},
          {"folder", proposal.folder},
          {"arguments", proposal.arguments}};
}

std::string BoundedText(JsonObject& object, const char* key) {
  std::string text = object.Text(key);
  if (!object.failed() && text.size() > kLongestText) object.Fault(key, "is too long");
  return text;
}

std::string RunId(JsonObject& object) {
  std::string id = object.Text("run");
  if (!object.failed() && !IsRunId(id)) object.Fault("run", "is no run's name");
  return id;
}

Arguments ReadArguments(JsonObject& object) {
  Arguments arguments;
  const nlohmann::json* const found = object.Find("arguments");
  if (found == nullptr || !found->is_object() || found->size() > kMostArguments) {
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

RunRecord ReadRun(JsonObject object, JsonObject& file) {
  RunRecord run;
  run.id = RunId(object);
  run.job = BoundedText(object, "job");
  run.arguments = ReadArguments(object);
  run.folder = BoundedText(object, "folder");
  run.started = BoundedText(object, "started");
  run.ended = BoundedText(object, "ended");
  run.message = BoundedText(object, "message");
  run.verdict = BoundedText(object, "verdict");
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
  proposal.run = RunId(object);
  proposal.job = BoundedText(object, "job");
  proposal.folder = BoundedText(object, "folder");
  proposal.arguments = ReadArguments(object);
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
  json["run"] = state.run ? JsonOfKept(*state.run) : Json();
  json["proposal"] = state.proposal ? JsonOfKept(*state.proposal) : Json();
  return files::WriteWholeFile(path, JsonText(json), files::IfThere::kReplace,
                               files::Readable::kByOwner);
}

Result<KeptState> ParseKeptState(std::string_view text, const std::string& file) {
  const auto json = files::ParseJson(text, file);
  if (!json) return tl::unexpected(json.error());
  JsonObject object(*json, file);
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
  if (const auto done = object.Finish(); !done) return tl::unexpected(done.error());
  return state;
}

Result<KeptState> ReadKeptState(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(path, ignored))) return KeptState();
  const auto text = files::ReadNamedFile(path, kMostBytes);
  if (!text) return tl::unexpected(text.error());
  return ParseKeptState(*text, path.string());
}

}  // namespace trammel::service
