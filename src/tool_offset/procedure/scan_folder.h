// Watches a folder into which somebody is about to put a scan.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace trammel::procedure {

/// Looks at the files of a folder, not of those below it. A file counts once it has stayed as it is
/// from one look to the next, and again whenever it has changed. Hidden files, and those that
/// browsers and file managers give other names at the end, do not count.
class ScanFolder {
 public:
  /// @param since_s  seconds since 1970: files that were there already and are older do not count
  ScanFolder(std::filesystem::path folder, std::int64_t since_s);

  struct Look {
    std::vector<std::filesystem::path> ready;    ///< since the last look, the oldest first
    std::vector<std::filesystem::path> growing;  ///< still being written, told once
  };
  /// At most kMostFiles are looked at. A folder that cannot be read has none.
  [[nodiscard]] Look Next();

  static constexpr std::size_t kMostFiles = 2000;

 private:
  /// By what a file is seen to have changed.
  struct Mark {
    std::uintmax_t bytes = 0;
    std::int64_t modified_ns = 0;
    bool operator==(const Mark&) const = default;
  };
  struct Known {
    Mark mark;
    bool told = false;     ///< as ready, or left out
    bool growing = false;  ///< told as such
  };

  std::filesystem::path folder_;
  std::int64_t since_s_ = 0;
  bool first_ = true;
  std::map<std::filesystem::path, Known> known_;
};

}  // namespace trammel::procedure
