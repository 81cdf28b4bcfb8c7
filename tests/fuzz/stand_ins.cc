// Stands in for sockets, child processes and loaded modules, linked in place of their files.
#include "stand_ins.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "fuzz.h"
#include "machine/moonraker/link/connection.h"
#include "machine/moonraker/link/rpc.h"
#include "machine/net/byte_stream.h"
#include "machine/net/child_process.h"
#include "machine/net/wait.h"
#include "machine/page/pdf_module.h"

namespace trammel::fuzz {
namespace {

std::deque<std::string_view> g_lines;

std::string_view TakeLines() {
  if (g_lines.empty()) return {};
  const std::string_view lines = g_lines.front();
  g_lines.pop_front();
  return lines;
}

}  // namespace

void SetMessages(std::string_view lines) {
  const auto parts = Parts(lines, 2);
  g_lines.assign(parts.begin(), parts.end());
}

}  // namespace trammel::fuzz

namespace trammel::machine {

namespace {

constexpr double kLimit_s = 5;  // longer delays are time limits, not pauses

}  // namespace

struct MoonrakerConnection::State {
  MoonrakerAddress address;
  ConnectionEvents events;
  MessageLog log;
  std::string_view lines = fuzz::TakeLines();
  bool up = false;
  bool pumping = false;
  bool connect = false;
  std::optional<Error> broken;
  std::deque<std::int64_t> calls;  ///< not yet answered
  std::vector<std::function<void()>> later;
  std::vector<std::function<void()>> limits;  ///< callbacks of expired waits

  /// Runs all that is due before the next message.
  void Settle() {
    if (broken) {
      up = false;
      calls.clear();
      events.on_down(*std::exchange(broken, std::nullopt));
    }
    if (std::exchange(connect, false)) {
      up = true;
      calls.clear();
      events.on_open();
    }
    for (const auto& function : std::exchange(later, {})) function();
  }

  void Deliver(std::string_view line) {
    if (line == "!") {
      broken = Error{ErrorKind::kMachine, "the link broke"};
      return;
    }
    if (line == "~") {
      for (auto& limit : std::exchange(limits, {})) later.push_back(std::move(limit));
      return;
    }
    std::string message(line);
    if (line[0] == '=') {
      if (calls.empty()) return;
      message = fmt::format("{{\"id\":{},{}", calls.front(), line.substr(1));
      calls.pop_front();
    }
    log.Add(MessageDirection::kIn, message);
    events.on_message(message);
  }

  void Pump() {
    if (std::exchange(pumping, true)) return;
    Settle();
    while (!lines.empty()) {
      const std::size_t end = std::min(lines.find('\n'), lines.size());
      const std::string_view line = lines.substr(0, end);
      lines.remove_prefix(std::min(end + 1, lines.size()));
      if (line.empty()) break;
      if (up) Deliver(line);
      Settle();
    }
    pumping = false;
  }
};

MoonrakerConnection::MoonrakerConnection(MoonrakerAddress address, MoonrakerOptions,
                                         ConnectionEvents events)
    : state_(std::make_unique<State>()) {
  state_->address = std::move(address);
  state_->events = std::move(events);
}

MoonrakerConnection::~MoonrakerConnection() = default;

void MoonrakerConnection::Connect() {
  state_->connect = true;
  state_->Pump();
}

void MoonrakerConnection::Drop(Error error) { state_->broken = std::move(error); }

Result<void> MoonrakerConnection::Send(std::string message) {
  if (!state_->up) return Fail("the link is down", ErrorKind::kMachine);
  const auto json = nlohmann::json::parse(message);  // throws where we send what is no JSON
  if (json.contains("method") && json.contains("id")) {
    state_->calls.push_back(json.at("id").get<std::int64_t>());
  }
  state_->log.Add(MessageDirection::kOut, message);
  state_->Pump();
  return {};
}

void MoonrakerConnection::RunAfter(double delay_s, std::function<void()> function) {
  (delay_s < kLimit_s ? state_->later : state_->limits).push_back(std::move(function));
}

bool MoonrakerConnection::OnOwnThread() const { return state_->pumping; }
const MessageLog& MoonrakerConnection::log() const { return state_->log; }
const MoonrakerAddress& MoonrakerConnection::address() const { return state_->address; }

}  // namespace trammel::machine

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

Result<ByteStream> ByteStream::Connect(const Endpoint&, const std::stop_token&) {
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

// machine/net/child_process.cc: the work runs at once and in this process, where the
// sanitizers see it and no process has to be made for each input. Its limits, which would be the
// fuzzer's, are not set.

namespace {

std::deque<trammel::machine::ChildMessage> g_messages;

}  // namespace

namespace trammel::machine {

void LimitThisProcess(std::uint64_t, int) {}

bool ChildSender::Send(std::uint32_t kind, std::span<const std::uint8_t> bytes) const {
  g_messages.push_back({kind, {bytes.begin(), bytes.end()}});
  return fd_ < 0;
}

bool ChildSender::Send(std::uint32_t kind, std::string_view text) const {
  return Send(kind, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

Result<ChildProcess> ChildProcess::Start(const std::function<void(const ChildSender&)>& work,
                                         double patience_s) {
  constexpr int kNone = -1;
  g_messages.clear();
  try {
    work(ChildSender(kNone));
  } catch (const std::bad_alloc&) {
    // More than a child may take: it ends without having said all.
  }
  return ChildProcess(kNone, kNone, patience_s);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept = default;
ChildProcess::~ChildProcess() = default;

Received ChildProcess::Receive(ChildMessage& message, double, const std::stop_token&) {
  if (g_messages.empty()) return Received::kEnded;
  message = std::move(g_messages.front());
  g_messages.pop_front();
  return Received::kMessage;
}

std::string ChildProcess::End() { return "it has not said all"; }

}  // namespace trammel::machine

// The module that reads PDFs, linked into the target instead of loaded.

extern "C" const void* trammel_module();

namespace trammel::machine {

Result<const PdfModule*> FindPdfModule() { return static_cast<const PdfModule*>(trammel_module()); }

}  // namespace trammel::machine
