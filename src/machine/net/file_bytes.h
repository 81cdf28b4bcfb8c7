// File in memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

/// Regular file, opened for reading: never a device, a pipe or a folder.
class OpenFile {
 public:
  /// Follows links. Errors (kInput), without the file's name: it is missing, not readable, or no
  /// regular file.
  [[nodiscard]] static Result<OpenFile> Open(const std::filesystem::path& path);
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&&) = delete;
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile();

  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] std::int64_t size() const { return size_; }  ///< size at opening

 private:
  explicit OpenFile(int fd) : fd_(fd) {}
  int fd_ = -1;
  std::int64_t size_ = 0;
};

/// Errors (kInput), without the file's name: it is no regular file, cannot be read, or has more
/// than `most_bytes`.
[[nodiscard]] Result<std::vector<std::uint8_t>> ReadFileBytes(const std::filesystem::path& path,
                                                              std::int64_t max_bytes);

/// Returns the first bytes of a file, at most `most`. Errors as above.
[[nodiscard]] Result<std::vector<std::uint8_t>> ReadFileStart(const std::filesystem::path& path,
                                                              std::size_t most);

}  // namespace trammel::machine
