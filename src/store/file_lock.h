// A lock on a file: ends with the process that holds it, whatever becomes of that.
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace trammel::store {

/// Holds an exclusive lock (flock) as long as it lives. The file stays.
class FileLock {
 public:
  /// Makes the file where it is missing, takes the lock and notes `holder` in the file, for those
  /// that are refused. Follows no link. Waits for nothing.
  /// Errors: kMachine where somebody holds it, with what is noted; kInput where it cannot be made.
  [[nodiscard]] static Result<FileLock> Take(const std::filesystem::path& path,
                                             std::string_view holder);

  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  explicit FileLock(int descriptor) : descriptor_(descriptor) {}

  int descriptor_ = -1;
};

}  // namespace trammel::store
