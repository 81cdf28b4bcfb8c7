// The trammel that was built, as a process that serves while a test goes on.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

#include "support/temporary_folder.h"

namespace trammel::test {

/// Killed with the object, unless it has ended.
class BackgroundTrammel {
 public:
  /// @param arguments  As typed behind `trammel` into a shell.
  /// @param folder     The current folder of the command; must exist.
  BackgroundTrammel(const std::string& arguments, const std::filesystem::path& folder);
  ~BackgroundTrammel();
  BackgroundTrammel(const BackgroundTrammel&) = delete;
  BackgroundTrammel& operator=(const BackgroundTrammel&) = delete;

  /// What stands behind `label` in the first whole line of its standard output that begins with it;
  /// empty where it ends, or 30 s pass, without such a line.
  [[nodiscard]] std::string WaitForLine(const std::string& label);
  void Signal(int number) const;
  /// Its exit code, -1 where a signal ended it; -2 where it does not end within 30 s.
  [[nodiscard]] int WaitForEnd();
  /// What it has written so far.
  [[nodiscard]] std::string standard_error() const;

 private:
  [[nodiscard]] bool Ended();

  TemporaryFolder aside_;
  pid_t process_ = -1;
  bool ended_ = false;
  int status_ = 0;
};

}  // namespace trammel::test
