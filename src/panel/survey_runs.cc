#include "panel/survey_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "base/bounded_json.h"
#include "base/json_text.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "machine/net/json_field.h"
#include "panel/measuring.h"
#include "panel/run_files.h"
#include "service/job_process.h"
#include "service/job_record.h"

namespace trammel::panel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kBars = "bars.json";
constexpr const char* kObservations = "observations.json";
constexpr std::string_view kPicture = "photo-";  // and its number
constexpr std::size_t kDigits = 3;
constexpr int kMaxPictures = 200;
constexpr std::size_t kMaxBars = 20;
constexpr double kMaxLength_mm = 1e5;
constexpr double kMaxSigmaShare = 1.0 / 200;  // as align survey wants it
constexpr std::size_t kMaxBytes = 16 << 20;
constexpr std::pair<std::string_view, std::string_view> kEndings[] = {
    {"image/jpeg", ".jpg"}, {"image/png", ".png"}, {"image/tiff", ".tif"}};

Result<fs::path> FolderOf(const fs::path& recordings, const std::string& run) {
  if (run.starts_with(service::kSurvey)) return service::FolderOfRun(recordings, run);
  return Fail(fmt::format("there is no survey '{}'", run.substr(0, 64)));
}

// Returns the number of a picture, 1 of "photo-001.jpg"; 0: it is none.
int NumberOf(std::string_view name) {
  if (!name.starts_with(kPicture) || name.size() <= kPicture.size() + kDigits) return 0;
  const char* const begin = name.data() + kPicture.size();
  int number = 0;
  const auto [end, error] = std::from_chars(begin, begin + kDigits, number);
  return error == std::errc() && end == begin + kDigits ? number : 0;
}

// Returns the pictures of a folder in the order of their upload.
std::vector<std::string> PicturesIn(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator file(folder, error), end; !error && file != end;
       file.increment(error)) {
    std::string name = file->path().filename().string();
    if (NumberOf(name) > 0) names.push_back(std::move(name));
  }
  std::ranges::sort(names);
  return names;
}

// Returns a list in an object; empty where there is none.
const json& ListOf(const json& object, const char* key) {
  static const json kEmpty = json::array();
  const json* const member = machine::Member(object, key);
  return member != nullptr && member->is_array() ? *member : kEmpty;
}

Result<json> ReadJson(const fs::path& path) {
  const auto text = TRY(files::ReadNamedFile(path, kMaxBytes));
  return ParseBoundedJson(text, path.filename().string());
}

// Returns the list in an object of our own file; empty where there is none.
json ListIn(const fs::path& path, const char* key) {
  const auto object = ReadJson(path);
  return object ? ListOf(*object, key) : json::array();
}

std::string NameOf(const json& picture) { return machine::TextOr(picture, "name", ""); }

// Removes a picture and what it shows.
Result<void> RemovePicture(const fs::path& folder, const std::string& name) {
  std::error_code error;
  const bool removed = NumberOf(name) > 0 && fs::remove(folder / name, error);
  auto observed = ReadJson(folder / kObservations);
  const json before = observed ? ListOf(*observed, "pictures") : json::array();
  json left = json::array();
  for (const json& picture : before) {
    if (NameOf(picture) != name) left.push_back(picture);
  }
  if (!removed && left.size() == before.size()) {
    return Fail(fmt::format("the survey has no picture '{}'", name));
  }
  if (left.empty()) {
    fs::remove(folder / kObservations, error);
    return {};
  }
  (*observed)["pictures"] = std::move(left);
  return files::WriteWholeFile(folder / kObservations, JsonText(*observed),
                               files::IfThere::kReplace);
}

// Checks what the command would refuse only by the name of a file.
Result<void> CheckBars(const json& bars) {
  const auto good = [](const json& bar) {
    const double length_mm = machine::NumberOr(bar, "length_mm", 0);
    const double sigma_mm = machine::NumberOr(bar, "sigma_mm", 0);
    return !machine::TextOr(bar, "from", "").empty() && !machine::TextOr(bar, "to", "").empty() &&
           length_mm > 0 && length_mm <= kMaxLength_mm && sigma_mm > 0 &&
           sigma_mm <= kMaxSigmaShare * length_mm;
  };
  if (bars.is_array() && bars.size() <= kMaxBars && std::ranges::all_of(bars, good)) return {};
  return Fail(
      fmt::format("'bars' must be a list of at most {} bars, each with the codes 'from' and 'to', "
                  "'length_mm' up to {:g}, and 'sigma_mm' above 0 and up to 1/200 of it",
                  kMaxBars, kMaxLength_mm));
}

// Counts the pictures that show each target.
std::map<std::string, int> SightsOf(const json& pictures) {
  std::map<std::string, int> sights;
  for (const json& picture : pictures) {
    for (const json& seen : ListOf(picture, "observations")) {
      ++sights[machine::TextOr(seen, "target", "")];
    }
  }
  return sights;
}

// Returns the pictures with the number of their targets, and why one is not used.
json PicturesOf(const json& observed, const json& solved) {
  json pictures = json::array();
  for (const json& picture : observed) {
    pictures.push_back({{"picture", NameOf(picture)},
                        {"targets", ListOf(picture, "observations").size()},
                        {"reason", nullptr}});
  }
  for (const json& station : ListOf(solved, "stations")) {
    if (machine::BoolOr(station, "used", true)) continue;
    for (json& picture : pictures) {
      if (picture["picture"] == machine::TextOr(station, "picture", "")) {
        picture["reason"] = machine::TextOr(station, "reason", "");
      }
    }
  }
  return pictures;
}

json TargetsOf(const json& observed, const json& solved) {
  std::map<std::string, json> precision;
  for (const json& each : ListOf(solved, "precision")) {
    precision[machine::TextOr(each, "id", "")] = ListOf(each, "standard_uncertainty_mm");
  }
  json targets = json::array();
  for (const auto& [target, count] : SightsOf(observed)) {
    const auto found = precision.find(target);
    targets.push_back(
        {{"target", target},
         {"pictures", count},
         {"standard_uncertainty_mm", found == precision.end() ? json() : found->second}});
  }
  return targets;
}

}  // namespace

Result<std::string> SurveyRuns::Add(const std::string& run, std::string_view content_type,
                                    std::string_view bytes) {
  const auto type = std::ranges::find(kEndings, content_type,
                                      &std::pair<std::string_view, std::string_view>::first);
  if (type == std::end(kEndings)) {
    return Fail(
        fmt::format("'{}' is no picture of a survey: send JPEG, PNG or TIFF", content_type));
  }
  if (bytes.empty()) return Fail("the picture is empty: send it again");
  const std::lock_guard lock(naming_);
  std::string name = run;
  if (run.empty()) {
    name = TRY(service::MakeRunFolder(options_.recordings, options_.utc_now(), service::kSurvey));
  } else {
    service::RemoveOldCopies(options_.recordings);
  }
  const fs::path folder = TRY(FolderOf(options_.recordings, name));
  // Pictures that were removed to make room leave their observations.
  std::vector<std::string> there = PicturesIn(folder);
  for (const json& picture : ListIn(folder / kObservations, "pictures")) {
    there.push_back(NameOf(picture));
  }
  int last = 0;
  for (const std::string& each : there) last = std::max(last, NumberOf(each));
  if (last >= kMaxPictures) {
    return Fail(fmt::format("a survey takes {} pictures: begin another one", kMaxPictures));
  }
  const std::string picture = fmt::format("{}{:0{}}{}", kPicture, last + 1, kDigits, type->second);
  TRY(files::WriteWholeFile(folder / picture, bytes, files::IfThere::kRefuse));
  return name;
}

Result<json> SurveyRuns::Measure(const std::string& run, const json& bars,
                                 const std::string& without, const std::stop_token& stop) {
  const fs::path folder = TRY(FolderOf(options_.recordings, run));
  const auto turn = TRY(queue_.Wait());
  if (!bars.is_null()) {
    TRY(CheckBars(bars));
    TRY(files::WriteWholeFile(folder / kBars, JsonText(json{{"format", 1}, {"scale_bars", bars}}),
                              files::IfThere::kReplace));
  }
  if (!without.empty()) TRY(RemovePicture(folder, without));
  std::set<std::string> known;
  for (const json& picture : ListIn(folder / kObservations, "pictures")) {
    known.insert(NameOf(picture));
  }
  std::vector<std::string> words = {options_.program, "--quiet", "align",
                                    "survey",         "--json",  "--force"};
  std::vector<std::string> pictures = PicturesIn(folder);
  std::erase_if(pictures, [&known](const auto& picture) { return known.contains(picture); });
  if (pictures.empty() && known.empty()) {
    return Fail("the survey has no picture yet", ErrorKind::kMeasurement);
  }
  for (const std::string& picture : pictures) words.push_back((folder / picture).string());
  const auto option = [&](const char* name, const char* file) {
    words.push_back(fmt::format("{}={}", name, (folder / file).string()));
  };
  std::error_code ignored;
  if (!known.empty()) option("--observations", kObservations);
  option("--keep-observations", kObservations);
  if (!ListIn(folder / kBars, "scale_bars").empty()) option("--scale-bars", kBars);
  // Files of an answer that no longer holds must not stay.
  for (const char* file : {kSurveyTargets, kSurveyPoints, kReport})
    fs::remove(folder / file, ignored);
  option("--out", kSurveyTargets);
  option("--points", kSurveyPoints);
  option("--report", ".");
  const auto end = TRY(RunMeasuring(words, options_.log, stop));
  const auto solved = ParseBoundedJson(end.output, "the survey");
  if (!solved || !solved->is_object()) {
    for (const std::string& picture : pictures) {
      const bool named = end.Why().find(picture) != std::string::npos;
      if (named) fs::remove(folder / picture, ignored);
    }
    return Fail(end.Why(), ErrorKind::kMeasurement);
  }
  const json observed = ListIn(folder / kObservations, "pictures");
  json answer = {{"run", run},
                 {"bars", ListIn(folder / kBars, "scale_bars")},
                 {"pictures", PicturesOf(observed, *solved)},
                 {"targets", TargetsOf(observed, *solved)}};
  for (const char* key : {"verdict", "reason", "unchecked", "advice", "notices"}) {
    const json* const member = machine::Member(*solved, key);
    answer[key] = member != nullptr ? *member : json();
  }
  answer["files"] = json::array();
  for (const char* file : {kReport, kSurveyPoints, kSurveyTargets}) {
    if (fs::exists(folder / file, ignored)) answer["files"].push_back(file);
  }
  return answer;
}

}  // namespace trammel::panel
