#include "pressure_advance/files/unplaced_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>

#include "files/json_object.h"
#include "files/whole_file.h"

namespace trammel::files {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxBytes = std::size_t{256} << 20;

// Frames of a video by the lines of its times; 0 where there are none to be read.
std::size_t FramesOf(const std::filesystem::path& video) {
  const auto text = ReadNamedFile(video.string() + ".times", kMaxBytes);
  if (!text) return 0;
  std::size_t frames = 0;
  for (std::size_t begin = 0; begin < text->size();) {
    const std::size_t end = text->find('\n', begin);
    if (end == std::string::npos) break;
    const char first = (*text)[begin];
    frames += first >= '0' && first <= '9';
    begin = end + 1;
  }
  return frames;
}

// The reason that the scan wrote beside the last sweep that it could not place.
std::string Reason(const json& root) {
  const auto list = root.find("not_placed");
  if (list == root.end() || !list->is_array() || list->empty()) return {};
  const json& last = list->back();
  const auto text = [&](const char* key) {
    const auto found = last.is_object() ? last.find(key) : last.end();
    return last.is_object() && found != last.end() && found->is_string() ? found->get<std::string>()
                                                                         : std::string();
  };
  return text("why").empty() ? "" : text("video") + ": " + text("why");
}

}  // namespace

std::optional<Error> UnplacedRecording(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "sweeps.json";
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  const auto text = ReadNamedFile(file, kMaxBytes);
  if (!text) return text.error();
  const auto root = ParseJson(*text, file.string());
  if (!root) return root.error();
  const auto sweeps = root->is_object() ? root->find("sweeps") : root->end();
  if (!root->is_object() || sweeps == root->end() || !sweeps->is_array()) {
    return Error{ErrorKind::kInput, file.string() + ": has no list of sweeps"};
  }
  const std::size_t frames = FramesOf(folder / "line0.avi");
  if (sweeps->empty()) {
    return Error{
        ErrorKind::kMeasurement,
        fmt::format(
            "'{}' holds a scan that ended in its first sweep: {}, and the motion of "
            "no line, without which no frame has a place. Nothing can be measured "
            "from it; scan the pattern again",
            folder.string(),
            frames == 0 ? std::string("no frame") : fmt::format("{} frames in line0.avi", frames))};
  }
  const std::string why = Reason(*root);
  return Error{
      ErrorKind::kMeasurement,
      fmt::format("'{}' holds {} sweeps whose frames could not be tied to the motion{}{}. "
                  "Videos, times and motion (sweeps.json) are kept; scan the pattern again",
                  folder.string(), sweeps->size(), why.empty() ? "" : ": ", why)};
}

}  // namespace trammel::files
