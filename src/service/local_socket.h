// The method table of a desk over a Unix socket of this computer: for the command line, and for
// programs that have no Moonraker.
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>

#include "base/result.h"
#include "machine/moonraker/rpc_calls.h"

namespace trammel::service {

/// Where the socket of a printer's service lies. @param address  plain, as locks are named by it
[[nodiscard]] std::filesystem::path LocalSocketPath(const std::filesystem::path& state_folder,
                                                    std::string_view address);

/// Serves JSON-RPC 2.0, a line each way for each request, to programs of this user (mode 0600) on a
/// thread of its own, until it is destroyed; the file goes with it. At most 16 clients, 64 KiB a
/// request: a further client takes the place of the one that was silent for longest.
class LocalSocket {
 public:
  /// Takes the place of a socket that a killed service left. Errors: kMachine where another service
  /// answers there; kInput where it cannot be made.
  [[nodiscard]] static Result<std::unique_ptr<LocalSocket>> Listen(
      const std::filesystem::path& path, machine::RequestHandler answer);
  LocalSocket(const LocalSocket&) = delete;
  LocalSocket& operator=(const LocalSocket&) = delete;
  ~LocalSocket();

 private:
  LocalSocket(std::filesystem::path path, int listener, machine::RequestHandler answer);
  void Serve(const std::stop_token& stop);

  const std::filesystem::path path_;
  const int listener_;
  const machine::RequestHandler answer_;
  std::jthread thread_;  // last: it uses all the rest
};

/// The answer to one request as a line, without its line feed; empty for a notification.
[[nodiscard]] std::string AnswerLine(std::string_view line, const machine::RequestHandler& answer);

/// Asks a service once. Errors: kMachine where none answers, or with an error of its own.
[[nodiscard]] Result<nlohmann::json> AskLocally(const std::filesystem::path& path,
                                                const std::string& method,
                                                const nlohmann::json& params);

}  // namespace trammel::service
