// A file for readers that take a path, without a disk.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace trammel::fuzz {

/// Holds one file in a folder of its own, in memory where the system has such a folder. One for a
/// whole process: writing it again replaces what it held.
class MemoryFile {
 public:
  /// @param name  the file's, with the extension that its reader wants
  explicit MemoryFile(const std::string& name);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// Ends the process where the file cannot be written.
  void Write(std::string_view bytes) const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path folder_;
  std::filesystem::path path_;
};

}  // namespace trammel::fuzz
