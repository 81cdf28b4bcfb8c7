#include "panel/photo_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include "base/utf8.h"
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
constexpr std::array kGcodes{"photo.gcode", "photo.3mf"};
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
  for (const char* name : kGcodes) {
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
  TRY(service::MakeRoomForRun(options_.recordings, utc, service::kUpload));
  const std::string name = fmt::format("{}-{}", service::kUpload, service::CompactUtc(utc));
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

Result<fs::path> PhotoRuns::UploadOf(const std::string& run) const {
  if (run.starts_with(service::kUpload)) return FolderOf(run);
  return Fail(fmt::format("there is no run '{}' of an uploaded photo", run.substr(0, 64)));
}

Result<void> PhotoRuns::AddGcode(const std::string& run, std::string_view bytes) {
  const fs::path folder = TRY(UploadOf(run));
  const bool zip = bytes.starts_with("PK");
  TRY(files::WriteWholeFile(folder / kGcodes[zip ? 1 : 0], bytes, files::IfThere::kReplace));
  std::error_code ignored;
  fs::remove(folder / kGcodes[zip ? 0 : 1], ignored);
  return {};
}

void PhotoRuns::Keep(const std::string& run, bool keep) {
  const std::lock_guard lock(keeping_);
  if (keep) {
    kept_.insert(run);
  } else {
    kept_.erase(run);
  }
}

Result<json> PhotoRuns::Measure(const std::string& run, const std::string& pattern,
                                const std::stop_token& stop) {
  constexpr double kPatience_s = 120;  // 48 MP take 6 s of one core
  constexpr double kRest_s = 5;
  constexpr std::size_t kMaxErrors = 3;
  const fs::path folder = TRY(UploadOf(run));
  const fs::path photo = PhotoIn(folder);
  if (photo.empty()) return Fail(fmt::format("{} has no photo", run));
  // A page whose link broke asks again while its photo is measured. More than a few would take the
  // threads that answer.
  constexpr int kMostWaiting = 2;
  constexpr std::chrono::seconds kWait(100);
  const std::shared_ptr<void> leaves(nullptr, [this](void*) { --waiting_; });
  const bool may_wait = ++waiting_ <= kMostWaiting;
  std::unique_lock lock(measuring_, std::defer_lock);
  if (!(may_wait ? lock.try_lock_for(kWait) : lock.try_lock())) {
    return Fail("another photo is being measured: try again in some seconds", ErrorKind::kMachine);
  }
  const fs::path fresh = folder / "new";
  std::error_code ignored;
  fs::remove_all(fresh, ignored);
  fs::create_directory(fresh, ignored);
  std::vector<std::string> words = {options_.program, "--quiet", "pa", "photo", photo.string()};
  words.push_back("--result=" + (fresh / files::kResultFile).string());
  words.push_back("--report=" + (fresh / kReport).string());
  words.push_back("--figures=" + (fresh / kFigures).string());
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
        options_.log("  " + Utf8OrReplaced(line));
        constexpr std::string_view kOurs = "trammel: ";
        if (line.starts_with(kOurs)) line.remove_prefix(kOurs.size());
        if (errors.size() < kMaxErrors) errors.emplace_back(line);
      },
      {stop, kPatience_s, kRest_s});
  const auto outcome = files::ReadOutcome(fresh / files::kResultFile);
  if (outcome) {
    // Its value may have been used meanwhile: whatever is set is what was shown.
    const std::lock_guard keeping(keeping_);
    if (kept_.contains(run)) {
      fs::remove_all(fresh, ignored);
      return Fail("the photo's value was used: send the photo once more");
    }
    fs::remove_all(folder / kFigures, ignored);
    fs::remove(folder / kReport, ignored);
    for (const std::string_view name :
         {std::string_view(kFigures), std::string_view(kReport), files::kResultFile}) {
      fs::rename(fresh / name, folder / name, ignored);
    }
    fs::remove_all(fresh, ignored);
    json answer = Described(run, folder, *outcome);
    for (const std::string& error : errors) answer["notices"].push_back(error);
    return answer;
  }
  fs::remove_all(fresh, ignored);
  std::string why;
  for (const std::string& error : errors) why += (why.empty() ? "" : "; ") + error;
  return Fail(why.empty() ? "the photo was not measured: " + end.Describe() : why,
              ErrorKind::kMeasurement);
}

}  // namespace trammel::panel
