#include "sim/spindle/mill.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "base/bug_note.h"
#include "sim/camera/camera_http.h"

namespace trammel::sim {

namespace {

using nlohmann::json;

constexpr const char* kLetters = "XYZC";

json Failed(const std::string& why, const char* kind) { return {{"error", why}, {"kind", kind}}; }

// Returns the number after a letter that begins a word of a block.
std::optional<double> Word(std::string_view block, char letter) {
  for (std::size_t at = 0; at + 1 < block.size(); ++at) {
    if (block[at] != letter || (at > 0 && block[at - 1] != ' ')) continue;
    double number = 0;
    const auto read = std::from_chars(block.data() + at + 1, block.data() + block.size(), number);
    if (read.ec == std::errc() && std::isfinite(number)) return number;
  }
  return std::nullopt;
}

bool Has(std::string_view block, std::string_view word) {
  return block.find(word) != std::string_view::npos;
}

}  // namespace

VirtualMill::VirtualMill(const MillOptions& options) : options_(options) {
  std::copy(options.start_mm.begin(), options.start_mm.end(), from_.begin());
  to_ = from_;
}

double VirtualMill::Progress(double now_s) const {
  if (!(duration_s_ > 0)) return 1;
  return std::clamp((std::min(now_s, estop_s_) - begin_s_) / duration_s_, 0.0, 1.0);
}

std::array<double, 4> VirtualMill::Now(double now_s) const {
  const double progress = Progress(now_s);
  std::array<double, 4> at{};
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = from_[i] + progress * (to_[i] - from_[i]);
  return at;
}

MillPlace VirtualMill::At(double now_s) const {
  const std::lock_guard lock(mutex_);
  const auto at = Now(now_s);
  const bool moving = Progress(now_s) < 1 && now_s < estop_s_;
  return {{at[0], at[1], at[2]}, at[3], moving, approach_, turn_};
}

void VirtualMill::Leave(double now_s) {
  const std::lock_guard lock(mutex_);
  Stop(now_s);
  mode_ = "MANUAL";
}

bool VirtualMill::serves() const {
  const std::lock_guard lock(mutex_);
  return serves_;
}

void VirtualMill::Stop(double now_s) {
  from_ = to_ = Now(now_s);
  duration_s_ = 0;
}

std::string VirtualMill::Answer(const std::string& line, double now_s) {
  const std::lock_guard lock(mutex_);
  if (now_s >= estop_s_) {
    Stop(now_s);
    on_ = false;
  }
  const json request = json::parse(line, nullptr, /*allow_exceptions=*/false);
  json answer = {{"error", "a request is an object with an id and what to do"},
                 {"kind", "machine"}};
  if (request.is_object() && request.value("id", json()).is_number_integer() &&
      request.value("do", json()).is_string()) {
    answer = Do(request, now_s);
    answer["id"] = request["id"];
  }
  return answer.dump(-1, ' ', false, json::error_handler_t::replace);
}

json VirtualMill::Do(const json& request, double now_s) {
  const std::string what = request["do"];
  const auto text_of = [&request](const char* name) {
    const json text = request.value(name, json());
    return text.is_string() ? text.get<std::string>() : std::string();
  };
  if (mode_ == "MDI" && !on_ && what != "abort") {
    return Failed("somebody took LinuxCNC over (its emergency stop was pressed)", "taken");
  }
  if (what == "look") return Look(now_s);
  if (what == "state") return State(now_s);
  if (what == "facts") return Facts(now_s);
  if (what == "mdi") return Mdi(text_of("block"), now_s);
  if (what == "show") return {{"shown", Shown(text_of("text"))}};
  if (what == "take") mode_ = "MDI";
  if (what == "abort") Stop(now_s);
  if (what == "take" || what == "abort") return json::object();
  return Failed("nothing is known of it", "machine");
}

json VirtualMill::Look(double now_s) const {
  const bool moving = Progress(now_s) < 1 && now_s < estop_s_;
  return {{"position", Now(now_s)},
          {"commanded", moving ? to_ : Now(now_s)},
          {"mode", mode_},
          {"idle", !moving},
          {"spindle_stopped", !options_.faults.spindle_turns}};
}

json VirtualMill::State(double now_s) const {
  constexpr double kFastest_mm_s = 1e4;
  json answer = Look(now_s);
  const int homed = options_.faults.not_homed ? 0 : 1;
  answer.update(json{{"estop", !on_},
                     {"on", on_},
                     {"homed", std::array<int, 4>{homed, homed, homed, homed}},
                     {"metric", true},
                     {"c_axis", true},
                     {"feed_override", 1},
                     {"fastest_mm_s", kFastest_mm_s}});
  return answer;
}

json VirtualMill::Facts(double now_s) const {
  constexpr double kMaxTurned_deg = 36'000;
  const Triple& low = options_.travel_low_mm;
  const Triple& high = options_.travel_high_mm;
  json answer = State(now_s);
  answer.update(json{{"axes", kLetters},
                     {"unit_mm", 1},
                     {"joints", 4},
                     {"tool", 0},
                     {"tool_length", 0},
                     {"tools", 0},
                     {"low", {low[0], low[1], low[2], -kMaxTurned_deg}},
                     {"high", {high[0], high[1], high[2], kMaxTurned_deg}}});
  return answer;
}

json VirtualMill::Mdi(const std::string& block, double now_s) {
  if (mode_ != "MDI") return Failed("MDI mode was not taken", "machine");
  if (Progress(now_s) < 1) {
    return Failed("LinuxCNC still executes something; nothing was added to it", "machine");
  }
  if (Has(block, "G53 G1 ")) Move(block, now_s);
  return json::object();
}

// Expands values of the INI file in a message; other parameters are not stored.
std::string VirtualMill::Shown(const std::string& text) const {
  std::string shown;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t end = text.compare(i, 7, "#<_ini[") == 0 ? text.find('>', i) : text.npos;
    if (end == text.npos) {
      shown += text[i];
      continue;
    }
    const std::string name = text.substr(i + 7, end - i - 7);
    std::string value = "######";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string section = fmt::format("AXIS_{}]", kLetters[axis]);
      if (name == section + "MIN_LIMIT") value = fmt::format("{:f}", options_.travel_low_mm[axis]);
      if (name == section + "MAX_LIMIT") value = fmt::format("{:f}", options_.travel_high_mm[axis]);
    }
    shown += value;
    i = end;
  }
  return shown;
}

void VirtualMill::Move(const std::string& block, double now_s) {
  ++moves_;
  const MillFaults& faults = options_.faults;
  if (moves_ == faults.refused_at_move) return;  // like LinuxCNC, which reports only on its screen
  const std::array<double, 4> from = Now(now_s);
  std::array<double, 4> to = from;
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = Word(block, kLetters[i]).value_or(to[i]);
  for (std::size_t i = 0; i < 3; ++i) {
    if (to[i] < options_.travel_low_mm[i] || to[i] > options_.travel_high_mm[i]) return;
  }
  constexpr double kMaxTurned_deg = 36'000;
  if (std::abs(to[3]) > kMaxTurned_deg) return;
  const double way_mm = std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
  const double turn_deg = std::abs(to[3] - from[3]);
  // Without X, Y and Z the speed is in degrees/min.
  const double way = way_mm > 0 ? way_mm : turn_deg;
  const double feed = Word(block, 'F').value_or(1) / 60 * options_.hurry;
  from_ = from;
  to_ = to;
  begin_s_ = now_s;
  duration_s_ = feed > 0 ? way / feed : 0;
  approach_ += way_mm > 0 ? 1 : 0;
  turn_ += turn_deg > 0 ? 1 : 0;
  if (moves_ == faults.estop_at_move) estop_s_ = now_s + duration_s_ / 2;
  if (faults.silent_at_move > 0 && moves_ >= faults.silent_at_move) serves_ = false;
}

namespace {

constexpr std::size_t kMaxClients = 16;
constexpr std::size_t kLongestLine = 4096;

class Server final : public MillServer {
 public:
  explicit Server(std::shared_ptr<VirtualMill> mill) : mill_(std::move(mill)) {}
  ~Server() override {
    if (thread_.joinable()) {
      eventfd_write(wake_, 1);
      thread_.join();
    }
    for (const Client& client : clients_) close(client.fd);
    if (listener_ >= 0) close(listener_);
    if (wake_ >= 0) close(wake_);
  }
  int port() const override { return port_; }

  Result<void> Listen(int port) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    wake_ = eventfd(0, EFD_CLOEXEC);
    const int yes = 1;
    setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const plain = reinterpret_cast<sockaddr*>(&address);
    if (listener_ < 0 || wake_ < 0 || bind(listener_, plain, size) != 0 ||
        listen(listener_, kMaxClients) != 0 || getsockname(listener_, plain, &size) != 0) {
      return Fail(fmt::format("the virtual mill cannot listen on 127.0.0.1:{}: {}; choose another "
                              "port or 0 for a free one",
                              port, std::strerror(errno)),
                  ErrorKind::kMachine);
    }
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { (void)NoteBug([this] { Serve(); }); });
    return {};
  }

 private:
  struct Client {
    int fd = -1;
    std::string pending;
    bool gone = false;
  };

  void Serve() {
    for (;;) {
      std::vector<pollfd> wanted = {{wake_, POLLIN, 0}, {listener_, POLLIN, 0}};
      for (const Client& client : clients_) wanted.push_back({client.fd, POLLIN, 0});
      if (poll(wanted.data(), wanted.size(), -1) < 0) continue;
      if (wanted[0].revents != 0) return;
      for (std::size_t i = 0; i < clients_.size(); ++i) {
        if (wanted[i + 2].revents != 0) Talk(clients_[i]);
      }
      if (wanted[1].revents != 0) Accept();
      std::erase_if(clients_, [this](const Client& client) {
        if (!client.gone && mill_->serves()) return false;
        if (client.gone && mill_->serves()) mill_->Leave(MonotonicNow());
        close(client.fd);
        return true;
      });
    }
  }

  void Accept() {
    const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) return;
    if (clients_.size() < kMaxClients && mill_->serves()) {
      constexpr std::string_view kHello = "{\"id\": 0}\n";
      (void)send(fd, kHello.data(), kHello.size(), MSG_NOSIGNAL);
      clients_.push_back({fd, {}, false});
    } else {
      close(fd);
    }
  }

  void Talk(Client& client) {
    std::array<char, 1024> buffer{};
    const ssize_t count = recv(client.fd, buffer.data(), buffer.size(), 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    client.gone = count <= 0 || client.pending.size() > kLongestLine;
    if (client.gone) return;
    client.pending.append(buffer.data(), static_cast<std::size_t>(count));
    for (std::size_t end = client.pending.find('\n'); end != std::string::npos;
         end = client.pending.find('\n')) {
      std::string line = client.pending.substr(0, end);
      client.pending.erase(0, end + 1);
      while (!line.empty() && line.back() == '\r') line.pop_back();
      const std::string answer = mill_->Answer(line, MonotonicNow()) + '\n';
      if (!mill_->serves()) return;
      (void)send(client.fd, answer.data(), answer.size(), MSG_NOSIGNAL);
    }
  }

  std::shared_ptr<VirtualMill> mill_;
  int listener_ = -1;
  int wake_ = -1;
  int port_ = 0;
  std::vector<Client> clients_;  // the thread's own
  std::thread thread_;
};

}  // namespace

Result<void> JoinMill(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (fd < 0 || connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    if (fd >= 0) close(fd);
    return Fail(fmt::format("no virtual mill listens on 127.0.0.1:{}: {}; start trammel-sim mill",
                            port, std::strerror(error)),
                ErrorKind::kMachine);
  }
  std::array<pollfd, 2> wanted = {pollfd{STDIN_FILENO, POLLIN, 0}, pollfd{fd, POLLIN, 0}};
  for (bool open = true; open;) {
    if (poll(wanted.data(), wanted.size(), -1) < 0) continue;
    for (const pollfd& from : wanted) {
      if (from.revents == 0) continue;
      std::array<char, 4096> bytes{};
      const ssize_t count = read(from.fd, bytes.data(), bytes.size());
      const int to = from.fd == fd ? STDOUT_FILENO : fd;
      open = open && count > 0 && write(to, bytes.data(), static_cast<std::size_t>(count)) == count;
    }
  }
  close(fd);
  return {};
}

Result<std::unique_ptr<MillServer>> MillServer::Start(int port, std::shared_ptr<VirtualMill> mill) {
  auto server = std::make_unique<Server>(std::move(mill));
  TRY(server->Listen(port));
  return server;
}

}  // namespace trammel::sim
