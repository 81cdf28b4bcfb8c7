// Messages over a Unix socket of this machine: a length of four bytes, then as many.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::sim {

/// Owns a socket's descriptor. Errors of its functions are of kind kMachine and say what the system
/// said; whoever calls them adds with whom it spoke.
class UnixSocket {
 public:
  UnixSocket() = default;
  explicit UnixSocket(int descriptor) : descriptor_(descriptor) {}
  UnixSocket(UnixSocket&& other) noexcept;
  UnixSocket& operator=(UnixSocket&& other) noexcept;
  ~UnixSocket();

  /// A file that is there already is an error (kMachine), but for a socket that nobody listens on
  /// any more, which is replaced; the new one is for this user alone.
  /// Error (kInput): a path of no or of more than 100 bytes.
  [[nodiscard]] static Result<UnixSocket> Listen(const std::filesystem::path& path);
  [[nodiscard]] static Result<UnixSocket> Connect(const std::filesystem::path& path);

  /// Waits for the next client. Error: Shutdown() was called, or the system has no more sockets.
  [[nodiscard]] Result<UnixSocket> Accept() const;

  /// @param limit_s  for the whole message; > 0, may be infinite.
  [[nodiscard]] Result<void> Send(std::string_view message, double limit_s) const;
  /// Takes memory only for what really arrives. Errors: the time is over; the other side has
  /// closed; a message longer than `longest` bytes.
  [[nodiscard]] Result<std::string> Receive(std::size_t longest, double limit_s) const;

  /// Whether the other side has closed, or this one was shut down.
  [[nodiscard]] bool ended() const;
  /// Ends every call that waits, in other threads too; and every later one.
  void Shutdown() const;

 private:
  int descriptor_ = -1;
};

}  // namespace trammel::sim
