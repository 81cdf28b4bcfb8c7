// Files written whole or not at all, and locks between processes.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.h"

namespace trammel::files {

/// What becomes of a file that has the name already.
enum class IfThere {
  kRefuse,   ///< nobody's file is overwritten unasked
  kReplace,  ///< asked for (--force), or our own file that grows
};

/// Who may read what is written, beside its owner.
enum class Readable {
  kByUmask,  ///< as the umask says
  kByOwner,  ///< nobody: it holds a secret
};

[[nodiscard]] inline IfThere ReplaceIf(bool force) {
  return force ? IfThere::kReplace : IfThere::kRefuse;
}

/// Why the system refuses to write a file, by its error number, and what to do.
[[nodiscard]] tl::unexpected<Error> CannotWrite(const std::filesystem::path& path, int error);

/// An error where the path cannot become a file: a file is there and is to stay; a folder, device,
/// pipe, socket or link has the name, which is never written to. Names the remedy `or_else`.
[[nodiscard]] Result<void> CheckTarget(const std::filesystem::path& path, IfThere if_there,
                                       std::string_view or_else = {});

/// A file in the making. It stands in the target's folder under a name that nobody can guess, so
/// that no link laid out beforehand is followed, and takes the target's name at the end. Without
/// that end nothing is left of it.
class NewFile {
 public:
  /// Folders are not made. Errors: as CheckTarget, and whatever the system says.
  [[nodiscard]] static Result<NewFile> Create(const std::filesystem::path& path, IfThere if_there,
                                              Readable readable = Readable::kByUmask);
  NewFile(NewFile&& other) noexcept;
  NewFile& operator=(NewFile&&) = delete;
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  ~NewFile();

  /// Open for reading and writing.
  [[nodiscard]] int fd() const { return file_; }
  /// Where it stands meanwhile.
  [[nodiscard]] std::filesystem::path temporary_path() const;

  [[nodiscard]] Result<void> Write(std::string_view bytes) const;
  /// Brings everything onto the disk and gives it its name. Once, at the end.
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

/// Adds a line to a file that grows, which is made where it is not there; `line` has no line feed.
/// A last line that was cut short is ended first; one that finds no room leaves nothing behind. One
/// call of the system, so that two processes do not write into each other's lines; on the disk when
/// it returns. Errors: as CheckTarget for a file that is there already, and whatever the system
/// says.
[[nodiscard]] Result<void> AppendLine(const std::filesystem::path& path, std::string_view line);

/// Writes a whole file. Errors (not writable, disk full, there already) name the path, what the
/// system said and what to do; then nothing is left behind.
[[nodiscard]] Result<void> WriteWholeFile(const std::filesystem::path& path, std::string_view bytes,
                                          IfThere if_there, Readable readable = Readable::kByUmask);

// A lock on a file: ends with the process that holds it, whatever becomes of that.

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
