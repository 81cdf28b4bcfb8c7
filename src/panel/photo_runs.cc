#include "panel/photo_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "document/interval_text.h"
#include "files/new_file.h"
#include "gcode/dialect.h"
#include "measurement/outcome_file.h"
#include "panel/measuring.h"
#include "panel/run_files.h"
#include "service/job_process.h"
#include "service/job_record.h"

namespace trammel::panel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::pair<std::string_view, std::string_view> kEndings[] = {{"image/jpeg", ".jpg"},
                                                                      {"image/png", ".png"},
                                                                      {"image/webp", ".webp"},
                                                                      {"image/heic", ".heic"},
                                                                      {"image/heif", ".heic"}};
constexpr const char* kOwnPattern = "trammel";  // found by the plan of the last print
constexpr const char* kQuantity = "pressure_advance";
constexpr std::array kGcodes{"photo.gcode", "photo.3mf"};

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
  lines.push_back({{"firmware", "Klipper, for good"},
                   {"text", fmt::format("pressure_advance: {}", value)},
                   {"keep", "under [extruder] in printer.cfg, then restart"}});
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
                 {"lines", json::array()}};
  AddFiles(folder, answer);
  const measurement::Answer* const found = outcome.Find(kQuantity);
  if (found != nullptr && found->value.good()) {
    const Quantity& quantity = found->value.quantity();
    answer["value_s"] = quantity.value;
    answer["interval95_s"] = {quantity.interval95.lo, quantity.interval95.hi};
    answer["words"] = report::WithInterval(quantity, report::kSeconds);
    answer["lines"] = LinesFor(quantity.value);
  }
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
  const std::string run =
      TRY(service::MakeRunFolder(options_.recordings, options_.utc_now(), service::kUpload));
  const fs::path folder = options_.recordings / run;
  const auto written = files::WriteWholeFile(folder / ("photo" + std::string(type->second)), bytes,
                                             files::IfThere::kRefuse);
  if (written) return run;
  std::error_code error;
  fs::remove_all(folder, error);
  return tl::unexpected(written.error());
}

bool PhotoRuns::IsUpload(const std::string& run) { return run.starts_with(service::kUpload); }

Result<fs::path> PhotoRuns::FolderOf(const std::string& run) const {
  if (IsUpload(run)) return service::FolderOfRun(options_.recordings, run);
  return Fail(fmt::format("there is no run '{}' of an uploaded photo", run.substr(0, 64)));
}

Result<void> PhotoRuns::AddGcode(const std::string& run, std::string_view bytes) {
  const fs::path folder = TRY(FolderOf(run));
  const bool zip = bytes.starts_with("PK");
  TRY(files::WriteWholeFile(folder / kGcodes[zip ? 1 : 0], bytes, files::IfThere::kReplace));
  std::error_code ignored;
  fs::remove(folder / kGcodes[zip ? 0 : 1], ignored);
  return {};
}

bool PhotoRuns::Freeze(const std::string& run) {
  const std::lock_guard lock(freezing_);
  return frozen_.insert(run).second;
}

void PhotoRuns::Release(const std::string& run) {
  const std::lock_guard lock(freezing_);
  frozen_.erase(run);
}

Result<json> PhotoRuns::Measure(const std::string& run, const std::string& pattern,
                                const std::string& filament, const std::stop_token& stop) {
  const fs::path folder = TRY(FolderOf(run));
  const fs::path photo = PhotoIn(folder);
  if (photo.empty()) return Fail(fmt::format("{} has no photo", run));
  const auto turn = TRY(queue_.Wait());
  const fs::path fresh = folder / "new";
  std::error_code ignored;
  fs::remove_all(fresh, ignored);
  fs::create_directory(fresh, ignored);
  std::vector<std::string> words = {options_.program, "--quiet", "pa", "photo", photo.string()};
  words.push_back("--result=" + (fresh / files::kResultFile).string());
  words.push_back("--report=" + (fresh / kReport).string());
  words.push_back("--figures=" + (fresh / service::kFiguresFolder).string());
  if (const fs::path gcode = GcodeIn(folder); !gcode.empty()) {
    words.push_back("--gcode=" + gcode.string());
  } else if (!pattern.empty() && pattern != kOwnPattern) {
    words.push_back("--pattern=" + pattern);
  }
  if (!filament.empty()) words.push_back("--filament=" + filament);
  const auto end = TRY(RunMeasuring(words, options_.log, stop));
  const auto outcome = files::ReadOutcome(fresh / files::kResultFile);
  if (outcome) {
    // Its value may have been used meanwhile: whatever is set is what was shown.
    const std::lock_guard freezing(freezing_);
    if (frozen_.contains(run)) {
      fs::remove_all(fresh, ignored);
      return Fail("the photo's value was used: send the photo once more");
    }
    fs::remove_all(folder / service::kFiguresFolder, ignored);
    fs::remove(folder / kReport, ignored);
    for (const std::string_view name : {std::string_view(service::kFiguresFolder),
                                        std::string_view(kReport), files::kResultFile}) {
      fs::rename(fresh / name, folder / name, ignored);
    }
    fs::remove_all(fresh, ignored);
    json answer = Described(run, folder, *outcome);
    for (const std::string& error : end.errors) answer["notices"].push_back(error);
    return answer;
  }
  fs::remove_all(fresh, ignored);
  return Fail(end.Why(), ErrorKind::kMeasurement);
}

}  // namespace trammel::panel
