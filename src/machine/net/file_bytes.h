// A file in memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

/// A regular file, opened for reading: never a device, a pipe or a folder.
class OpenFile {
 public:
  /// Follows links. Errors (kInput): there is none, it may not be read, it is no regular file. The
  /// messages do not name it.
  [[nodiscard]] static Result<OpenFile> Open(const std::filesystem::path& path);
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&&) = delete;
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile();

  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] std::int64_t size() const { return size_; }  ///< when it was opened

 private:
  explicit OpenFile(int fd) : fd_(fd) {}
  int fd_ = -1;
  std::int64_t size_ = 0;
};

/// Errors (kInput): it is no regular file, cannot be read, or has more than `most_bytes`. The
/// messages do not name it.
[[nodiscard]] Result<std::vector<std::uint8_t>> ReadFileBytes(const std::filesystem::path& path,
                                                              std::int64_t most_bytes);

/// The first bytes of a file, up to `most`; fewer where it has fewer. Errors as above.
[[nodiscard]] Result<std::vector<std::uint8_t>> ReadFileStart(const std::filesystem::path& path,
                                                              std::size_t most);

}  // namespace trammel::machine
