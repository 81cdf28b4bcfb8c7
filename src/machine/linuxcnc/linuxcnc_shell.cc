#include "machine/linuxcnc/linuxcnc_shell.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "machine/linuxcnc/linuxcnc_limits.h"
#include "machine/net/host_clock.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kLongestLine = 10'000;
constexpr int kMostStrayLines = 50;

std::string Upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string FirstWord(const std::string& text) { return text.substr(0, text.find(' ')); }

std::string Where(const LinuxCncAddress& address) {
  return fmt::format("LinuxCNC's shell at {}:{}", address.host, address.port);
}

tl::unexpected<Error> Lost(const LinuxCncAddress& address, const std::string& request,
                           const Error& error) {
  return Fail(fmt::format("{}, \"{}\": {}", Where(address), request, error.message), error.kind);
}

bool StartsWithWords(const std::string& line, const std::string& words) {
  const std::string head = Upper(line.substr(0, words.size()));
  return head == words && (line.size() == words.size() || line[words.size()] == ' ');
}

}  // namespace

LinuxCncShell::LinuxCncShell(ByteStream stream, LinuxCncAddress address)
    : stream_(std::move(stream)), address_(std::move(address)) {}

Result<LinuxCncShell> LinuxCncShell::Connect(const LinuxCncAddress& address,
                                             const std::stop_token& stop) {
  ConnectOptions options;
  options.host = address.host;
  options.port = address.port;
  options.time_limit_s = address.time_limit_s;
  auto stream = ByteStream::Connect(options, stop);
  if (!stream) {
    return Fail(fmt::format("{}: {}; is linuxcncrsh running? ([DISPLAY] DISPLAY = linuxcncrsh, or "
                            "loadusr linuxcncrsh in a HAL file)",
                            Where(address), stream.error().message),
                stream.error().kind);
  }
  LinuxCncShell shell(std::move(*stream), address);
  if (auto greeted = shell.Greet(stop); !greeted) return tl::unexpected(greeted.error());
  return shell;
}

Result<void> LinuxCncShell::Greet(const std::stop_token& stop) {
  const std::string hello = fmt::format("hello {} trammel 1.0", address_.connect_password);
  if (auto sent = Send(hello, stop); !sent) return sent;
  const auto answer = Await("hello", "HELLO ACK", "HELLO NAK", stop);
  if (!answer) return tl::unexpected(answer.error());
  if (StartsWithWords(*answer, "HELLO NAK")) {
    return Fail(
        fmt::format("{} does not take the password; give the one of linuxcncrsh --connectpw",
                    Where(address_)),
        ErrorKind::kMachine);
  }
  // "set echo off" is answered by its own echo, or by nothing where echo is off already.
  if (auto sent = Send("set echo off", stop); !sent) return sent;
  if (auto set = Set("verbose on", stop); !set) return set;
  if (auto set = Set("enable " + address_.enable_password, stop); !set) {
    return Fail(fmt::format("{} does not give control: another client may hold it, or the password "
                            "is not that of linuxcncrsh --enablepw ({})",
                            Where(address_), set.error().message),
                set.error().kind);
  }
  return {};
}

Result<void> LinuxCncShell::Send(const std::string& line, const std::stop_token& stop) {
  auto sent = stream_.Write(line + "\r\n", HostNow() + address_.time_limit_s, stop);
  if (!sent) return Lost(address_, FirstWord(line), sent.error());
  return {};
}

Result<std::optional<std::string>> LinuxCncShell::ReadLine(double deadline_s,
                                                           const std::stop_token& stop) {
  std::array<std::uint8_t, 4096> buffer{};
  while (lines_.empty()) {
    const auto read = stream_.Read(buffer, deadline_s, stop);
    if (!read) return tl::unexpected(read.error());
    if (read->timed_out) return std::optional<std::string>();
    if (read->count == 0) return Fail("it closed the connection", ErrorKind::kMachine);
    for (std::size_t i = 0; i < read->count; ++i) {
      const char c = static_cast<char>(buffer[i]);
      if (c != '\r' && c != '\n') {  // SET ends in \n\r, GET in \r\n
        partial_.push_back(c);
      } else if (!partial_.empty()) {
        lines_.push_back(std::exchange(partial_, {}));
      }
    }
    if (partial_.size() > kLongestLine) {
      return Fail(fmt::format("it sent a line of more than {} bytes", kLongestLine),
                  ErrorKind::kMachine);
    }
  }
  std::string line = std::move(lines_.front());
  lines_.pop_front();
  return std::optional(std::move(line));
}

Result<std::string> LinuxCncShell::Await(const std::string& request, const std::string& head,
                                         const std::string& other_head,
                                         const std::stop_token& stop) {
  const double deadline_s = HostNow() + address_.time_limit_s;
  std::string last;
  for (int i = 0; i < kMostStrayLines; ++i) {
    auto line = ReadLine(deadline_s, stop);
    if (!line) return Lost(address_, request, line.error());
    if (!*line) {
      return Fail(fmt::format("{}, \"{}\": no answer within {} s", Where(address_), request,
                              address_.time_limit_s),
                  ErrorKind::kMachine);
    }
    if (StartsWithWords(**line, head) || StartsWithWords(**line, other_head)) return **line;
    last = **line;
  }
  constexpr std::size_t kShown = 60;
  return Fail(fmt::format("{}, \"{}\": it answers \"{}\"; is this linuxcncrsh?", Where(address_),
                          request, last.substr(0, kShown)),
              ErrorKind::kMachine);
}

Result<std::string> LinuxCncShell::Get(const std::string& what, const std::stop_token& stop) {
  const std::string request = "get " + what;
  if (auto sent = Send(request, stop); !sent) return tl::unexpected(sent.error());
  const std::string name = Upper(FirstWord(what));
  const auto answer = Await(request, name, "GET " + name, stop);
  if (!answer) return tl::unexpected(answer.error());
  if (StartsWithWords(*answer, "GET " + name)) {
    return Fail(
        fmt::format("{} does not know \"{}\" ({})", Where(address_), request, Clipped(*answer)),
        ErrorKind::kMachine);
  }
  return answer->size() > name.size() ? answer->substr(name.size() + 1) : std::string();
}

Result<void> LinuxCncShell::Set(const std::string& what, const std::stop_token& stop) {
  const std::string name = FirstWord(what);
  // A password is not for messages.
  const std::string shown = name == "enable" ? "set enable" : "set " + what;
  if (auto sent = Send("set " + what, stop); !sent) return sent;
  const auto answer = Await(shown, fmt::format("SET {} ACK", Upper(name)),
                            fmt::format("SET {} NAK", Upper(name)), stop);
  if (!answer) return tl::unexpected(answer.error());
  if (StartsWithWords(*answer, fmt::format("SET {} ACK", Upper(name)))) return {};
  const auto why = Get("error", stop);
  const std::string said = why && *why != "OK" ? Clipped(*why) : "no reason given";
  return Fail(fmt::format("{} refuses \"{}\": {}", Where(address_), shown, said),
              ErrorKind::kMachine);
}

}  // namespace trammel::machine
