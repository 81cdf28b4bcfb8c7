// The line to LinuxCNC's shell server (linuxcncrsh): a request, an answer, each with a limit.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "machine/net/byte_stream.h"

namespace trammel::machine {

struct LinuxCncAddress {
  std::string host = "127.0.0.1";
  std::uint16_t port = 5007;
  std::string connect_password = "EMC";    ///< linuxcncrsh --connectpw
  std::string enable_password = "EMCTOO";  ///< linuxcncrsh --enablepw
  double time_limit_s = 5;                 ///< > 0; of the connection, and of each answer
};

/// One connection. Errors are kMachine (kInterrupted after a stop) and name the request; after one
/// the line is of no more use, for answers would be taken for those of other requests.
class LinuxCncShell {
 public:
  /// Connects, says hello, turns echo off and acknowledgements on, and takes control (`enable`).
  [[nodiscard]] static Result<LinuxCncShell> Connect(const LinuxCncAddress& address,
                                                     const std::stop_token& stop);

  /// `get WHAT`: the answer behind WHAT's name. WHAT must be one that linuxcncrsh survives: without
  /// a number "spindle" and "brake" crash it.
  [[nodiscard]] Result<std::string> Get(const std::string& what, const std::stop_token& stop);

  /// `set WHAT`, acknowledged. A refusal (NAK) is an error, with what the controller says of it.
  [[nodiscard]] Result<void> Set(const std::string& what, const std::stop_token& stop);

 private:
  LinuxCncShell(ByteStream stream, LinuxCncAddress address);

  Result<void> Greet(const std::stop_token& stop);
  Result<void> Send(const std::string& line, const std::stop_token& stop);
  /// The next line that begins with one of the two; others are skipped.
  Result<std::string> Await(const std::string& request, const std::string& head,
                            const std::string& other_head, const std::stop_token& stop);
  /// Absent once the deadline has passed.
  Result<std::optional<std::string>> ReadLine(double deadline_s, const std::stop_token& stop);

  ByteStream stream_;
  LinuxCncAddress address_;
  std::string partial_;
  std::deque<std::string> lines_;
};

}  // namespace trammel::machine
