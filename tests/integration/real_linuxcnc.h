// LinuxCNC itself, without a display and without a machine: three axes and C that follow at once.
#pragma once

#include <sys/types.h>

#include <string>

#include "support/temporary_folder.h"

namespace trammel::test {

/// One LinuxCNC with a scripted screen.
class RealLinuxCnc {
 public:
  /// Returns why it cannot run here; empty if it can. Only one LinuxCNC runs on a computer at a
  /// time.
  [[nodiscard]] static std::string WhyNot();

  /// Puts this process, and what it starts from now on, into a network of its own with a loopback;
  /// false where the system does not allow it. REQUIRES that no other thread has been started.
  static bool EnterOwnNetwork();

  /// Starts it and waits until its screen answers; up() is false where it does not.
  RealLinuxCnc();
  /// Ends it and everything that it started.
  ~RealLinuxCnc();
  RealLinuxCnc(const RealLinuxCnc&) = delete;
  RealLinuxCnc& operator=(const RealLinuxCnc&) = delete;

  [[nodiscard]] bool up() const { return up_; }
  /// Asks its screen (linuxcnc_screen.py) to do something, and does not wait for it.
  void AskScreen(const std::string& words) const;
  /// Returns the screen's report on it, in JSON; empty after twenty seconds.
  [[nodiscard]] std::string ScreenText() const;
  /// Returns its output on its terminal.
  [[nodiscard]] std::string log() const;

 private:
  void WriteConfiguration() const;
  [[nodiscard]] bool ScreenIsUp() const;

  TemporaryFolder folder_;
  pid_t pid_ = -1;
  bool up_ = false;
};

}  // namespace trammel::test
