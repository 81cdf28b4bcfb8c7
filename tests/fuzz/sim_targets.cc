// Targets of the virtual machines: what clients send them.
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "fuzz.h"
#include "sim/camera/camera_http.h"
#include "sim/camera/machine_host.h"
#include "sim/klipper/commands.h"
#include "sim/klipper/config.h"
#include "sim/klipper/machine.h"
#include "sim/moonraker/http_api.h"
#include "sim/moonraker/hub.h"
#include "sim/print/gcode_interpreter.h"
#include "sim/print/planner.h"
#include "sim/sheet/sheet_firmware.h"
#include "sim/sheet/sheet_gcode.h"
#include "sim/spindle/mill.h"

namespace trammel::fuzz {
namespace {

// Requests of clients to the virtual camera, and the target of a request to the virtual Moonraker.
FUZZ_TARGET(sim_camera_request)(std::string_view text) {
  (void)sim::ParseTarget(text);
  const sim::Target target = sim::ParseTarget(std::string(text));
  Require(target.path.size() <= text.size(), "a path is part of its target");
}

// G-code that the virtual printer prints: interpreted, and its motion planned.
FUZZ_TARGET(sim_gcode)(std::string_view text) {
  const auto program = sim::InterpretGcode(text, {});
  if (!Good(program)) return;
  double end_s = 0;
  for (const sim::TimedMove& timed : sim::PlanMotion(program->moves)) {
    Require(std::isfinite(timed.end_s()) && timed.start_s >= end_s - 1e-6,
            "moves follow each other in time");
    end_s = timed.end_s();
  }
}

sim::KlipperConfig Config() {
  sim::KlipperConfig config = sim::DefaultKlipperConfig();
  config.load_cell.emplace();
  sim::AddTapMacros(config);
  config.tools.resize(2);
  // So quick that homing and heating end while an input lasts.
  config.physical_start_mm = {1, 1, 1};
  config.homing_speed_mm_s = {500, 500, 100};
  config.nozzle.rate_c_s = config.bed.rate_c_s = 2000;
  config.nozzle.settle_s = config.bed.settle_s = 0.01;
  config.restart_s = 0.1;
  return config;
}

// Scripts that clients send to the virtual Klipper, parted by empty lines.
FUZZ_TARGET(sim_klipper)(std::string_view text) {
  static const sim::KlipperConfig config = Config();
  sim::VirtualKlipper klipper(config, {});
  constexpr double kTick_s = 0.12;
  constexpr int kMaxScripts = 8;
  double now_s = kTick_s;
  klipper.Advance(now_s);
  for (int i = 0; i < kMaxScripts && !text.empty(); ++i) {
    const std::string script(TakeUntil(text, "\n\n"));
    klipper.files()["job.gcode"] = script;
    (void)klipper.RunScript(script);
    klipper.Advance(now_s += kTick_s);
    for (const sim::KlipperEvent& event : klipper.TakeEvents()) {
      Require(!event.error || !event.error->empty(), "a script that fails says why");
    }
  }
  const sim::HeadState head = klipper.TrueHead(now_s);
  (void)head;
}

// Requests to the virtual mill.
FUZZ_TARGET(sim_mill)(std::string_view text) {
  const sim::MillOptions options;
  sim::VirtualMill mill(options);
  const std::size_t size = text.size();
  double now_s = 0;
  while (!text.empty()) {
    const std::string answer = mill.Answer(std::string(TakeUntil(text, "\n")), now_s);
    constexpr std::size_t kFacts = 1000;  // bytes of its longest answer
    Require(answer.size() <= 6 * size + kFacts, "an answer is not much longer than its line");
    constexpr double kStep_s = 0.25;
    now_s += kStep_s;
    const sim::MillPlace at = mill.At(now_s);
    for (std::size_t i = 0; i < 3; ++i) {
      Require(at.stated_mm[i] >= options.travel_low_mm[i] &&
                  at.stated_mm[i] <= options.travel_high_mm[i],
              "the axes stay within their limits");
    }
    Require(std::isfinite(at.c_deg), "C is somewhere");
  }
}

class Client : public sim::Peer {
 public:
  void Send(const std::string& message) override {
    Require(nlohmann::json::accept(message), "a server sends JSON");
  }
  void Close() override { closed = true; }
  bool closed = false;
};

void Ask(sim::Hub& hub, std::string_view text) {
  sim::HttpRequest request;
  std::string head = std::string(TakeUntil(text, "|"));
  std::string_view rest = head;
  request.method = std::string(TakeUntil(rest, " "));
  request.target = std::string(TakeUntil(rest, " "));
  std::string name = std::string(TakeUntil(rest, ":"));
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  request.headers[name] = std::string(rest);
  request.body = std::string(text);
  (void)sim::IsAuthorised(hub, request);
  sim::AnswerHttp(hub, request, [](const sim::HttpResponse& response) {
    Require(response.status >= 100 && response.status < 600, "an answer has a status");
  });
}

// Messages of clients to the virtual Moonraker: a message a line; a line that begins with # is an
// HTTP request ("#METHOD target", a header, "|", the body); an empty line lets a moment pass.
FUZZ_TARGET(sim_moonraker)(std::string_view text) {
  sim::MachineHost machine({}, 0);
  sim::HubOptions options;
  options.api_key = "key";
  Client client;
  Client stranger;
  sim::Hub hub(machine, options);
  const auto number = hub.Open(client, true);
  const auto other = hub.Open(stranger, false);
  constexpr double kMoment_s = 0.26;
  constexpr int kMaxMoments = 4;
  double now_s = 0;
  hub.Tick(now_s += kMoment_s);
  while (!text.empty()) {
    const std::string line = std::string(TakeUntil(text, "\n"));
    if (line.empty()) {
      if (now_s < kMaxMoments * kMoment_s) hub.Tick(now_s += kMoment_s);
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
}

// An upload to the virtual Moonraker: the content type, then the body.
FUZZ_TARGET(sim_multipart)(std::string_view text) {
  const auto parts = Parts(text, 2);
  const auto form = sim::ParseMultipart(parts[0], parts[1]);
  if (!Good(form)) return;
  std::size_t bytes = 0;
  for (const sim::FormPart& part : *form) bytes += part.body.size();
  Require(bytes <= parts[1].size(), "parts are no longer than what brought them");
}

// G-code of a sheet of tool offsets, as each firmware takes it, with macros of the machine's own:
// the macros' configuration, then the file.
FUZZ_TARGET(sim_sheet_gcode)(std::string_view text) {
  const auto parts = Parts(text, 2);
  sim::SheetSetup setup;
  setup.firmware = sim::GuessSheetFirmware(parts[1]);
  setup.tool_commands = {"PICK {tool}"};
  auto macros = sim::ParseSheetMacros(parts[0]);
  if (Good(macros)) setup.macros = std::move(*macros);
  (void)Good(sim::InterpretSheet(parts[1], setup));
}

}  // namespace
}  // namespace trammel::fuzz
