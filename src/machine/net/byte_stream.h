// A TCP connection, with TLS where asked for, in which every wait has a limit and can be stopped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::machine {

struct ConnectOptions {
  std::string host;  ///< a name or an address
  std::uint16_t port = 0;
  bool tls = false;
  bool verify_certificate = true;
  std::filesystem::path ca_file;  ///< certificates to trust besides the system's; may be empty
  double time_limit_s = 5;        ///< > 0; of look-up, connection and TLS handshake together
};

/// Errors are kMachine (kInterrupted after a stop) and say what failed, without the address.
class ByteStream {
 public:
  [[nodiscard]] static Result<ByteStream> Connect(const ConnectOptions& options,
                                                  const std::stop_token& stop);

  ByteStream(ByteStream&&) noexcept;
  ByteStream& operator=(ByteStream&&) noexcept;
  ~ByteStream();

  /// Writes all of it. @param deadline_s  on HostNow()'s clock.
  [[nodiscard]] Result<void> Write(std::string_view bytes, double deadline_s,
                                   const std::stop_token& stop);

  struct ReadResult {
    std::size_t count = 0;  ///< bytes read; 0 with `timed_out` false: the other side closed
    bool timed_out = false;
  };

  /// Reads what is there, at least one byte. REQUIRES a non-empty buffer.
  [[nodiscard]] Result<ReadResult> Read(std::span<std::uint8_t> buffer, double deadline_s,
                                        const std::stop_token& stop);

 private:
  struct State;
  explicit ByteStream(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace trammel::machine
