// LinuxCNC through its shell server, which other computers reach, too.
#pragma once

#include <memory>
#include <string>

#include "machine/linuxcnc/linuxcnc_link.h"
#include "machine/linuxcnc/linuxcnc_shell.h"

namespace trammel::machine {

/// A client of linuxcncrsh. Its server does not tell when a block was taken up, nor the feed
/// override; messages to the operator are shared with the screens beside it.
class LinuxCncShellLink : public LinuxCncLink {
 public:
  [[nodiscard]] static Result<std::unique_ptr<LinuxCncShellLink>> Connect(
      const LinuxCncAddress& address, const std::stop_token& stop);

  [[nodiscard]] Result<LinuxCncState> State(int joints, const std::stop_token& stop) override;
  [[nodiscard]] Result<LinuxCncMotion> Motion(const std::stop_token& stop) override;
  [[nodiscard]] Result<void> TakeMdi(const std::stop_token& stop) override;
  [[nodiscard]] Result<void> Mdi(const std::string& block, const std::stop_token& stop) override;
  [[nodiscard]] Result<void> Move(const std::string& block, const std::stop_token& stop) override;
  [[nodiscard]] Result<std::string> Interpreted(const std::string& text,
                                                const std::stop_token& stop) override;
  [[nodiscard]] Result<void> ForgetComplaints(const std::stop_token& stop) override;
  [[nodiscard]] Result<std::optional<std::string>> Complaint(const std::stop_token& stop) override;
  [[nodiscard]] Result<void> Abort() override;

 private:
  LinuxCncShellLink(LinuxCncShell shell, LinuxCncAddress address);

  [[nodiscard]] Result<Eigen::Vector4d> Position(const std::stop_token& stop);

  LinuxCncShell shell_;
  LinuxCncAddress address_;
  int messages_ = 0;  ///< numbers the read-backs, so that an old one is not taken for a new one
};

}  // namespace trammel::machine
