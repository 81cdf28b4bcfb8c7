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

constexpr int kFormat = 1;
constexpr std::size_t kMostBytes = std::size_t{64} << 10;
constexpr std::size_t kMostHeaters = 100;
constexpr const char* kEnding = ".journal.json";

// Beyond what any machine knows; bounds what a damaged file can bring into G-code.
constexpr NumberRange kSpeeds{1e-6, 1e6};
constexpr NumberRange kShares{0, 1};
constexpr NumberRange kCorners{0, 1e4};
constexpr NumberRange kTimes_s{0, 10};
constexpr NumberRange kTargets_c{0, 1000};

bool IsWordLike(std::string_view text, std::string_view more, std::size_t most) {
  return !text.empty() && text.size() <= most &&
         std::all_of(text.begin(), text.end(), [&](unsigned char c) {
           return c < 0x80 && (std::isalnum(c) != 0 ||
                               more.find(static_cast<char>(c)) != std::string_view::npos);
         });
}

// 32-bit FNV-1a: tells addresses apart whose letters are alike.
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

bool IsSection(std::string_view text) { return IsWordLike(text, "_ -", 100); }

void Put(Json& json, const char* key, const std::optional<double>& value) {
  if (value) json[key] = *value;
}

bool Flag(JsonObject& object, const char* key) {
  const nlohmann::json* flag = object.Find(key);
  if (flag == nullptr) return false;
  if (!flag->is_boolean()) object.Fault(key, "must be true or false");
  return flag->is_boolean() && flag->get<bool>();
}

// Of before there was more than one: the active extruder's. Which one that was is noted where the
// run changed tools, and the first is meant elsewhere.
void ReadSinglePressureAdvance(JsonObject& object, RunJournal& journal) {
  const auto advance_s = object.OptionalNumber("pressure_advance_s", kTimes_s);
  const auto smooth_time_s = object.OptionalNumber("smooth_time_s", kTimes_s);
  std::string extruder = object.has("extruder") ? object.Text("extruder") : "";
  journal.changes_tools = journal.changes_tools || !extruder.empty();
  if (extruder.empty()) extruder = "extruder";
  if (!IsSection(extruder)) object.Fault("extruder", "is no extruder's name");
  if (advance_s) journal.pressure_advance[extruder] = {*advance_s, smooth_time_s};
}

void ReadPressureAdvance(JsonObject& object, RunJournal& journal) {
  journal.changes_tools = Flag(object, "changes_tools");
  const nlohmann::json* motors = object.OptionalList("pressure_advance", 0, kMostHeaters);
  if (motors == nullptr) return ReadSinglePressureAdvance(object, journal);
  for (const auto& entry : *motors) {
    JsonObject motor = object.Inner(entry, "pressure_advance");
    const std::string section = motor.Text("section");
    const double advance_s = motor.Number("advance_s", kTimes_s);
    const auto smooth_time_s = motor.OptionalNumber("smooth_time_s", kTimes_s);
    if (!motor.failed() && !IsSection(section)) motor.Fault("section", "is no section's name");
    if (const auto done = motor.Finish(); !done) object.Adopt(done.error());
    journal.pressure_advance[section] = {advance_s, smooth_time_s};
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
  Put(json, "max_velocity_mm_s", journal.max_velocity_mm_s);
  Put(json, "max_accel_mm_s2", journal.max_accel_mm_s2);
  Put(json, "square_corner_velocity_mm_s", journal.square_corner_velocity_mm_s);
  Put(json, "minimum_cruise_ratio", journal.minimum_cruise_ratio);
  json["pressure_advance"] = Json::array();
  for (const auto& [section, motor] : journal.pressure_advance) {
    Json entry = {{"section", section}, {"advance_s", motor.advance_s}};
    Put(entry, "smooth_time_s", motor.smooth_time_s);
    json["pressure_advance"].push_back(std::move(entry));
  }
  if (journal.changes_tools) json["changes_tools"] = true;
  if (journal.without_laser) json["without_laser"] = true;
  if (!journal.ended.empty()) json["ended"] = journal.ended;
  json["heaters"] = Json::array();
  for (const auto& [name, target_c] : journal.targets_c) {
    json["heaters"].push_back({{"name", name}, {"target_c", target_c}});
  }
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
  const auto json = ReadJsonFile(path, kMostBytes);
  if (!json) return tl::unexpected(json.error());
  JsonObject object(*json, path.string());
  object.Integer("format", {kFormat, kFormat});
  RunJournal journal;
  journal.run = object.Text("run");
  journal.address = object.Text("address");
  journal.started = object.Text("started");
  journal.upload = object.Text("upload");
  journal.max_velocity_mm_s = object.OptionalNumber("max_velocity_mm_s", kSpeeds);
  journal.max_accel_mm_s2 = object.OptionalNumber("max_accel_mm_s2", kSpeeds);
  journal.square_corner_velocity_mm_s =
      object.OptionalNumber("square_corner_velocity_mm_s", kCorners);
  journal.minimum_cruise_ratio = object.OptionalNumber("minimum_cruise_ratio", kShares);
  ReadPressureAdvance(object, journal);
  journal.without_laser = Flag(object, "without_laser");
  if (object.has("ended")) journal.ended = object.Text("ended");
  for (const auto& entry : object.List("heaters", 0, kMostHeaters)) {
    JsonObject heater = object.Inner(entry, "heaters");
    const std::string name = heater.Text("name");
    const double target_c = heater.Number("target_c", kTargets_c);
    if (!heater.failed() && !IsSection(name)) heater.Fault("name", "is no heater's name");
    if (const auto done = heater.Finish(); !done) object.Adopt(done.error());
    journal.targets_c[name] = target_c;
  }
  if (!object.failed() && !IsRunName(journal.run)) object.Fault("run", "is no run's name");
  const bool plain = journal.upload.empty() || IsWordLike(journal.upload, "_-./", 200);
  if (!object.failed() && (!plain || journal.upload.find("..") != std::string::npos)) {
    object.Fault("upload", "is no uploaded file's name");
  }
  if (const auto done = object.Finish(); !done) return tl::unexpected(done.error());
  return std::optional(std::move(journal));
}

std::map<fs::path, RunJournal> ReadAllJournals(const fs::path& state_folder) {
  constexpr std::size_t kMost = 100;
  std::map<fs::path, RunJournal> journals;
  std::error_code error;
  for (fs::directory_iterator at(state_folder, error), end; !error && at != end;
       at.increment(error)) {
    if (!at->path().filename().string().ends_with(kEnding)) continue;
    auto journal = ReadJournal(at->path());
    if (journal && *journal) journals[at->path()] = std::move(**journal);
    if (journals.size() == kMost) break;
  }
  return journals;
}

}  // namespace trammel::files
