#include "service/job_process.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <functional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/utf8.h"
#include "measurement/remark.h"
#include "service/job_record.h"
#include "session/screen.h"

namespace trammel::service {
namespace {

constexpr std::string_view kErrorBegins = "trammel: ";
constexpr std::size_t kMaxLines = 50;
constexpr std::size_t kLongestLine = 1024;
constexpr int kInterrupted = 130;  // CONVENTIONS.md

void Add(std::string line, std::vector<std::string>& lines) {
  if (lines.size() == kMaxLines) lines.erase(lines.begin());
  lines.push_back(std::move(line));
}

}  // namespace

JobEnd JobProcess::Run(const std::vector<std::string>& words, const ProgressCallback& tell,
                       const Log& log) {
  JobEnd end;
  // An update that failed halfway removes the program, while the service continues.
  if (access(words.front().c_str(), X_OK) != 0) {
    end.errors = {fmt::format("{} is gone or cannot be run: unpack trammel's archive there anew",
                              words.front())};
    log("trammel: " + end.errors.front());
    return end;
  }
  auto process = machine::CommandProcess::Start(words);
  if (!process) {
    end.errors = {process.error().message};
    return end;
  }
  {
    const std::lock_guard lock(mutex_);
    process_ = process->get();
    if (stopped_) process_->AskToEnd();
  }
  const machine::CommandEnd ended =
      (*process)->Follow([&](machine::OutputStream stream, std::string_view line) {
        const bool answer = stream == machine::OutputStream::kOutput;
        if (const auto progress = answer ? std::nullopt : procedure::ParseProgressLine(line)) {
          return tell(*progress);
        }
        std::string text = Utf8OrReplaced(line, kLongestLine);
        log(text);
        if (answer) {
          Add(std::move(text), end.output);
        } else if (text.starts_with(kErrorBegins)) {
          Add(text.substr(kErrorBegins.size()), end.errors);
        }
      });
  {
    const std::lock_guard lock(mutex_);
    process_ = nullptr;
    // SIGTERM ends a command only before it can catch signals, or after.
    end.stopped = ended.exit_code == kInterrupted || (stopped_ && ended.signal == SIGTERM);
  }
  end.exit_code = ended.exit_code;
  end.killed = ended.signal != 0;
  if (end.killed) end.errors.push_back(fmt::format("its process ended by {}", ended.Describe()));
  return end;
}

void JobProcess::Stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  if (process_ != nullptr) process_->AskToEnd();
}

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

// Calls `visit` with the folder of each run, and the time in its name.
void ForEachRun(const fs::path& recordings,
                const std::function<void(const fs::path& folder, const std::string& time)>& visit) {
  std::error_code error;
  for (fs::directory_iterator folder(recordings, error), end; !error && folder != end;
       folder.increment(error)) {
    std::error_code gone;
    const std::string time = TimeOfRun(folder->path().filename().string());
    if (!time.empty() && fs::is_directory(folder->symlink_status(gone))) {
      visit(folder->path(), time);
    }
  }
}

bool IsOfPages(std::string_view name) {
  return name.starts_with(kUpload) || name.starts_with(kSurvey);
}

}  // namespace

void RemoveOldCopies(const fs::path& recordings, const RunBudget& budget) {
  std::vector<Copy> kept;
  std::uintmax_t bytes = 0;
  ForEachRun(recordings, [&](const fs::path& folder, const std::string& time) {
    if (files::ReadRemark(folder).pinned) return;
    std::error_code gone;
    for (fs::directory_iterator file(folder, gone), end; !gone && file != end;
         file.increment(gone)) {
      std::error_code lost;
      const bool regular = fs::is_regular_file(file->symlink_status(lost));
      if (!regular || !IsCopy(file->path())) continue;
      const std::uintmax_t size = file->file_size(lost);
      if (lost) continue;
      kept.push_back({time, file->path(), size});
      bytes += size;
    }
  });
  std::ranges::sort(kept, {}, [](const Copy& copy) { return std::pair{copy.time, copy.file}; });
  for (const Copy& copy : kept) {
    if (bytes <= budget.max_copied_bytes) break;
    std::error_code ignored;
    fs::remove(copy.file, ignored);
    bytes -= copy.bytes;
  }
}

Result<void> MakeRoomForRun(const fs::path& recordings, const std::string& utc_now,
                            std::string_view kind, const RunBudget& budget) {
  constexpr std::size_t kDay = std::string_view("20260102").size();
  const std::string today = CompactUtc(utc_now).substr(0, kDay);
  std::size_t runs = 0;
  ForEachRun(recordings, [&](const fs::path& folder, const std::string& time) {
    const bool same = IsOfPages(folder.filename().string()) == IsOfPages(kind);
    runs += same && time.starts_with(today) ? 1 : 0;
  });
  if (runs >= (IsOfPages(kind) ? budget.max_uploads_a_day : budget.max_runs_a_day)) {
    return Fail(fmt::format("{} runs were begun today, and no more are taken of clients: go on "
                            "tomorrow, or on the command line",
                            runs),
                ErrorKind::kMeasurement);
  }
  RemoveOldCopies(recordings, budget);
  return {};
}

Result<std::string> MakeRunFolder(const fs::path& recordings, const std::string& utc_now,
                                  std::string_view kind) {
  TRY(MakeRoomForRun(recordings, utc_now, kind));
  const std::string name = fmt::format("{}-{}", kind, CompactUtc(utc_now));
  std::string run = name;
  std::error_code error;
  for (int number = 2; fs::exists(recordings / run, error); ++number) {
    run = fmt::format("{}-{}", name, number);
  }
  fs::create_directories(recordings / run, error);
  if (!error) return run;
  return Fail(fmt::format("cannot make {}: {}", (recordings / run).string(), error.message()));
}

FoldersInUse::Hold FoldersInUse::Use(const fs::path& folder) {
  const std::lock_guard lock(mutex_);
  int& users = users_[folder];
  if (users < 0) return {};
  ++users;
  return Hold(this, [this, folder](void*) {
    const std::lock_guard freed(mutex_);
    if (--users_[folder] == 0) users_.erase(folder);
  });
}

FoldersInUse::Hold FoldersInUse::Delete(const fs::path& folder) {
  const std::lock_guard lock(mutex_);
  if (users_.contains(folder)) return {};
  users_[folder] = -1;
  return Hold(this, [this, folder](void*) {
    const std::lock_guard freed(mutex_);
    users_.erase(folder);
  });
}

}  // namespace trammel::service
