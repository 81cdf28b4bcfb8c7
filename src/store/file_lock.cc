#include "store/file_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace trammel::store {
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

}  // namespace

Result<FileLock> FileLock::Take(const std::filesystem::path& path, std::string_view holder) {
  const int descriptor =
      ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600);
  if (descriptor < 0) {
    return Fail(
        fmt::format("{}: the lock cannot be made: {}", path.string(), std::strerror(errno)));
  }
  FileLock lock(descriptor);
  int taken = 0;
  do {
    taken = ::flock(descriptor, LOCK_EX | LOCK_NB);
  } while (taken != 0 && errno == EINTR);
  if (taken != 0) {
    return Fail(fmt::format("{} holds {}", HolderOf(descriptor), path.string()),
                ErrorKind::kMachine);
  }
  // For messages only: a disk that is full does not make the lock any weaker.
  const std::string_view noted = holder.substr(0, kMostHolder);
  if (::ftruncate(descriptor, 0) == 0) {
    (void)!::pwrite(descriptor, noted.data(), noted.size(), 0);
  }
  return lock;
}

FileLock::FileLock(FileLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FileLock::~FileLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace trammel::store
