#include "service/result_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "service/run_record.h"

namespace trammel::service {
namespace {

using nlohmann::json;

constexpr std::string_view kEnding = ".png";
constexpr std::size_t kMostRemoved = 100;  // at a time

/// When a run began, by the name of its picture; empty where it is none: JOB-TIME[-NUMBER].png.
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
  if (pictures.size() <= kMostPictures) return;
  std::ranges::sort(pictures);
  pictures.resize(std::min(pictures.size() - kMostPictures, kMostRemoved));
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
  if (png.size() > kMostPictureBytes) {
    return Fail(fmt::format("the picture of {} has {} bytes; at most {} are stored", run,
                            png.size(), kMostPictureBytes));
  }
  auto stored =
      printer.UploadConfig(fmt::format("{}/{}{}", kPictureFolder, run, kEnding), png, limit);
  if (stored) RemoveOldest(printer, limit);
  return stored;
}

}  // namespace trammel::service
