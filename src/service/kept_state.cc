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
  const auto text = TRY(files::ReadNamedFile(path, kMostBytes));
  return ParseKeptState(text, path.string());
}

}  // namespace trammel::service
