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
#include <sstream>
#include <utility>

namespace trammel::test {
namespace {

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string Upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

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
  answers_ = {{"ESTOP", "OFF"},
              {"MACHINE", "ON"},
              {"MODE", "MANUAL"},
              {"SPINDLE 0", "0 OFF"},
              {"C", "0.000000"},
              {"USER_LINEAR_UNITS", "MM"},
              {"JOINT_HOMED", "YES YES YES YES NO NO"}};
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) == 0) listen(listener_, 4);
  getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
  wake_ = eventfd(0, EFD_CLOEXEC);
  thread_ = std::thread([this] { Serve(); });
}

ScriptedLinuxCnc::~ScriptedLinuxCnc() {
  eventfd_write(wake_, 1);
  thread_.join();
  close(listener_);
  close(wake_);
}

void ScriptedLinuxCnc::Answer(const std::string& name, const std::string& value) {
  const std::lock_guard lock(mutex_);
  answers_[Upper(name)] = value;
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
  std::string pending;
  for (;;) {
    std::array<pollfd, 2> wanted{pollfd{fd, POLLIN, 0}, pollfd{wake_, POLLIN, 0}};
    poll(wanted.data(), wanted.size(), -1);
    if (wanted[1].revents != 0) return;
    std::array<char, 4096> buffer{};
    const ssize_t count = recv(fd, buffer.data(), buffer.size(), 0);
    if (count <= 0) return;
    pending.append(buffer.data(), static_cast<std::size_t>(count));
    for (std::size_t end = pending.find('\n'); end != std::string::npos; end = pending.find('\n')) {
      std::string request = pending.substr(0, end);
      pending.erase(0, end + 1);
      while (!request.empty() && request.back() == '\r') request.pop_back();
      const Fault fault = script_ ? script_(request) : Fault::kNone;
      std::string reply;
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(request);
        if (fault == Fault::kDrop) return;
        if (fault != Fault::kSilent) reply = Reply(request, fault);
      }
      if (!reply.empty()) send(fd, reply.data(), reply.size(), MSG_NOSIGNAL);
    }
  }
}

std::string ScriptedLinuxCnc::Reply(const std::string& request, Fault fault) {
  if (fault == Fault::kNoise) return "220 mail.example.org ESMTP\r\n";
  if (request.starts_with("hello ")) {
    return fault == Fault::kRefuse ? "HELLO NAK\r\n" : "HELLO ACK EMCNETSVR 1.1\r\n";
  }
  if (request == "set echo off") return "set echo off\r\n";
  if (request.starts_with("set ")) return ReplyToSet(request.substr(4), fault);
  const std::string name = Upper(request.substr(std::min<std::size_t>(4, request.size())));
  const std::string word = name.substr(0, name.find(' '));
  std::string value;
  if (fault == Fault::kRefuse) return "GET " + word + " NAK\r\n\r\n";
  if (name == "ERROR") {
    value = std::exchange(error_, "OK");
  } else if (name == "OPERATOR_DISPLAY") {
    value = std::exchange(display_, "OK");
  } else if (name == "PROGRAM_STATUS") {
    const auto set = answers_.find(name);
    value = set != answers_.end() ? set->second : (Progress() < 1 ? "RUNNING" : "IDLE");
  } else if (name == "ABS_ACT_POS" && !answers_.contains(name)) {
    const std::array<double, 3> at = PositionNow();
    value =
        Six(at[0]) + " " + Six(at[1]) + " " + Six(at[2]) + " 0.000000 0.000000 " + answers_.at("C");
  } else if (answers_.contains(name)) {
    value = answers_.at(name);
  } else {
    return "GET " + word + " NAK\r\n\r\n";
  }
  return word + " " + value + "\r\n";
}

std::string ScriptedLinuxCnc::ReplyToSet(const std::string& what, Fault fault) {
  const std::string name = Upper(what.substr(0, what.find(' ')));
  if (fault == Fault::kRefuse) {
    error_ = "refused by the script";
    return "SET " + name + " NAK\n\r";
  }
  if (name == "MODE") answers_["MODE"] = Upper(what.substr(5));
  if (name == "ABORT") {
    from_ = to_ = PositionNow();
    duration_s_ = 0;
  }
  if (name == "MDI") {
    if (answers_.at("MODE") == "MDI") {
      Mdi(what.substr(4));
    } else {
      error_ = "Must be in MDI mode to issue MDI command";
    }
  }
  return "SET " + name + " ACK\n\r";
}

void ScriptedLinuxCnc::Mdi(const std::string& text) {
  const std::string block = " " + text;
  if (text.starts_with("(debug,")) {
    display_.clear();
    const std::string message = text.substr(7, text.size() - 8);
    for (std::size_t i = 0; i < message.size(); ++i) {
      if (message[i] != '#') {
        display_ += message[i];
      } else if (message.compare(i, 10, "#<_metric>") == 0) {
        display_ += metric_ ? "1.000000" : "0.000000";
        i += 9;
      } else if (message.compare(i, 7, "#<_ini[") == 0) {
        const std::size_t end = message.find('>', i);
        const auto known = ini_.find(message.substr(i + 6, end - i - 6));
        display_ += known == ini_.end() ? "######" : known->second;
        i = end;
      } else {
        std::size_t digits = 0;
        display_ += Six(parameters_[std::stoi(message.substr(i + 1), &digits)]);
        i += digits;
      }
    }
    return;
  }
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
  if (const auto turned = Word(block, 'C')) answers_["C"] = Six(*turned);  // at once
  std::array<double, 3> to = PositionNow();
  const std::array<char, 3> letters{'X', 'Y', 'Z'};
  for (std::size_t i = 0; i < 3; ++i) to[i] = Word(block, letters[i]).value_or(to[i]);
  for (const double place : to) {
    if (std::abs(place) > travel_mm_) {
      error_ = "Linear move on line 0 would exceed X's positive limit";
      return;
    }
  }
  from_ = PositionNow();
  to_ = to;
  start_s_ = Now();
  const double way = std::hypot(to_[0] - from_[0], to_[1] - from_[1], to_[2] - from_[2]);
  duration_s_ = way / (Word(block, 'F').value_or(1) / 60 * hurry_);
}

}  // namespace trammel::test
