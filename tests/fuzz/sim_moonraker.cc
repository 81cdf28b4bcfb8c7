// What clients send to the virtual Moonraker: a message a line; a line that begins with # asks over
// HTTP ("#METHOD target", a header, "|", the body); an empty line lets a moment pass.
#include <cctype>
#include <nlohmann/json.hpp>
#include <string>

#include "fuzz.h"
#include "sim/camera/machine_host.h"
#include "sim/moonraker/http_api.h"
#include "sim/moonraker/hub.h"

namespace {

using namespace trammel;

class Client : public sim::Peer {
 public:
  void Send(const std::string& message) override {
    fuzz::Require(nlohmann::json::accept(message), "a server sends JSON");
  }
  void Close() override { closed = true; }
  bool closed = false;
};

std::string Word(std::string_view& text, char end) {
  const std::size_t at = std::min(text.find(end), text.size());
  std::string word(text.substr(0, at));
  text.remove_prefix(std::min(at + 1, text.size()));
  return word;
}

void Ask(sim::Hub& hub, std::string_view text) {
  sim::HttpRequest request;
  std::string head = Word(text, '|');
  std::string_view rest = head;
  request.method = Word(rest, ' ');
  request.target = Word(rest, ' ');
  std::string name = Word(rest, ':');
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  request.headers[name] = std::string(rest);
  request.body = std::string(text);
  (void)sim::IsAuthorised(hub, request);
  sim::AnswerHttp(hub, request, [](const sim::HttpResponse& response) {
    fuzz::Require(response.status >= 100 && response.status < 600, "an answer has a status");
  });
}

}  // namespace

TRAMMEL_FUZZ_TARGET(sim_moonraker)(const std::uint8_t* data, std::size_t size) {
  sim::MachineHost machine({}, 0);
  sim::HubOptions options;
  options.api_key = "key";
  Client client;
  Client stranger;
  sim::Hub hub(machine, options);
  const auto number = hub.Open(client, true);
  const auto other = hub.Open(stranger, false);
  constexpr double kMoment_s = 0.26;
  constexpr int kMostMoments = 4;
  double now_s = 0;
  hub.Tick(now_s += kMoment_s);
  std::string_view text = fuzz::Text(data, size);
  while (!text.empty()) {
    const std::string line = Word(text, '\n');
    if (line.empty()) {
      if (now_s < kMostMoments * kMoment_s) hub.Tick(now_s += kMoment_s);
    } else if (line[0] == '#') {
      Ask(hub, std::string_view(line).substr(1));
    } else if (line[0] == '?' && other && !stranger.closed) {
      hub.Receive(*other, std::string_view(line).substr(1));
    } else if (number && !client.closed) {
      hub.Receive(*number, line);
    }
  }
  hub.Tick(now_s + kMoment_s);
  hub.Abandon();
  return 0;
}
