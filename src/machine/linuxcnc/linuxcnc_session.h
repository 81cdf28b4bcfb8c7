// The LinuxCNC that runs on this computer, joined beside its own screen (AXIS, QtDragon) through
// its Python module.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "machine/linuxcnc/linuxcnc_link.h"
#include "machine/net/dialogue_process.h"

namespace trammel::machine {

struct LinuxCncSessionOptions {
  /// For which LinuxCNC's module is made.
  std::string python = "/usr/bin/python3";
  double time_limit_s = 5;  ///< > 0; of each answer
};

/// Speaks to a helper in Python (session.py) over its standard input and output: no port, no
/// password, the user's own rights. A move ends with this process, however it ends. Once somebody
/// else has sent LinuxCNC a command (but an override), each request is an error (kSafety) and
/// nothing is sent: the machine is theirs. Messages to the operator are left to the screens.
class LinuxCncSession : public LinuxCncLink {
 public:
  /// Errors (kMachine): no Python, no module, no LinuxCNC of this user.
  [[nodiscard]] static Result<std::unique_ptr<LinuxCncSession>> Join(
      const LinuxCncSessionOptions& options, const std::stop_token& stop);

  [[nodiscard]] Result<LinuxCncState> State(int joints, const std::stop_token& stop) override;
  [[nodiscard]] Result<LinuxCncFacts> Facts(int joints, const std::stop_token& stop) override;
  [[nodiscard]] Result<LinuxCncMotion> Motion(const std::stop_token& stop) override;
  [[nodiscard]] Result<void> TakeMdi(const std::stop_token& stop) override;
  [[nodiscard]] Result<void> Mdi(const std::string& block, const std::stop_token& stop) override;
  [[nodiscard]] Result<void> Move(const std::string& block, const std::stop_token& stop) override;
  [[nodiscard]] Result<std::string> Interpreted(const std::string& text,
                                                const std::stop_token& stop) override;
  /// Complaints stand on the controller's own screen: whoever reads one takes it away from there.
  [[nodiscard]] Result<void> ForgetComplaints(const std::stop_token&) override { return {}; }
  [[nodiscard]] Result<std::optional<std::string>> Complaint(const std::stop_token&) override {
    return std::optional<std::string>();
  }
  [[nodiscard]] Result<void> Abort() override;

 private:
  LinuxCncSession(std::unique_ptr<DialogueProcess> helper, LinuxCncSessionOptions options);

  [[nodiscard]] Result<nlohmann::json> Ask(nlohmann::json request, const std::stop_token& stop);
  [[nodiscard]] Result<void> Do(nlohmann::json request, const std::stop_token& stop);
  [[nodiscard]] static Result<LinuxCncMotion> ParseMotion(const nlohmann::json& answer);
  [[nodiscard]] static Result<LinuxCncState> ParseState(const nlohmann::json& answer, int joints);

  std::unique_ptr<DialogueProcess> helper_;
  LinuxCncSessionOptions options_;
  int asked_ = 0;  ///< numbers the requests, so that a late answer is not taken for a new one
};

}  // namespace trammel::machine
