#include "machine/net/byte_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <string>
#include <utility>

#include "machine/net/host_clock.h"
#include "machine/net/net_stream.h"

namespace trammel::machine {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

tl::unexpected<Error> Stopped() { return Fail("stopped", ErrorKind::kInterrupted); }

tl::unexpected<Error> Broken(const error_code& error) {
  return Fail(fmt::format("the connection broke ({})", error.message()), ErrorKind::kMachine);
}

}  // namespace

/// An operation abandoned by a wait continues, with memory of this object.
struct ByteStream::State {
  explicit State(const Endpoint& endpoint) : stream(io, endpoint) {}

  /// Runs pending operations while `busy`, until a deadline or a stop.
  template <class Busy>
  void RunWhile(Busy busy, double deadline_s, const std::stop_token& stop) {
    io.restart();
    const std::stop_callback on_stop(stop, [this] { io.stop(); });
    const std::chrono::duration<double> left(std::clamp(deadline_s - HostNow(), 0.0, 1e6));
    const auto end = std::chrono::steady_clock::now() +
                     std::chrono::duration_cast<std::chrono::steady_clock::duration>(left);
    while (busy() && io.run_one_until(end) > 0) {
    }
  }

  asio::io_context io;
  NetStream stream;
  std::string outgoing;
  bool writing = false;
  error_code write_error;
  std::array<std::uint8_t, 65536> incoming{};
  std::size_t begin = 0, end = 0;  ///< range read but not yet consumed
  bool reading = false;
  error_code read_error;
};

ByteStream::ByteStream(std::unique_ptr<State> state) : state_(std::move(state)) {}
ByteStream::ByteStream(ByteStream&&) noexcept = default;
ByteStream& ByteStream::operator=(ByteStream&&) noexcept = default;
ByteStream::~ByteStream() = default;

Result<ByteStream> ByteStream::Connect(const Endpoint& endpoint, const std::stop_token& stop) {
  const double deadline_s = HostNow() + endpoint.time_limit_s;
  auto state = std::make_unique<State>(endpoint);
  bool connecting = true;
  std::optional<Error> failed;
  state->stream.AsyncConnect([&](std::optional<Error> error) {
    failed = std::move(error);
    connecting = false;
  });
  constexpr double kGrace_s = 0.2;  // the stream has a limit of its own, and says what took so long
  state->RunWhile([&] { return connecting; }, deadline_s + kGrace_s, stop);
  if (stop.stop_requested()) return Stopped();
  if (connecting) {
    return Fail(fmt::format("no answer to the look-up of '{}' within {:g} s; check the network",
                            endpoint.host, endpoint.time_limit_s),
                ErrorKind::kMachine);
  }
  if (failed) return tl::unexpected(*failed);
  return ByteStream(std::move(state));
}

Result<void> ByteStream::Write(std::string_view bytes, double deadline_s,
                               const std::stop_token& stop) {
  State& state = *state_;
  state.outgoing = bytes;
  state.writing = true;
  asio::async_write(state.stream, asio::buffer(state.outgoing),
                    [&state](error_code error, std::size_t) {
                      state.writing = false;
                      state.write_error = error;
                    });
  state.RunWhile([&] { return state.writing; }, deadline_s, stop);
  if (stop.stop_requested()) return Stopped();
  if (state.writing) return Fail("the server does not take the request", ErrorKind::kMachine);
  if (state.write_error) return Broken(state.write_error);
  return {};
}

Result<ByteStream::ReadResult> ByteStream::Read(std::span<std::uint8_t> buffer, double deadline_s,
                                                const std::stop_token& stop) {
  State& state = *state_;
  if (state.begin == state.end) {
    if (!state.reading) {
      state.reading = true;
      state.stream.async_read_some(asio::buffer(state.incoming),
                                   [&state](error_code error, std::size_t count) {
                                     state.reading = false;
                                     state.read_error = error;
                                     state.begin = 0;
                                     state.end = count;
                                   });
    }
    state.RunWhile([&] { return state.reading; }, deadline_s, stop);
    if (stop.stop_requested()) return Stopped();
    if (state.reading) return ReadResult{0, true};
    const bool closed = state.read_error == asio::error::eof ||
                        state.read_error == asio::ssl::error::stream_truncated;
    if (state.read_error && !closed) return Broken(state.read_error);
  }
  const std::size_t count = std::min(buffer.size(), state.end - state.begin);
  std::copy_n(state.incoming.begin() + static_cast<std::ptrdiff_t>(state.begin), count,
              buffer.begin());
  state.begin += count;
  return ReadResult{count, false};
}

}  // namespace trammel::machine
