#include "machine/net/file_bytes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <span>

namespace trammel::machine {
namespace {

/// Reads until `bytes` are full or the file ends; returns the count, or -1.
ssize_t ReadInto(int fd, std::span<std::uint8_t> bytes) {
  std::size_t had = 0;
  while (had < bytes.size()) {
    const ssize_t count = read(fd, bytes.data() + had, bytes.size() - had);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return -1;
    if (count == 0) break;
    had += static_cast<std::size_t>(count);
  }
  return static_cast<ssize_t>(had);
}

}  // namespace

Result<OpenFile> OpenFile::Open(const std::filesystem::path& path) {
  // Opening must not block on a pipe or a device.
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (fd < 0) {
    return Fail(errno == ENOENT ? "there is no such file; check its name"
                                : fmt::format("it cannot be read: {}", std::strerror(errno)));
  }
  OpenFile file(fd);
  struct stat status {};
  if (fstat(fd, &status) != 0) return Fail(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) return Fail("it is a folder, not a regular file");
  if (!S_ISREG(status.st_mode)) return Fail("it is not a regular file");
  file.size_ = status.st_size;
  return file;
}

OpenFile::OpenFile(OpenFile&& other) noexcept : fd_(other.fd_), size_(other.size_) {
  other.fd_ = -1;
}

OpenFile::~OpenFile() {
  if (fd_ >= 0) close(fd_);
}

Result<std::vector<std::uint8_t>> ReadFileBytes(const std::filesystem::path& path,
                                                std::int64_t max_bytes) {
  const auto file = TRY(OpenFile::Open(path));
  if (file.size() > max_bytes) {
    return Fail(
        fmt::format("it has {} bytes, more than the {} that are read", file.size(), max_bytes));
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(file.size()));
  if (ReadInto(file.fd(), bytes) != static_cast<ssize_t>(bytes.size())) {
    return Fail("it cannot be read to its end; check that nothing is writing it");
  }
  return bytes;
}

Result<std::vector<std::uint8_t>> ReadFileStart(const std::filesystem::path& path,
                                                std::size_t most) {
  const auto file = TRY(OpenFile::Open(path));
  std::vector<std::uint8_t> bytes(most);
  const ssize_t count = ReadInto(file.fd(), bytes);
  if (count < 0) return Fail("it cannot be read; check its permissions");
  bytes.resize(static_cast<std::size_t>(count));
  return bytes;
}

}  // namespace trammel::machine
