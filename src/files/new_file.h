// Files written completely or not at all, and locks between processes.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.h"

namespace trammel::files {

/// Handling of an existing file of the same name.
enum class IfThere {
  kRefuse,   ///< nobody's file is overwritten unasked
  kReplace,  ///< asked for (--force), or our own file that grows
};

/// Read permission for others than the file's owner.
enum class Readable {
  kByUmask,  ///< according to the umask
  kByOwner,  ///< nobody: it holds a secret
};

[[nodiscard]] inline IfThere ReplaceIf(bool force) {
  return force ? IfThere::kReplace : IfThere::kRefuse;
}

/// Returns why the system cannot write a file, by its error number, and the remedy.
[[nodiscard]] tl::unexpected<Error> CannotWrite(const std::filesystem::path& path, int error);

/// Returns an error if the path cannot become a file: a file exists and must not be replaced, or
/// the name is a folder, device, pipe, socket or link, which is never written to. Names the remedy
/// `or_else`.
[[nodiscard]] Result<void> CheckTarget(const std::filesystem::path& path, IfThere if_there,
                                       std::string_view or_else = {});

/// File being written. It has an unguessable name in the target's folder, so that no prepared link
/// is followed, and is renamed to the target at the end. Without that end it is removed.
class NewFile {
 public:
  /// Does not create folders. Errors: as CheckTarget, and any system error.
  [[nodiscard]] static Result<NewFile> Create(const std::filesystem::path& path, IfThere if_there,
                                              Readable readable = Readable::kByUmask);
  NewFile(NewFile&& other) noexcept;
  NewFile& operator=(NewFile&&) = delete;
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  ~NewFile();

  /// Open for reading and writing.
  [[nodiscard]] int fd() const { return file_; }
  /// Path until it is renamed.
  [[nodiscard]] std::filesystem::path temporary_path() const;

  [[nodiscard]] Result<void> Write(std::string_view bytes) const;
  /// Syncs the file to disk and renames it. Called once, at the end.
  [[nodiscard]] Result<void> Commit();

 private:
  NewFile(std::filesystem::path path, IfThere if_there)
      : path_(std::move(path)), if_there_(if_there) {}
  [[nodiscard]] Result<void> Open(Readable readable);
  [[nodiscard]] int TakeName() const;

  std::filesystem::path path_;
  IfThere if_there_;
  std::string temporary_name_;  // empty: nothing to remove
  int folder_ = -1;
  int file_ = -1;
};

/// Appends a line to a file, which is created if missing; `line` has no line feed. First terminates
/// a truncated last line; a line that finds no room is removed again. Uses one system call, so that
/// processes do not interleave lines; synced to disk on return. Errors: as CheckTarget for an
/// existing file, and any system error.
[[nodiscard]] Result<void> AppendLine(const std::filesystem::path& path, std::string_view line);

/// Writes a whole file. Errors (not writable, disk full, exists already) name the path, the
/// system's message and the remedy; no partial file remains.
[[nodiscard]] Result<void> WriteWholeFile(const std::filesystem::path& path, std::string_view bytes,
                                          IfThere if_there, Readable readable = Readable::kByUmask);

// Lock on a file: ends with the process that holds it, however that process ends.

/// Holds an exclusive lock (flock) while it lives, and removes the file at the end. A file left by
/// a killed process does not lock.
class FileLock {
 public:
  /// Creates the file if missing, takes the lock and writes `holder` to the file, for rejected
  /// processes. Follows no link. Does not wait.
  /// Errors: kMachine if another process holds it, with the noted holder; kInput if it cannot be
  /// created, or a user other than root and the folder's owner created it.
  [[nodiscard]] static Result<FileLock> Take(const std::filesystem::path& path,
                                             std::string_view holder);

  /// Does the same, but waits up to `wait_s` for the holder. Errors: kInterrupted if stopped
  /// meanwhile, too.
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
