#include "scripted_stream.h"

#include <algorithm>
#include <utility>

#include "machine/net/byte_stream.h"
#include "machine/net/wait_fd.h"

namespace trammel::fuzz {
namespace {

std::string_view g_bytes;
std::size_t g_piece = 0;

}  // namespace

void SetStream(std::string_view bytes, std::size_t piece) {
  g_bytes = bytes;
  g_piece = piece;
}

}  // namespace trammel::fuzz

namespace trammel::machine {

struct ByteStream::State {};

ByteStream::ByteStream(std::unique_ptr<State> state) : state_(std::move(state)) {}
ByteStream::ByteStream(ByteStream&&) noexcept = default;
ByteStream& ByteStream::operator=(ByteStream&&) noexcept = default;
ByteStream::~ByteStream() = default;

Result<ByteStream> ByteStream::Connect(const ConnectOptions&, const std::stop_token&) {
  if (fuzz::g_bytes.empty()) return Fail("refused", ErrorKind::kMachine);
  return ByteStream(std::make_unique<State>());
}

Result<void> ByteStream::Write(std::string_view, double, const std::stop_token&) { return {}; }

Result<ByteStream::ReadResult> ByteStream::Read(std::span<std::uint8_t> buffer, double,
                                                const std::stop_token&) {
  const std::size_t count = std::min({fuzz::g_piece, buffer.size(), fuzz::g_bytes.size()});
  std::copy_n(fuzz::g_bytes.begin(), count, buffer.begin());
  fuzz::g_bytes.remove_prefix(count);
  return ReadResult{count, false};
}

Waited WaitForFd(int, short, double, const std::stop_token& stop) {
  return stop.stop_requested() ? Waited::kStopped : Waited::kTimeLimit;
}

}  // namespace trammel::machine
