#include "files/new_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <utility>

namespace trammel::files {
namespace {

namespace fs = std::filesystem;

/// Returns the kind of a file that is not regular; empty for a regular file.
std::string OddKind(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISLNK(mode)) return "a link";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "a device";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return S_ISREG(mode) ? "" : "no ordinary file";
}

tl::unexpected<Error> NotAFile(const fs::path& path, const std::string& odd) {
  return Fail(
      fmt::format("{}: is {}, and only files are written; name another", path.string(), odd));
}

/// Owning file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

tl::unexpected<Error> ThereAlready(const fs::path& path, std::string_view or_else) {
  return Fail(fmt::format("{}: is there already; {}", path.string(),
                          or_else.empty() ? "name another file" : or_else));
}

std::string RandomName(const std::string& name) {
  constexpr std::size_t kMaxOfName = 100;  // whole names are bounded by the file system
  std::uint64_t number = 0;
  if (getrandom(&number, sizeof number, 0) != sizeof number) {
    number = static_cast<std::uint64_t>(getpid());  // O_EXCL holds whatever the name
  }
  return fmt::format(".{}.{:016x}.part", name.substr(0, kMaxOfName), number);
}

// Syncs to disk; some file systems do not support that and return these errors.
bool Synchronised(int fd) {
  return fsync(fd) == 0 || errno == EINVAL || errno == ENOTSUP || errno == EROFS;
}

}  // namespace

tl::unexpected<Error> CannotWrite(const fs::path& path, int error) {
  const char* remedy = "check the folder and its rights";
  if (error == ENOSPC || error == EDQUOT) remedy = "make room on the disk";
  if (error == EFBIG) remedy = "files may not grow as large here: see ulimit -f";
  if (error == EMFILE || error == ENFILE) remedy = "too many files are open: see ulimit -n";
  if (error == ENOENT) remedy = "make the folder first, or check its name";
  return Fail(
      fmt::format("{}: cannot be written: {}; {}", path.string(), std::strerror(error), remedy));
}

Result<void> CheckTarget(const fs::path& path, IfThere if_there, std::string_view or_else) {
  const std::string name = path.filename().string();
  if (name.empty() || name == "." || name == "..") {
    return Fail(fmt::format("{}: is a folder's name; name a file", path.string()));
  }
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) {
    return errno == ENOENT ? Result<void>() : CannotWrite(path, errno);
  }
  const std::string odd = OddKind(status.st_mode);
  if (!odd.empty()) return NotAFile(path, odd);
  return if_there == IfThere::kReplace ? Result<void>() : ThereAlready(path, or_else);
}

Result<NewFile> NewFile::Create(const fs::path& path, IfThere if_there, Readable readable) {
  TRY(CheckTarget(path, if_there));
  NewFile file(path, if_there);
  TRY(file.Open(readable));
  return file;
}

Result<void> NewFile::Open(Readable readable) {
  const fs::path folder = path_.has_parent_path() ? path_.parent_path() : fs::path(".");
  folder_ = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_ < 0) return CannotWrite(path_, errno);
  std::optional<mode_t> rights;  // permissions of the replaced file: a secret stays private
  struct stat status {};
  if (fstatat(folder_, path_.filename().c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0) {
    rights = status.st_mode & 0777U;
  }
  if (readable == Readable::kByOwner) rights = 0600;
  constexpr int kFlags = O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
  constexpr int kTries = 10;
  for (int i = 0; i < kTries && file_ < 0; ++i) {
    temporary_name_ = RandomName(path_.filename().string());
    file_ = openat(folder_, temporary_name_.c_str(), kFlags, rights ? 0600 : 0666);
    if (file_ < 0 && errno != EEXIST) break;
  }
  if (file_ < 0) {
    const int error = errno;
    temporary_name_.clear();
    return CannotWrite(path_, error);
  }
  if (rights && fchmod(file_, *rights) != 0) return CannotWrite(path_, errno);
  return {};
}

NewFile::NewFile(NewFile&& other) noexcept
    : path_(std::move(other.path_)),
      if_there_(other.if_there_),
      temporary_name_(std::exchange(other.temporary_name_, {})),
      folder_(std::exchange(other.folder_, -1)),
      file_(std::exchange(other.file_, -1)) {}

NewFile::~NewFile() {
  if (!temporary_name_.empty()) unlinkat(folder_, temporary_name_.c_str(), 0);
  if (file_ >= 0) close(file_);
  if (folder_ >= 0) close(folder_);
}

fs::path NewFile::temporary_path() const { return path_.parent_path() / temporary_name_; }

Result<void> NewFile::Write(std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t written = write(file_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return CannotWrite(path_, errno);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

// Returns 0, or the system's error number.
int NewFile::TakeName() const {
  const std::string name = path_.filename().string();
  const auto rename_with = [&](unsigned flags) {
    return renameat2(folder_, temporary_name_.c_str(), folder_, name.c_str(), flags) == 0 ? 0
                                                                                          : errno;
  };
  if (if_there_ == IfThere::kReplace) return rename_with(0);
  const int error = rename_with(RENAME_NOREPLACE);
  if (error != EINVAL && error != ENOSYS) return error;
  // Fallback for file systems without the call above. A second link to the file is also rejected.
  if (linkat(folder_, temporary_name_.c_str(), folder_, name.c_str(), 0) == 0) {
    unlinkat(folder_, temporary_name_.c_str(), 0);
    return 0;
  }
  if (errno == EEXIST) return EEXIST;
  struct stat status {};
  if (fstatat(folder_, name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0) return EEXIST;
  return rename_with(0);
}

Result<void> NewFile::Commit() {
  if (!Synchronised(file_)) return CannotWrite(path_, errno);
  // The name may have been taken since.
  TRY(CheckTarget(path_, if_there_));
  if (const int error = TakeName(); error == EEXIST)
    return ThereAlready(path_, {});
  else if (error != 0)
    return CannotWrite(path_, error);
  temporary_name_.clear();
  if (!Synchronised(folder_)) return CannotWrite(path_, errno);
  return {};
}

namespace {

// Removes the part of a line that was written. If another process has appended since, its data and
// the part remain: a truncated line, which the next one ends.
void TakeBack(int file, off_t size, ssize_t written) {
  struct stat status {};
  if (fstat(file, &status) == 0 && status.st_size == size + written) {
    std::ignore = ftruncate(file, size);
  }
}

}  // namespace

Result<void> AppendLine(const fs::path& path, std::string_view line) {
  TRY(CheckTarget(path, IfThere::kReplace));
  constexpr int kFlags = O_RDWR | O_APPEND | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
  const Descriptor file(open(path.c_str(), kFlags, 0666));
  struct stat status {};
  if (file.get() < 0 || fstat(file.get(), &status) != 0) return CannotWrite(path, errno);
  if (const std::string odd = OddKind(status.st_mode); !odd.empty()) return NotAFile(path, odd);
  char last = '\n';
  const bool torn =
      status.st_size > 0 && pread(file.get(), &last, 1, status.st_size - 1) == 1 && last != '\n';
  const std::string bytes = fmt::format("{}{}\n", torn ? "\n" : "", line);
  const ssize_t written = write(file.get(), bytes.data(), bytes.size());
  if (written < 0) return CannotWrite(path, errno);
  if (written != static_cast<ssize_t>(bytes.size())) {
    TakeBack(file.get(), status.st_size, written);
    return CannotWrite(path, ENOSPC);
  }
  return Synchronised(file.get()) ? Result<void>() : CannotWrite(path, errno);
}

Result<void> WriteWholeFile(const fs::path& path, std::string_view bytes, IfThere if_there,
                            Readable readable) {
  auto file = TRY(NewFile::Create(path, if_there, readable));
  TRY(file.Write(bytes));
  return file.Commit();
}

namespace {

constexpr std::size_t kMaxHolder = 200;

// Returns the noted holder without unprintable bytes: another program may have written there.
std::string HolderOf(int descriptor) {
  char noted[kMaxHolder];
  const ssize_t size = ::pread(descriptor, noted, sizeof(noted), 0);
  std::string holder(noted, static_cast<std::size_t>(std::max<ssize_t>(0, size)));
  std::erase_if(holder, [](char c) { return c < ' ' || c > '~'; });
  return holder.empty() ? "another process" : holder;
}

// True if the path still names the open file, which its last holder may have removed.
bool IsAt(const std::filesystem::path& path, int descriptor) {
  struct stat open_file {};
  struct stat named {};
  return ::fstat(descriptor, &open_file) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         open_file.st_dev == named.st_dev && open_file.st_ino == named.st_ino;
}

// Returns the owner if it is neither this user, root nor the folder's owner: in a shared folder
// such as /tmp, others can create the lock first.
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
    // Only for messages: on a full disk the lock is valid without it.
    const std::string_view noted = holder.substr(0, kMaxHolder);
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
