// LinuxCNC itself, without a display and without a machine: three axes and C that follow at once.
#pragma once

#include <sys/types.h>

#include <string>

#include "support/temporary_folder.h"

namespace trammel::test {

/// One LinuxCNC with its shell on port 5007. Where the system lets us it runs in a network of its
/// own, for the shell listens on all addresses.
class RealLinuxCnc {
 public:
  /// Why it cannot run here; empty where it can. Only one LinuxCNC runs on a computer at a time.
  [[nodiscard]] static std::string WhyNot();

  /// Puts this process, and what it starts from now on, into a network of its own with a loopback;
  /// false where the system does not allow it. REQUIRES that no other thread has been started.
  static bool EnterOwnNetwork();

  /// Starts it and waits until its shell answers; up() is false where it does not.
  RealLinuxCnc();
  /// Ends it and everything that it started.
  ~RealLinuxCnc();
  RealLinuxCnc(const RealLinuxCnc&) = delete;
  RealLinuxCnc& operator=(const RealLinuxCnc&) = delete;

  [[nodiscard]] bool up() const { return up_; }
  /// What it wrote to its terminal.
  [[nodiscard]] std::string log() const;

 private:
  void WriteConfiguration() const;

  TemporaryFolder folder_;
  pid_t pid_ = -1;
  bool up_ = false;
};

}  // namespace trammel::test
