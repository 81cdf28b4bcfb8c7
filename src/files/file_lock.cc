#include "files/file_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <string>
#include <thread>
#include <utility>

namespace trammel::files {
namespace {

constexpr std::size_t kMostHolder = 200;

// Another program may have written into it: what cannot be shown is left out.
std::string HolderOf(int descriptor) {
  char noted[kMostHolder];
  const ssize_t size = ::pread(descriptor, noted, sizeof(noted), 0);
  std::string holder(noted, static_cast<std::size_t>(std::max<ssize_t>(0, size)));
  std::erase_if(holder, [](char c) { return c < ' ' || c > '~'; });
  return holder.empty() ? "another process" : holder;
}

// Whether the path still leads to the open file, which its last holder may have removed.
bool IsAt(const std::filesystem::path& path, int descriptor) {
  struct stat open_file {};
  struct stat named {};
  return ::fstat(descriptor, &open_file) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         open_file.st_dev == named.st_dev && open_file.st_ino == named.st_ino;
}

// The owner, where it is neither this user, root nor whoever the folder belongs to: in a folder
// where everybody may make files, such as /tmp, others can make the lock first.
std::optional<uid_t> ForeignOwner(const std::filesystem::path& path, int descriptor) {
  struct stat lock {};
  struct stat folder {};
  const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
  if (::fstat(descriptor, &lock) != 0 || ::stat(parent.c_str(), &folder) != 0) return {};
  const bool own = lock.st_uid == ::geteuid() || lock.st_uid == 0 || lock.st_uid == folder.st_uid;
  return own ? std::nullopt : std::optional(lock.st_uid);
}

bool Lock(int descriptor) {
  int taken = 0;
  do {
    taken = ::flock(descriptor, LOCK_EX | LOCK_NB);
  } while (taken != 0 && errno == EINTR);
  return taken == 0;
}

}  // namespace

Result<FileLock> FileLock::Take(const std::filesystem::path& path, std::string_view holder) {
  constexpr int kAttempts = 100;  // each lost to a holder that went at that moment
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const int descriptor =
        ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600);
    if (descriptor < 0) {
      return Fail(
          fmt::format("{}: the lock cannot be made: {}", path.string(), std::strerror(errno)));
    }
    if (const auto owner = ForeignOwner(path, descriptor)) {
      ::close(descriptor);
      return Fail(
          fmt::format("{}: the lock belongs to another user ({}), who could keep it: remove it, "
                      "or have its folder to yourself",
                      path.string(), *owner));
    }
    if (!Lock(descriptor)) {
      const std::string other = HolderOf(descriptor);
      ::close(descriptor);
      return Fail(fmt::format("{} holds {}", other, path.string()), ErrorKind::kMachine);
    }
    if (!IsAt(path, descriptor)) {
      ::close(descriptor);
      continue;
    }
    FileLock lock(path, descriptor);
    // For messages only: a disk that is full does not make the lock any weaker.
    const std::string_view noted = holder.substr(0, kMostHolder);
    if (::ftruncate(descriptor, 0) == 0) {
      (void)!::pwrite(descriptor, noted.data(), noted.size(), 0);
    }
    return lock;
  }
  return Fail(fmt::format("{}: others take the lock again and again", path.string()),
              ErrorKind::kMachine);
}

Result<FileLock> FileLock::TakeWithin(const std::filesystem::path& path, std::string_view holder,
                                      double wait_s, const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kAgain{20};
  const auto until = Clock::now() + std::chrono::duration<double>(wait_s);
  for (;;) {
    auto lock = Take(path, holder);
    if (lock || lock.error().kind != ErrorKind::kMachine || Clock::now() >= until) return lock;
    if (stop.stop_requested()) {
      return Fail("stopped while waiting: " + lock.error().message, ErrorKind::kInterrupted);
    }
    std::this_thread::sleep_for(kAgain);
  }
}

FileLock::FileLock(FileLock&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

FileLock::~FileLock() {
  if (descriptor_ < 0) return;
  if (IsAt(path_, descriptor_)) ::unlink(path_.c_str());  // first, while nobody else can have it
  ::close(descriptor_);
}

}  // namespace trammel::files
