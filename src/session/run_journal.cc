#include "session/run_journal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/json_text.h"
#include "files/json_object.h"
#include "files/new_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 2;
constexpr std::size_t kMaxBytes = std::size_t{256} << 10;
constexpr std::size_t kMaxSettings = 1000;
constexpr std::size_t kMaxValues = 1000;  // per setting: each line of a pattern has its own value
constexpr const char* kEnding = ".journal.json";

// Beyond any machine's values; limits the effect of a damaged file on G-code.
constexpr NumberRange kSpeeds{1e-6, 1e6};
constexpr NumberRange kShares{0, 1};
constexpr NumberRange kCorners{0, 1e4};
constexpr NumberRange kTimes_s{0, 100};
constexpr NumberRange kTargets_c{0, 2000};
constexpr NumberRange kFactors{1e-6, 1e4};
constexpr NumberRange kPlaces_mm{-1e5, 1e5};

// Range of a setting; true if it belongs to a section.
struct SettingKind {
  NumberRange range;
  bool of_a_section = false;
};

const std::map<std::string_view, SettingKind>& SettingKinds() {
  static const std::map<std::string_view, SettingKind> kinds = {
      {"max_velocity", {kSpeeds}},
      {"max_accel", {kSpeeds}},
      {"square_corner_velocity", {kCorners}},
      {"minimum_cruise_ratio", {kShares}},
      {"pressure_advance", {kTimes_s, true}},
      {"smooth_time", {kTimes_s, true}},
      {"target", {kTargets_c, true}},
      {"absolute_coordinates", {kShares}},
      {"absolute_extrude", {kShares}},
      {"speed_factor", {kFactors}},
      {"extrude_factor", {kFactors}},
      {"offset", {kPlaces_mm, true}},
  };
  return kinds;
}

bool IsWordLike(std::string_view text, std::string_view more, std::size_t most) {
  return !text.empty() && text.size() <= most &&
         std::all_of(text.begin(), text.end(), [&](unsigned char c) {
           return c < 0x80 && (std::isalnum(c) != 0 ||
                               more.find(static_cast<char>(c)) != std::string_view::npos);
         });
}

// 32-bit FNV-1a: distinguishes addresses with the same letters.
std::uint32_t HashOf(std::string_view text) {
  std::uint32_t hash = 2166136261U;
  for (const unsigned char c : text) hash = (hash ^ c) * 16777619U;
  return hash;
}

std::string FileNameOf(std::string_view address) {
  constexpr std::size_t kShown = 60;
  std::string name;
  for (const char c : address.substr(0, kShown)) {
    name += IsWordLike(std::string_view(&c, 1), ".-", 1) ? c : '_';
  }
  return fmt::format("printer-{}-{:08x}", name, HashOf(address));
}

bool IsSection(std::string_view text) { return IsWordLike(text, "_ -.+:/", 100); }

const SettingKind* KindOf(std::string_view setting) {
  const std::size_t blank = setting.find(' ');
  const auto kind = SettingKinds().find(setting.substr(0, blank));
  if (kind == SettingKinds().end()) return nullptr;
  const bool section = blank != std::string_view::npos;
  if (section != kind->second.of_a_section) return nullptr;
  return !section || IsSection(setting.substr(blank + 1)) ? &kind->second : nullptr;
}

bool Flag(JsonObject& object, const char* key) {
  const nlohmann::json* flag = object.Find(key);
  if (flag == nullptr) return false;
  if (!flag->is_boolean()) object.Fault(key, "must be true or false");
  return flag->is_boolean() && flag->get<bool>();
}

// Reads a setting and its range from a list of {"name", …}.
const SettingKind* ReadName(JsonObject& entry, std::string& name) {
  name = entry.Text("name");
  const SettingKind* kind = KindOf(name);
  if (kind == nullptr && !entry.failed()) entry.Fault("name", "is no setting's name");
  return kind;
}

void ReadSettings(JsonObject& object, RunJournal& journal) {
  for (const auto& json : object.List("before", 0, kMaxSettings)) {
    JsonObject entry = object.Inner(json, "before");
    std::string name;
    if (const SettingKind* kind = ReadName(entry, name)) {
      journal.before[name] = entry.Number("value", kind->range);
    }
    if (const auto done = entry.Finish(); !done) object.Adopt(done.error());
  }
  for (const auto& json : object.List("given", 0, kMaxSettings)) {
    JsonObject entry = object.Inner(json, "given");
    std::string name;
    if (const SettingKind* kind = ReadName(entry, name)) {
      const auto values = entry.Numbers("values", 0, kMaxValues, kind->range);
      journal.given[name] = {values.begin(), values.end()};
    }
    if (const auto done = entry.Finish(); !done) object.Adopt(done.error());
  }
}

}  // namespace

bool IsRunName(std::string_view text) { return IsWordLike(text, "-", 64); }

Result<fs::path> StateFolder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (state != nullptr && fs::path(state).is_absolute()) {
    folder = fs::path(state) / "trammel";
  } else if (home != nullptr && fs::path(home).is_absolute()) {
    folder = fs::path(home) / ".local" / "state" / "trammel";
  } else {
    return Fail(
        "there is no place to note what has to come back on the printer: set HOME or "
        "XDG_STATE_HOME to a folder");
  }
  std::error_code error;
  const bool made = fs::create_directories(folder, error);
  if (!error && made) fs::permissions(folder, fs::perms::owner_all, error);
  if (error) {
    return Fail(
        fmt::format("{}: cannot be made: {}; what has to come back on the printer is noted "
                    "there: XDG_STATE_HOME names another place",
                    folder.string(), error.message()));
  }
  return folder;
}

fs::path JournalPath(const fs::path& state_folder, std::string_view address) {
  return state_folder / (FileNameOf(address) + kEnding);
}

fs::path LockPath(const fs::path& state_folder, std::string_view address) {
  return state_folder / (FileNameOf(address) + ".lock");
}

Result<void> WriteJournal(const fs::path& path, const RunJournal& journal) {
  Json json;
  json["format"] = kFormat;
  json["run"] = journal.run;
  json["address"] = journal.address;
  json["started"] = journal.started;
  json["upload"] = journal.upload;
  json["before"] = Json::array();
  for (const auto& [name, value] : journal.before) {
    json["before"].push_back({{"name", name}, {"value", value}});
  }
  json["given"] = Json::array();
  for (const auto& [name, values] : journal.given) {
    json["given"].push_back({{"name", name}, {"values", values}});
  }
  json["last_print"] = journal.last_print;
  json["last_print_s"] = journal.last_print_s;
  if (journal.changes_tools) json["changes_tools"] = true;
  if (journal.without_laser) json["without_laser"] = true;
  if (!journal.ended.empty()) json["ended"] = journal.ended;
  const std::string text = JsonText(json);
  const auto kept = files::WriteWholeFile(path, text, files::IfThere::kReplace);
  if (kept) return {};
  return Fail(
      fmt::format("what has to come back on the printer cannot be noted, so nothing is "
                  "begun: {}",
                  kept.error().message));
}

Result<std::optional<RunJournal>> ReadJournal(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(path, error))) return std::optional<RunJournal>();
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject object(json, path.string());
  (void)object.Integer("format", {kFormat, kFormat});
  RunJournal journal;
  journal.run = object.Text("run");
  journal.address = object.Text("address");
  journal.started = object.Text("started");
  journal.upload = object.Text("upload");
  ReadSettings(object, journal);
  journal.last_print = object.Text("last_print");
  journal.last_print_s = object.Number("last_print_s", {0, 1e9});
  journal.changes_tools = Flag(object, "changes_tools");
  journal.without_laser = Flag(object, "without_laser");
  if (object.has("ended")) journal.ended = object.Text("ended");
  if (!object.failed() && !IsRunName(journal.run)) object.Fault("run", "is no run's name");
  const bool plain = journal.upload.empty() || IsWordLike(journal.upload, "_-./", 200);
  if (!object.failed() && (!plain || journal.upload.find("..") != std::string::npos)) {
    object.Fault("upload", "is no uploaded file's name");
  }
  TRY(object.Finish());
  return std::optional(std::move(journal));
}

std::map<fs::path, RunJournal> ReadAllJournals(const fs::path& state_folder) {
  constexpr std::size_t kMax = 100;
  std::map<fs::path, RunJournal> journals;
  std::error_code error;
  for (fs::directory_iterator at(state_folder, error), end; !error && at != end;
       at.increment(error)) {
    if (!at->path().filename().string().ends_with(kEnding)) continue;
    auto journal = ReadJournal(at->path());
    if (journal && *journal) journals[at->path()] = std::move(**journal);
    if (journals.size() == kMax) break;
  }
  return journals;
}

}  // namespace trammel::files
