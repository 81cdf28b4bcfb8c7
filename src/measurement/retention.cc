#include "measurement/retention.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kSmall_bytes = 64 * 1024;  // not worth its going
constexpr int kDeepest = 2;                         // validation/line0/…
constexpr std::size_t kMostFiles = 100'000;

bool HasStem(const fs::path& file, std::span<const std::string_view> names) {
  const std::string stem = file.stem().string();
  return std::ranges::any_of(names, [&](std::string_view name) {
    return stem.starts_with(name) &&
           stem.find_first_not_of("-_0123456789updownxy", name.size()) == std::string::npos;
  });
}

// Whether a recording wrote the file: by the name that it gives to what it records, videos of lines
// and pictures by their place. A user's own picture may have such a name: it is told by its time,
// which is not that of a recording that ended with the result.
bool IsRaw(const fs::path& file, fs::file_time_type of_result) {
  constexpr std::chrono::hours kLongestRun{24};
  constexpr std::chrono::seconds kClock{2};  // file systems keep times to two seconds
  static constexpr std::array<std::string_view, 1> kVideos = {"line"};
  static constexpr std::array<std::string_view, 11> kPictures = {
      "frame",  "lit",  "laser",  "mark", "middle", "plate",
      "search", "step", "stripe", "view", "still"};
  const std::string extension = file.extension().string();
  if (extension == ".avi") return HasStem(file, kVideos);
  if ((extension != ".jpg" && extension != ".png") || !HasStem(file, kPictures)) return false;
  std::error_code error;
  const fs::file_time_type written = fs::last_write_time(file, error);
  return !error && written <= of_result + kClock && written >= of_result - kLongestRun;
}

struct Recording {
  RawData raw;
  std::uintmax_t bytes = 0;  // with what stays
};

Result<Recording> LookInto(const fs::path& folder, std::string utc) {
  Recording recording;
  recording.raw.folder = folder;
  recording.raw.utc = std::move(utc);
  std::error_code error;
  const fs::file_time_type of_result = fs::last_write_time(folder / kResultFile, error);
  auto entries = fs::recursive_directory_iterator(folder, error);
  for (; !error && entries != fs::end(entries); entries.increment(error)) {
    std::error_code gone;  // between the listing and the look
    const bool another = fs::exists(entries->path() / kResultFile, gone);  // a recording of its own
    if (another || entries.depth() >= kDeepest) entries.disable_recursion_pending();
    if (!fs::is_regular_file(entries->symlink_status(gone)) || gone) continue;
    const std::uintmax_t bytes = entries->file_size(gone);
    if (gone) continue;
    recording.bytes += bytes;
    if (bytes < kSmall_bytes || !IsRaw(entries->path(), of_result)) continue;
    if (recording.raw.files.size() >= kMostFiles) break;
    recording.raw.files.push_back(entries->path());
    recording.raw.bytes += bytes;
  }
  if (error) return Fail(fmt::format("{}: {}", folder.string(), error.message()));
  return recording;
}

}  // namespace

Result<PruningPlan> PlanPruning(const fs::path& recordings, std::uintmax_t budget_bytes,
                                std::size_t keep_last) {
  std::error_code error;
  if (!fs::is_directory(recordings, error)) {
    return Fail(
        fmt::format("{}: is no folder of recordings; name it with --in", recordings.string()));
  }
  PruningPlan plan;
  std::vector<Recording> found;
  for (auto entries = fs::directory_iterator(recordings, error);
       !error && entries != fs::end(entries); entries.increment(error)) {
    std::error_code gone;
    if (!fs::is_directory(entries->symlink_status(gone)) || gone) continue;
    const auto outcome = ReadOutcome(entries->path());
    if (!outcome) {  // at work, broken off, or not ours
      ++plan.without_result;
      continue;
    }
    auto recording = LookInto(entries->path(), outcome->provenance.utc);
    if (!recording) return tl::unexpected(recording.error());
    found.push_back(std::move(*recording));
  }
  if (error) return Fail(fmt::format("{}: {}", recordings.string(), error.message()));
  std::ranges::sort(found, {}, [](const Recording& r) {
    return std::pair{r.raw.utc, r.raw.folder};
  });
  for (const Recording& recording : found) plan.bytes_before += recording.bytes;
  plan.bytes_after = plan.bytes_before;
  const std::size_t old = found.size() - std::min(keep_last, found.size());
  for (std::size_t i = 0; i < old && plan.bytes_after > budget_bytes; ++i) {
    if (found[i].raw.files.empty()) continue;
    plan.bytes_after -= found[i].raw.bytes;
    plan.gone.push_back(std::move(found[i].raw));
  }
  return plan;
}

Result<void> Prune(const PruningPlan& plan) {
  std::string failed;
  for (const RawData& raw : plan.gone) {
    for (const fs::path& file : raw.files) {
      std::error_code error;
      fs::remove(file, error);
      if (error && failed.empty()) failed = fmt::format("{}: {}", file.string(), error.message());
    }
  }
  if (!failed.empty()) return Fail("not all was removed: " + failed);
  return {};
}

}  // namespace trammel::files
