#include "support/scripted_linuxcnc.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

namespace trammel::test {
namespace {

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

using nlohmann::json;

// Hands standard input on to the machine's socket, and its answers to standard output.
constexpr const char* kHelper = R"(#!/usr/bin/python3
import os, select, socket, sys
machine = socket.create_connection(("127.0.0.1", PORT))
while True:
    for ready in select.select([0, machine], [], [])[0]:
        data = os.read(0, 65536) if ready == 0 else machine.recv(65536)
        if not data:
            sys.exit()
        machine.sendall(data) if ready == 0 else os.write(1, data)
)";

// The number behind a letter of a block; absent where the letter is not there.
std::optional<double> Word(const std::string& block, char letter) {
  const std::size_t at = block.find(std::string(" ") + letter);
  if (at == std::string::npos) return std::nullopt;
  return std::stod(block.substr(at + 2));
}

std::string Six(double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%f", value);
  return text.data();
}

}  // namespace

ScriptedLinuxCnc::ScriptedLinuxCnc(Script script) : script_(std::move(script)) {
  answers_ = {{"mode", "MANUAL"}};
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) == 0) listen(listener_, 4);
  getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  std::string text = kHelper;
  text.replace(text.find("PORT"), 4, std::to_string(ntohs(address.sin_port)));
  WriteWhole(helper(), text);
  std::filesystem::permissions(helper(), std::filesystem::perms::owner_all);
  wake_ = eventfd(0, EFD_CLOEXEC);
  thread_ = std::thread([this] { Serve(); });
}

ScriptedLinuxCnc::~ScriptedLinuxCnc() {
  eventfd_write(wake_, 1);
  thread_.join();
  close(listener_);
  close(wake_);
}

void ScriptedLinuxCnc::Answer(const std::string& member, json value) {
  const std::lock_guard lock(mutex_);
  answers_[member] = std::move(value);
}

void ScriptedLinuxCnc::SetHurry(double factor) {
  const std::lock_guard lock(mutex_);
  hurry_ = factor;
}

void ScriptedLinuxCnc::SetIni(const std::string& name, const std::string& value) {
  const std::lock_guard lock(mutex_);
  ini_[name] = value;
}

void ScriptedLinuxCnc::SetTravel(double half_mm) {
  const std::lock_guard lock(mutex_);
  travel_mm_ = half_mm;
}

std::vector<std::string> ScriptedLinuxCnc::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

std::array<double, 3> ScriptedLinuxCnc::position() const {
  const std::lock_guard lock(mutex_);
  return PositionNow();
}

bool ScriptedLinuxCnc::moving() const {
  const std::lock_guard lock(mutex_);
  return Progress() < 1;
}

double ScriptedLinuxCnc::parameter(int number) const {
  const std::lock_guard lock(mutex_);
  const auto found = parameters_.find(number);
  return found == parameters_.end() ? 0 : found->second;
}

void ScriptedLinuxCnc::SetParameter(int number, double value) {
  const std::lock_guard lock(mutex_);
  parameters_[number] = value;
}

double ScriptedLinuxCnc::Progress() const {
  if (duration_s_ <= 0) return 1;
  return std::clamp((Now() - start_s_) / duration_s_, 0.0, 1.0);
}

std::array<double, 3> ScriptedLinuxCnc::PositionNow() const {
  std::array<double, 3> at{};
  const double progress = Progress();
  for (std::size_t i = 0; i < 3; ++i) at[i] = from_[i] + progress * (to_[i] - from_[i]);
  return at;
}

void ScriptedLinuxCnc::Serve() {
  for (;;) {
    std::array<pollfd, 2> wanted{pollfd{listener_, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
    poll(wanted.data(), wanted.size(), -1);
    if (wanted[1].revents != 0) return;
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (fd < 0) continue;
    Talk(fd);
    close(fd);
  }
}

void ScriptedLinuxCnc::Talk(int fd) {
  constexpr std::string_view kHello = "{\"id\": 0}\n";
  send(fd, kHello.data(), kHello.size(), MSG_NOSIGNAL);
  std::string pending;
  for (;;) {
    std::array<pollfd, 2> wanted{pollfd{fd, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
    poll(wanted.data(), wanted.size(), -1);
    if (wanted[1].revents != 0) return;
    std::array<char, 4096> buffer{};
    const ssize_t count = recv(fd, buffer.data(), buffer.size(), 0);
    if (count <= 0) {  // like an abandoned helper
      const std::lock_guard lock(mutex_);
      from_ = to_ = PositionNow();
      duration_s_ = 0;
      return;
    }
    pending.append(buffer.data(), static_cast<std::size_t>(count));
    for (std::size_t end = pending.find('\n'); end != std::string::npos; end = pending.find('\n')) {
      const std::string request = pending.substr(0, end);
      pending.erase(0, end + 1);
      const Fault fault = script_ ? script_(request) : Fault::kNone;
      std::string reply;
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(request);
        if (fault == Fault::kDrop) return;
        if (fault != Fault::kSilent) reply = Reply(request, fault) + '\n';
      }
      if (!reply.empty()) send(fd, reply.data(), reply.size(), MSG_NOSIGNAL);
    }
  }
}

std::string ScriptedLinuxCnc::Reply(const std::string& line, Fault fault) {
  if (fault == Fault::kNoise) return "220 mail.example.org ESMTP";
  const json request = json::parse(line);
  json answer = fault == Fault::kRefuse
                    ? json{{"error", "refused by the script"}, {"kind", "machine"}}
                    : Do(request);
  answer["id"] = request["id"];
  return answer.dump();
}

json ScriptedLinuxCnc::Do(const json& request) {
  const std::string what = request["do"];
  if (what == "look") return Look();
  if (what == "state" || what == "facts") {
    json answer = {{"estop", false},
                   {"on", true},
                   {"homed", {1, 1, 1, 1}},
                   {"metric", true},
                   {"c_axis", true},
                   {"feed_override", 1},
                   {"fastest_mm_s", 1e6},
                   {"axes", "XYZC"},
                   {"unit_mm", 1},
                   {"joints", 4},
                   {"tool", 0},
                   {"tool_length", 0},
                   {"tools", 0},
                   {"low", {-1e5, -1e5, -1e5, -360}},
                   {"high", {1e5, 1e5, 1e5, 360}}};
    answer.update(Look());
    return answer;
  }
  if (what == "take") answers_["mode"] = "MDI";
  if (what == "abort") {
    from_ = to_ = PositionNow();
    duration_s_ = 0;
  }
  if (what == "mdi") Mdi(request["block"]);
  if (what == "show") return {{"shown", Shown(request["text"])}};
  return json::object();
}

json ScriptedLinuxCnc::Look() const {
  const std::array<double, 3> at = PositionNow();
  const auto c = answers_.find("c");
  const json c_deg = c == answers_.end() ? json(c_deg_) : c->second;
  json answer = {{"position", {at[0], at[1], at[2], c_deg}},
                 {"commanded", {to_[0], to_[1], to_[2], c_deg}},
                 {"idle", !(Progress() < 1)},
                 {"spindle_stopped", true}};
  for (const auto& [member, value] : answers_) answer[member] = value;
  return answer;
}

std::string ScriptedLinuxCnc::Shown(const std::string& message) {
  std::string shown;
  for (std::size_t i = 0; i < message.size(); ++i) {
    if (message[i] != '#') {
      shown += message[i];
    } else if (message.compare(i, 10, "#<_metric>") == 0) {
      shown += metric_ ? "1.000000" : "0.000000";
      i += 9;
    } else if (message.compare(i, 7, "#<_ini[") == 0) {
      const std::size_t end = message.find('>', i);
      const auto known = ini_.find(message.substr(i + 6, end - i - 6));
      shown += known == ini_.end() ? "######" : known->second;
      i = end;
    } else {
      std::size_t digits = 0;
      shown += Six(parameters_[std::stoi(message.substr(i + 1), &digits)]);
      i += digits;
    }
  }
  return shown;
}

void ScriptedLinuxCnc::Mdi(const std::string& text) {
  const std::string block = " " + text;
  if (block.find(" G20") != std::string::npos) metric_ = false;
  if (block.find(" G21") != std::string::npos) metric_ = true;
  if (block.find(" G10 L2") != std::string::npos) {
    const int first = 5221 + 20 * (static_cast<int>(*Word(block, 'P')) - 1);
    const double unit = metric_ ? 1 : 25.4;
    for (const auto& [letter, place] : {std::pair{'X', 0}, std::pair{'Y', 1}, std::pair{'Z', 2}}) {
      if (const auto word = Word(block, letter)) parameters_[first + place] = *word * unit;
    }
    if (const auto word = Word(block, 'R')) parameters_[first + 9] = *word;
    return;
  }
  if (block.find(" G53 G1") != std::string::npos) Move(block);
}

void ScriptedLinuxCnc::Move(const std::string& block) {
  std::array<double, 3> to = PositionNow();
  const std::array<char, 3> letters{'X', 'Y', 'Z'};
  for (std::size_t i = 0; i < 3; ++i) to[i] = Word(block, letters[i]).value_or(to[i]);
  for (const double place : to) {
    if (std::abs(place) > travel_mm_) return;
  }
  if (const auto turned = Word(block, 'C')) c_deg_ = *turned;  // immediate
  from_ = PositionNow();
  to_ = to;
  start_s_ = Now();
  const double way = std::hypot(to_[0] - from_[0], to_[1] - from_[1], to_[2] - from_[2]);
  duration_s_ = way / (Word(block, 'F').value_or(1) / 60 * hurry_);
}

}  // namespace trammel::test
