#include "scripted_stream.h"

#include <algorithm>
#include <cctype>
#include <string>
#include <utility>

#include "machine/net/byte_stream.h"
#include "machine/net/wait_fd.h"

namespace trammel::fuzz {
namespace {

std::string_view g_bytes;
std::size_t g_piece = 0;
std::string g_head;  ///< of the answer to what was asked last
std::string g_line;  ///< what is left of the line that is being read

/// "get estop" is answered by "ESTOP …", "set mode mdi" by "SET MODE …", "hello …" by "HELLO …".
std::string HeadOf(std::string_view request) {
  const auto word = [&request] {
    const std::size_t end = std::min(request.find_first_of(" \r\n"), request.size());
    const std::string_view first = request.substr(0, end);
    request.remove_prefix(std::min(end + 1, request.size()));
    return std::string(first);
  };
  std::string head = word();
  if (head == "get") head = word();
  if (head == "set") head += ' ' + word();
  for (char& c : head) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return head;
}

void NextLine() {
  const std::size_t end = std::min(g_bytes.find('\n'), g_bytes.size());
  g_line = g_bytes.substr(0, end);
  g_bytes.remove_prefix(std::min(end + 1, g_bytes.size()));
  if (g_line.starts_with('=')) g_line = g_head + ' ' + g_line.substr(1);
  g_line += '\n';
}

}  // namespace

void SetStream(std::string_view bytes, std::size_t piece) {
  g_bytes = bytes;
  g_piece = piece;
  g_line.clear();
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

Result<void> ByteStream::Write(std::string_view bytes, double, const std::stop_token&) {
  fuzz::g_head = fuzz::HeadOf(bytes);
  return {};
}

Result<ByteStream::ReadResult> ByteStream::Read(std::span<std::uint8_t> buffer, double,
                                                const std::stop_token&) {
  const auto take = [&buffer](auto& bytes, std::size_t most) {
    const std::size_t count = std::min({most, buffer.size(), bytes.size()});
    std::copy_n(bytes.begin(), count, buffer.begin());
    bytes = bytes.substr(count);
    return ReadResult{count, false};
  };
  if (fuzz::g_piece > 0) return take(fuzz::g_bytes, fuzz::g_piece);
  if (fuzz::g_line.empty() && !fuzz::g_bytes.empty()) fuzz::NextLine();
  return take(fuzz::g_line, fuzz::g_line.size());
}

Waited WaitForFd(int, short, double, const std::stop_token& stop) {
  return stop.stop_requested() ? Waited::kStopped : Waited::kTimeLimit;
}

}  // namespace trammel::machine
