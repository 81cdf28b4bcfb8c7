// Connection to a server in which every wait has a limit and can be stopped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <string_view>

#include "base/result.h"
#include "machine/net/endpoint.h"

namespace trammel::machine {

/// Errors are kMachine (kInput for an unusable certificate file, kInterrupted after a stop) and
/// name the failed step.
class ByteStream {
 public:
  [[nodiscard]] static Result<ByteStream> Connect(const Endpoint& endpoint,
                                                  const std::stop_token& stop);

  ByteStream(ByteStream&&) noexcept;
  ByteStream& operator=(ByteStream&&) noexcept;
  ~ByteStream();

  /// Writes all bytes. @param deadline_s  on HostNow()'s clock.
  [[nodiscard]] Result<void> Write(std::string_view bytes, double deadline_s,
                                   const std::stop_token& stop);

  struct ReadResult {
    std::size_t count = 0;  ///< bytes read; 0 with `timed_out` false: the other side closed
    bool timed_out = false;
  };

  /// Reads the available bytes, at least one; may be called again after a time-out.
  /// REQUIRES a non-empty buffer.
  [[nodiscard]] Result<ReadResult> Read(std::span<std::uint8_t> buffer, double deadline_s,
                                        const std::stop_token& stop);

 private:
  struct State;
  explicit ByteStream(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace trammel::machine
