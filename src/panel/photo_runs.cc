#include "panel/photo_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "document/interval_text.h"
#include "files/new_file.h"
#include "gcode/dialect.h"
#include "machine/net/command_process.h"
#include "measurement/outcome_file.h"
#include "service/job_process.h"
#include "service/job_record.h"

namespace trammel::panel {
namespace {

namespace fs = std::filesystem;
using machine::OutputStream;
using nlohmann::json;

constexpr std::pair<std::string_view, std::string_view> kEndings[] = {{"image/jpeg", ".jpg"},
                                                                      {"image/png", ".png"},
                                                                      {"image/webp", ".webp"},
                                                                      {"image/heic", ".heic"},
                                                                      {"image/heif", ".heic"}};
constexpr const char* kOwnPattern = "trammel";  // found by the plan of the last print
constexpr const char* kReport = "report.html";
constexpr const char* kQuantity = "pressure_advance";
constexpr std::array kPictures{"answer.png", "photo.png", "response.png", "profiles.png"};

fs::path PhotoIn(const fs::path& folder) {
  for (const auto& [type, ending] : kEndings) {
    std::error_code ignored;
    const fs::path file = folder / ("photo" + std::string(ending));
    if (fs::exists(file, ignored)) return file;
  }
  return {};
}

fs::path GcodeIn(const fs::path& folder) {
  std::error_code ignored;
  for (const char* name : {"pattern.gcode", "pattern.3mf"}) {
    if (fs::exists(folder / name, ignored)) return folder / name;
  }
  return {};
}

// Returns the lines that set a value, one for each firmware and slicer.
json LinesFor(double value_s) {
  json lines = json::array();
  const std::string value = fmt::format("{:.4f}", value_s);
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    lines.push_back({{"firmware", words.title},
                     {"text", gcode::PressureAdvanceCommands(words.dialect, value).front()},
                     {"keep", words.keep}});
  }
  lines.push_back({{"firmware", "OrcaSlicer"},
                   {"text", value},
                   {"keep", "filament settings, Enable pressure advance"}});
  return lines;
}

json Described(const std::string& run, const fs::path& folder,
               const measurement::Outcome& outcome) {
  json answer = {{"run", run},
                 {"verdict", ToString(outcome.verdict())},
                 {"words", outcome.reason()},
                 {"value_s", nullptr},
                 {"interval95_s", nullptr},
                 {"notices", outcome.notices},
                 {"lines", json::array()},
                 {"pictures", json::array()},
                 {"report", nullptr}};
  const measurement::Answer* const found = outcome.Find(kQuantity);
  if (found != nullptr && found->value.good()) {
    const Quantity& quantity = found->value.quantity();
    answer["value_s"] = quantity.value;
    answer["interval95_s"] = {quantity.interval95.lo, quantity.interval95.hi};
    answer["words"] = report::WithInterval(quantity, report::kSeconds);
    answer["lines"] = LinesFor(quantity.value);
  }
  std::error_code ignored;
  for (const char* name : kPictures) {
    if (fs::exists(folder / kFigures / name, ignored)) answer["pictures"].push_back(name);
  }
  if (fs::exists(folder / kReport, ignored)) answer["report"] = kReport;
  return answer;
}

}  // namespace

Result<std::string> PhotoRuns::Add(std::string_view content_type, std::string_view bytes) {
  const auto type = std::ranges::find(kEndings, content_type,
                                      &std::pair<std::string_view, std::string_view>::first);
  if (type == std::end(kEndings)) {
    return Fail(fmt::format("'{}' is no photo: send JPEG, PNG, WebP or HEIC", content_type));
  }
  if (bytes.empty()) return Fail("the photo is empty: send it again");
  const std::lock_guard lock(naming_);
  const std::string utc = options_.utc_now();
  TRY(service::MakeRoomForRun(options_.recordings, utc));
  const std::string name = "photo-" + service::CompactUtc(utc);
  std::string run = name;
  std::error_code error;
  for (int number = 2; fs::exists(options_.recordings / run, error); ++number) {
    run = fmt::format("{}-{}", name, number);
  }
  const fs::path folder = options_.recordings / run;
  fs::create_directories(folder, error);
  if (error) return Fail(fmt::format("cannot make {}: {}", folder.string(), error.message()));
  const auto written = files::WriteWholeFile(folder / ("photo" + std::string(type->second)), bytes,
                                             files::IfThere::kRefuse);
  if (written) return run;
  fs::remove_all(folder, error);
  return tl::unexpected(written.error());
}

Result<fs::path> PhotoRuns::FolderOf(const std::string& run) const {
  std::error_code error;
  const fs::path folder = options_.recordings / run;
  if (service::IsRunId(run) && fs::is_directory(fs::symlink_status(folder, error))) return folder;
  return Fail(fmt::format("there is no run '{}'", run.substr(0, 64)));
}

Result<void> PhotoRuns::AddGcode(const std::string& run, std::string_view bytes) {
  const fs::path folder = TRY(FolderOf(run));
  if (PhotoIn(folder).empty()) return Fail(fmt::format("{} is no photo's", run));
  const bool zip = bytes.starts_with("PK");
  return files::WriteWholeFile(folder / (zip ? "pattern.3mf" : "pattern.gcode"), bytes,
                               files::IfThere::kReplace);
}

Result<json> PhotoRuns::Measure(const std::string& run, const std::string& pattern,
                                const std::stop_token& stop) {
  constexpr double kPatience_s = 120;  // 48 MP take 6 s of one core
  constexpr double kRest_s = 5;
  constexpr std::size_t kMaxErrors = 3;
  const fs::path folder = TRY(FolderOf(run));
  const fs::path photo = PhotoIn(folder);
  if (photo.empty()) return Fail(fmt::format("{} has no photo", run));
  const std::unique_lock lock(measuring_, std::try_to_lock);
  if (!lock) {
    return Fail("another photo is being measured: try again in some seconds", ErrorKind::kMachine);
  }
  std::error_code ignored;
  fs::remove_all(folder / kFigures, ignored);
  fs::remove(folder / files::kResultFile, ignored);
  fs::remove(folder / kReport, ignored);
  std::vector<std::string> words = {options_.program, "--quiet", "pa", "photo", photo.string()};
  words.push_back("--result=" + (folder / files::kResultFile).string());
  words.push_back("--report=" + (folder / kReport).string());
  words.push_back("--figures=" + (folder / kFigures).string());
  if (const fs::path gcode = GcodeIn(folder); !gcode.empty()) {
    words.push_back("--gcode=" + gcode.string());
  } else if (!pattern.empty() && pattern != kOwnPattern) {
    words.push_back("--pattern=" + pattern);
  }
  const auto process = TRY(machine::CommandProcess::Start(words));
  std::vector<std::string> errors;
  const auto end = process->Follow(
      [&](OutputStream stream, std::string_view line) {
        if (stream != OutputStream::kError || line.empty()) return;
        options_.log("  " + std::string(line));
        constexpr std::string_view kOurs = "trammel: ";
        if (line.starts_with(kOurs)) line.remove_prefix(kOurs.size());
        if (errors.size() < kMaxErrors) errors.emplace_back(line);
      },
      {stop, kPatience_s, kRest_s});
  const auto outcome = files::ReadOutcome(folder / files::kResultFile);
  if (outcome) return Described(run, folder, *outcome);
  std::string why;
  for (const std::string& error : errors) why += (why.empty() ? "" : "; ") + error;
  return Fail(why.empty() ? "the photo was not measured: " + end.Describe() : why,
              ErrorKind::kMeasurement);
}

}  // namespace trammel::panel
