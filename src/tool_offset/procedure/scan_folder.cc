#include "tool_offset/procedure/scan_folder.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

namespace trammel::procedure {
namespace {

namespace fs = std::filesystem;

bool IsUnfinishedName(const std::string& name) {
  constexpr std::array<std::string_view, 6> kEndings = {".part",     ".tmp",      ".crdownload",
                                                        ".filepart", ".download", "~"};
  return name.empty() || name.front() == '.' ||
         std::any_of(kEndings.begin(), kEndings.end(),
                     [&](std::string_view ending) { return name.ends_with(ending); });
}

/// Of an ordinary file.
std::optional<struct stat> StatOf(const fs::path& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return std::nullopt;
  return found;
}

}  // namespace

ScanFolder::ScanFolder(fs::path folder, std::int64_t since_s)
    : folder_(std::move(folder)), since_s_(since_s) {}

ScanFolder::Look ScanFolder::Next() {
  Look look;
  std::vector<std::pair<std::int64_t, fs::path>> ready;
  std::map<fs::path, Known> now;
  std::error_code error;
  for (fs::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    if (now.size() >= kMostFiles) break;
    const fs::path path = at->path();
    if (IsUnfinishedName(path.filename().string())) continue;
    const auto found = StatOf(path);
    if (!found) continue;
    constexpr std::int64_t kNanoseconds = 1'000'000'000;
    const Mark mark{static_cast<std::uintmax_t>(found->st_size),
                    found->st_mtim.tv_sec * kNanoseconds + found->st_mtim.tv_nsec};
    const auto before = known_.find(path);
    Known known{mark};
    if (before == known_.end()) {
      known.told = first_ && found->st_mtim.tv_sec < since_s_;
    } else if (before->second.mark != mark || mark.bytes == 0) {
      known.growing = true;
      if (!before->second.growing) look.growing.push_back(path);
    } else {
      known = before->second;
      if (!known.told) ready.emplace_back(mark.modified_ns, path);
      known.told = true;
      known.growing = false;
    }
    now[path] = known;
  }
  known_ = std::move(now);
  first_ = false;
  std::sort(ready.begin(), ready.end());
  for (auto& [time, path] : ready) look.ready.push_back(std::move(path));
  return look;
}

}  // namespace trammel::procedure
