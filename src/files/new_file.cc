#include "files/new_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <optional>
#include <tuple>
#include <utility>

namespace trammel::files {
namespace {

namespace fs = std::filesystem;

/// What a name that is not a regular file's stands for; empty for a regular file.
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

/// Closes it in the end.
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
  constexpr std::size_t kMostOfName = 100;  // whole names are bounded by the file system
  std::uint64_t number = 0;
  if (getrandom(&number, sizeof number, 0) != sizeof number) {
    number = static_cast<std::uint64_t>(getpid());  // O_EXCL holds whatever the name
  }
  return fmt::format(".{}.{:016x}.part", name.substr(0, kMostOfName), number);
}

// Some file systems cannot bring what they hold onto a disk, and say so.
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
  std::optional<mode_t> rights;  // of the file that is replaced: a secret stays one
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

// 0, or what went wrong.
int NewFile::TakeName() const {
  const std::string name = path_.filename().string();
  const auto rename_with = [&](unsigned flags) {
    return renameat2(folder_, temporary_name_.c_str(), folder_, name.c_str(), flags) == 0 ? 0
                                                                                          : errno;
  };
  if (if_there_ == IfThere::kReplace) return rename_with(0);
  const int error = rename_with(RENAME_NOREPLACE);
  if (error != EINVAL && error != ENOSYS) return error;
  // Not every file system can do that. A second name for the file is refused likewise.
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
  // Something may have taken the name since.
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

// Removes the part of a line for which there was room. What another process has added since stays,
// and the part with it: a torn line, which the next one ends.
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

}  // namespace trammel::files
