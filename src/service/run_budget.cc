#include "service/run_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "service/result_picture.h"
#include "service/run_record.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;

// "20260102T030405Z" and what stands behind it in a run's name; empty: it is no run's.
std::string TimeOfRun(const std::string& name) {
  return IsResultPicture(name + ".png") ? name.substr(name.find('-') + 1) : "";
}

bool IsCopy(const fs::path& file) {
  static constexpr std::array<std::string_view, 2> kStems = {"photo", "scan"};
  const std::string stem = file.stem().string();
  return std::ranges::any_of(kStems, [&stem](std::string_view copy) {
    return stem.starts_with(copy) &&
           stem.find_first_not_of("-0123456789", copy.size()) == std::string::npos;
  });
}

struct Copy {
  std::string time;
  fs::path file;
  std::uintmax_t bytes = 0;
};

}  // namespace

Result<void> MakeRoomForRun(const fs::path& recordings, const std::string& utc_now,
                            const RunBudget& budget) {
  constexpr std::size_t kDay = std::string_view("20260102").size();
  const std::string today = CompactUtc(utc_now).substr(0, kDay);
  std::size_t runs = 0;
  std::vector<Copy> kept;
  std::uintmax_t bytes = 0;
  std::error_code error;
  for (fs::directory_iterator folder(recordings, error), end; !error && folder != end;
       folder.increment(error)) {
    std::error_code gone;
    const std::string time = TimeOfRun(folder->path().filename().string());
    if (time.empty() || !fs::is_directory(folder->symlink_status(gone))) continue;
    runs += time.starts_with(today) ? 1 : 0;
    for (fs::directory_iterator file(folder->path(), gone); !gone && file != end;
         file.increment(gone)) {
      std::error_code lost;
      const bool regular = fs::is_regular_file(file->symlink_status(lost));
      if (!regular || !IsCopy(file->path())) continue;
      const std::uintmax_t size = file->file_size(lost);
      if (lost) continue;
      kept.push_back({time, file->path(), size});
      bytes += size;
    }
  }
  if (runs >= budget.most_runs_a_day) {
    return Fail(fmt::format("{} runs were begun today, and no more are taken of clients: go on "
                            "tomorrow, or on the command line",
                            runs),
                ErrorKind::kMeasurement);
  }
  std::ranges::sort(kept, {}, [](const Copy& copy) { return std::pair{copy.time, copy.file}; });
  for (const Copy& copy : kept) {
    if (bytes <= budget.most_copied_bytes) break;
    std::error_code ignored;
    fs::remove(copy.file, ignored);
    bytes -= copy.bytes;
  }
  return {};
}

}  // namespace trammel::service
