#include "scripted_connection.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "fuzz.h"
#include "machine/moonraker/message_log.h"
#include "machine/moonraker/moonraker_connection.h"

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

constexpr double kLimit_s = 5;  // from here on a delay is no pause, but the end of patience

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
  std::deque<std::int64_t> calls;  ///< without an answer yet
  std::vector<std::function<void()>> later;
  std::vector<std::function<void()>> limits;  ///< what ends a wait that takes too long

  /// What is due before the next message.
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
