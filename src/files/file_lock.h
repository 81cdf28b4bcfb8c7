// A lock on a file: ends with the process that holds it, whatever becomes of that.
#pragma once

#include <filesystem>
#include <stop_token>
#include <string_view>
#include <utility>

#include "base/result.h"

namespace trammel::files {

/// Holds an exclusive lock (flock) as long as it lives. The file goes with it; one that a killed
/// process left is as good as none.
class FileLock {
 public:
  /// Makes the file where it is missing, takes the lock and notes `holder` in the file, for those
  /// that are refused. Follows no link. Waits for nothing.
  /// Errors: kMachine where somebody holds it, with what is noted; kInput where it cannot be made,
  /// or another user than root and the folder's owner made it.
  [[nodiscard]] static Result<FileLock> Take(const std::filesystem::path& path,
                                             std::string_view holder);

  /// The same, and waits up to `wait_s` for whoever holds it. Errors: kInterrupted where it was
  /// stopped meanwhile, too.
  [[nodiscard]] static Result<FileLock> TakeWithin(const std::filesystem::path& path,
                                                   std::string_view holder, double wait_s,
                                                   const std::stop_token& stop = {});

  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;
  ~FileLock();

 private:
  FileLock(std::filesystem::path path, int descriptor)
      : path_(std::move(path)), descriptor_(descriptor) {}

  std::filesystem::path path_;
  int descriptor_ = -1;  // -1: does not hold it
};

}  // namespace trammel::files
