#include "measurement/applied.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <system_error>
#include <utility>

#include "files/json_object.h"
#include "files/new_file.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace fs = std::filesystem;

Result<void> ForEachLine(const fs::path& path,
                         const std::function<void(std::string_view line)>& visit) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return Fail(path.string() + ": there is no such file; check the path");
  if (!fs::is_regular_file(status)) return Fail(path.string() + ": is not an ordinary file");
  std::ifstream file(path, std::ios::binary);
  if (!file) return Fail(path.string() + ": cannot be read");
  std::vector<char> piece(std::size_t{1} << 16);
  std::string line;
  bool too_long = false;
  const auto end_line = [&] {
    if (!too_long && !line.empty()) visit(line);
    line.clear();
    too_long = false;
  };
  do {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    std::string_view rest(piece.data(), static_cast<std::size_t>(file.gcount()));
    while (!rest.empty()) {
      const std::size_t end = rest.find('\n');
      const std::string_view part = rest.substr(0, end);
      too_long = too_long || line.size() + part.size() > kMaxLineBytes;
      if (!too_long) line += part;
      if (end == std::string_view::npos) break;
      end_line();
      rest.remove_prefix(end + 1);
    }
  } while (file);
  if (file.bad()) return Fail(path.string() + ": reading failed");
  end_line();
  return {};
}

namespace {

using measurement::Instrument;
using measurement::Outcome;
using nlohmann::ordered_json;

constexpr std::size_t kMaxApplications = 100;
constexpr std::size_t kMaxParts = 100;  // of a machine that share one value
using Step = Application::Step;
// Ordered as in Step.
constexpr std::array kSteps = {"applied", "begun", "undone", "undoing", "not_in_force"};

}  // namespace

bool IsUnfinished(const Application& application) {
  return application.step == Step::kBegun || application.step == Step::kUndoing;
}

ordered_json JsonOf(const Application& application) {
  ordered_json json = {{"utc", application.utc},
                       {"machine", application.machine},
                       {"step", kSteps[static_cast<std::size_t>(application.step)]}};
  if (application.before) json["before"] = *application.before;
  if (application.value) json["value"] = *application.value;
  if (!application.before_each.empty()) json["before_each"] = application.before_each;
  return json;
}

Result<void> NoteApplication(const fs::path& path, Instrument instrument,
                             const std::string& fingerprint, const Application& application) {
  ordered_json json = {
      {"format", 1}, {"instrument", ToString(instrument)}, {"result", fingerprint}};
  json.update(JsonOf(application));
  return AppendLine(path, json.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
}

Result<void> NoteApplication(const fs::path& path, const Outcome& outcome,
                             const Application& application) {
  return NoteApplication(path, outcome.provenance.instrument, Fingerprint(outcome), application);
}

namespace {

struct AppliedLine {
  std::string instrument;
  std::string fingerprint;
  Application application;
};

// Reads at most kMaxParts numbers.
std::map<std::string, double> ReadBeforeEach(JsonObject& object) {
  std::map<std::string, double> before;
  const nlohmann::json* each = object.Find("before_each");
  if (each == nullptr) return before;
  if (!each->is_object() || each->size() > kMaxParts) {
    object.Fault("before_each", fmt::format("must be an object of at most {} keys", kMaxParts));
    return before;
  }
  JsonObject values = object.Inner(*each, "before_each");
  for (const auto& [name, value] : each->items()) before[name] = values.Number(name.c_str());
  if (const auto read = values.Faults(); !read) object.Adopt(read.error());
  return before;
}

std::optional<AppliedLine> ParseAppliedLine(std::string_view line, const fs::path& path) {
  const auto json = ParseJson(line, path.string());
  if (!json || !json->is_object()) return std::nullopt;
  JsonObject object(*json, path.string());
  object.Integer("format", {1, 1});
  AppliedLine read;
  read.instrument = object.Text("instrument");
  read.fingerprint = object.Text("result");
  Application& application = read.application;
  application.utc = object.Text("utc");
  application.machine = object.Text("machine");
  const std::string step =
      object.OptionalChoice("step", {kSteps[0], kSteps[1], kSteps[2], kSteps[3], kSteps[4]})
          .value_or(kSteps[0]);
  application.step = static_cast<Application::Step>(std::find(kSteps.begin(), kSteps.end(), step) -
                                                    kSteps.begin());
  application.before = object.OptionalNumber("before");
  application.value = object.OptionalNumber("value");
  application.before_each = ReadBeforeEach(object);
  if (object.failed()) return std::nullopt;
  return read;
}

// True if both are steps of one application: begun then done, or done then undone. The value before
// the first step, and the value it set, count.
bool Continues(const Application& before, const Application& now) {
  if (now.step == Step::kApplied || now.step == Step::kNotInForce) return IsUnfinished(before);
  return now.step == Step::kUndone || now.step == Step::kUndoing;
}

Application Merged(const Application& before, Application now) {
  now.before = before.before;
  now.before_each = before.before_each;
  if (before.value) now.value = before.value;
  return now;
}

/// Appends an application: merges one that continues the last; drops the oldest of too many.
void Take(NotedApplication now, std::vector<NotedApplication>& noted) {
  if (!noted.empty() && noted.back().fingerprint == now.fingerprint &&
      Continues(noted.back().application, now.application)) {
    noted.back().application = Merged(noted.back().application, std::move(now.application));
    return;
  }
  if (noted.size() == kMaxApplications) noted.erase(noted.begin());
  noted.push_back(std::move(now));
}

Result<void> ForEachApplied(const fs::path& path, const std::function<void(AppliedLine)>& visit) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return {};
  return ForEachLine(path, [&](std::string_view line) {
    if (auto read = ParseAppliedLine(line, path)) visit(std::move(*read));
  });
}

}  // namespace

Result<std::vector<NotedApplication>> Applications(
    const fs::path& path, Instrument instrument,
    const std::function<bool(const std::string& address)>& of_machine) {
  std::vector<NotedApplication> noted;
  const auto read = ForEachApplied(path, [&](AppliedLine line) {
    if (line.instrument != ToString(instrument) || !of_machine(line.application.machine)) return;
    Take({std::move(line.application), std::move(line.fingerprint)}, noted);
  });
  if (!read) return tl::unexpected(read.error());
  return noted;
}

Result<std::map<std::string, std::vector<Application>>> AllApplications(const fs::path& path) {
  std::map<std::string, std::vector<Application>> all;
  const auto read = ForEachApplied(path, [&](AppliedLine line) {
    if (line.fingerprint.empty()) return;
    std::vector<Application>& applied = all[line.fingerprint];
    Application now = std::move(line.application);
    if (!applied.empty() && applied.back().machine == now.machine &&
        Continues(applied.back(), now)) {
      now = Merged(applied.back(), std::move(now));
      applied.pop_back();
    }
    if (applied.size() == kMaxApplications) applied.erase(applied.begin());
    applied.push_back(std::move(now));
  });
  if (!read) return tl::unexpected(read.error());
  return all;
}

}  // namespace trammel::files
