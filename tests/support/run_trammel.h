// Runs the trammel that was built, as a user would.
#pragma once

#include <filesystem>
#include <string>

namespace trammel::test {

struct CommandResult {
  int exit_code = -1;  ///< -1 where it did not end by itself
  std::string output;  ///< standard output and error, as they came
};

/// @param arguments  As typed behind `trammel` into a shell.
/// @param folder     The current folder of the command; must exist.
[[nodiscard]] CommandResult RunTrammel(const std::string& arguments,
                                       const std::filesystem::path& folder);

/// A new empty folder below the system's temporary one, removed with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The whole file; empty where there is none.
[[nodiscard]] std::string ReadWhole(const std::filesystem::path& path);
void WriteWhole(const std::filesystem::path& path, const std::string& text);

}  // namespace trammel::test
