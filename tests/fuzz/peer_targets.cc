// Targets that read what peers send: printers, cameras, scanners, front ends.
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <stop_token>
#include <string>

#include "base/bounded_json.h"
#include "base/url_secrets.h"
#include "base/utf8.h"
#include "fuzz.h"
#include "machine/camera/camera.h"
#include "machine/camera/camera_sources.h"
#include "machine/camera/camera_url.h"
#include "machine/moonraker/client/moonraker_printer.h"
#include "machine/moonraker/client/move_log.h"
#include "machine/moonraker/client/script_watch.h"
#include "machine/moonraker/link/address.h"
#include "machine/moonraker/link/rpc.h"
#include "machine/moonraker/printer.h"
#include "machine/moonraker/taps/tap_intake.h"
#include "machine/moonraker/taps/tap_stream.h"
#include "machine/moonraker/webcam_list.h"
#include "machine/net/http.h"
#include "machine/scanner/scanner.h"
#include "panel/guard.h"
#include "panel/http_server.h"
#include "service/job_record.h"
#include "service/job_server.h"
#include "session/screen.h"
#include "sim/camera/camera_http.h"
#include "stand_ins.h"

namespace trammel::fuzz {
namespace {

// Addresses of printers and of cameras, as people and servers write them.
FUZZ_TARGET(addresses)(std::string_view text) {
  (void)machine::IsHttpUrl(std::string(text));
  const auto url = machine::ParseCameraUrl(std::string(text));
  if (Good(url)) {
    (void)nlohmann::json(url->ToString()).dump();  // throws if it is not UTF-8
    const auto again = machine::ParseCameraUrl(url->Address());
    Require(Good(again), "a camera's address can be read as it is written");
    Require(again->host == url->host && again->port == url->port, "and names the same place");
  }
  const auto address = machine::ParseMoonrakerAddress(std::string(text));
  if (!Good(address)) return;
  const auto again = machine::ParseMoonrakerAddress(address->WebSocketUrl());
  Require(Good(again), "a printer's address can be read as it is shown");
  Require(again->host == address->host && again->port == address->port &&
              again->unix_path == address->unix_path,
          "and names the same place");
  if (address->transport != machine::Transport::kUnix) {
    (void)address->HttpUrl();
    (void)address->Authority();
  }
}

// A camera's whole answer: head, parts, frames. The first byte says in how large pieces it comes.
FUZZ_TARGET(camera_stream)(std::string_view text) {
  if (text.empty()) return;
  SetStream(text.substr(1), 1 + Bytes(text)[0]);
  const std::stop_token never;
  auto camera = machine::OpenMjpegStream("http://camera/stream", machine::CameraOptions{}, never);
  if (!Good(camera)) return;
  for (;;) {
    const auto frame = (*camera)->Next(1, never);
    (void)(*camera)->Describe();
    if (!Good(frame) || !*frame) return;
    Require((*frame)->fault == machine::FrameFault::kNotAnImage || (*frame)->width_px >= 1,
            "a picture has a size");
  }
}

// The head of an HTTP answer, and a body in chunks.
FUZZ_TARGET(http_head)(std::string_view text) {
  const auto parts = Parts(text, 2);
  if (const auto head = machine::ParseHttpHead(parts[0]); Good(head)) {
    Require(head->status >= 100 && head->status <= 999, "a status has three digits");
    for (const auto& [name, value] : head->fields) {
      if (name == "content-type") (void)machine::MultipartBoundary(value);
    }
  }
  machine::ChunkDecoder chunks;
  std::vector<std::uint8_t> body;
  constexpr std::size_t kPiece = 7;  // chunks end anywhere in what a read brings
  std::span<const std::uint8_t> rest = Bytes(parts[1]);
  while (!rest.empty()) {
    const std::size_t count = std::min(kPiece, rest.size());
    if (!Good(chunks.Decode(rest.first(count), body))) break;
    rest = rest.subspan(count);
  }
  Require(body.size() <= parts[1].size(), "a body is no longer than what brought it");
}

/// No wait is ever worth it: all that comes has come.
machine::WaitLimit Now() { return {1e-9, {}}; }

void RequireSense(const machine::PrinterState& state) {
  for (const double position_mm : state.position_mm) {
    Require(std::isfinite(position_mm), "a position is finite");
  }
  for (const auto& [name, heater] : state.heaters) {
    Require(std::isfinite(heater.temperature_c) && std::isfinite(heater.target_c),
            "a temperature is finite");
  }
}

// Whatever a Moonraker sends: answers, notifications, status updates, moves, requests.
FUZZ_TARGET(moonraker_messages)(std::string_view text) {
  SetMessages(text);
  machine::MoonrakerPrinter printer(*machine::ParseMoonrakerAddress("localhost"), {});
  printer.OnRequest([](const std::string& method, const nlohmann::json& params) {
    return method == "status" ? machine::RpcAnswer{.result = params}
                              : machine::RpcAnswer::UnknownMethod(method);
  });
  (void)Good(printer.Start(Now()));
  (void)Good(printer.RegisterRemoteMethod(
      "trammel_call", [](const nlohmann::json&) {}, Now()));
  (void)Good(printer.Run("G28\nLASER_ON", Now()));
  if (Good(printer.RecordMoves(Now()))) (void)Good(printer.Moves(0, 1, Now()));
  const auto state = printer.State(Now());
  if (Good(state)) RequireSense(*state);
  const auto clock = printer.Clock(1, Now());
  if (Good(clock)) (void)clock->PrintTimeBound(0);
  (void)Good(printer.HasCommand("laser_on", Now()));
  (void)Good(printer.Webcams(Now()));
  RequireSense(printer.LastState());
}

// Batches of moves and of forces, a JSON text a line, as a printer streams them.
FUZZ_TARGET(move_log)(std::string_view text) {
  constexpr std::size_t kCapacity = 50;
  machine::MoveLog log(kCapacity);
  machine::TapIntake intake({
      .on_tap = [](const nlohmann::json& tap,
                   double) { Require(tap.is_object(), "a tap is an object"); },
      .on_firmware_z = [](double z_mm,
                          double) { Require(std::isfinite(z_mm), "a height is finite"); },
      .on_call = [](const nlohmann::json&, double) {},
      .on_news = [](const std::string& news) { Require(!news.empty(), "news say something"); },
  });
  for (double now_s = 0; !text.empty(); now_s += 1) {
    const std::string_view line = TakeUntil(text, "\n");
    if (line.empty()) continue;
    const auto json = nlohmann::json::parse(line.substr(1), nullptr, false);
    switch (line[0]) {
      case 'm':
        log.Add(json);
        intake.TakeMoves(json, now_s);
        break;
      case 'f':
        intake.TakeForces(json, now_s);
        break;
      case 't':
        intake.TakeTap(json, now_s);
        break;
      case 's':
        intake.TakeStatus(json, now_s, false);
        break;
      case 'r':
        intake.Restart();
        break;
      case 'o':
        (void)machine::FirstLoadCell(json);
        break;
      default:
        intake.TakeLine(std::string(line), now_s);
    }
  }
  const auto moves = log.Overlapping(-1e300, 1e300);
  Require(moves.size() <= kCapacity, "no more moves are kept than there is room for");
  (void)log.Reaches(0);
}

// The parts of a camera's stream. The first byte says in how large pieces they come.
FUZZ_TARGET(multipart_stream)(std::string_view text) {
  if (text.size() < 2) return;
  const std::size_t piece = 1 + Bytes(text)[0];
  const auto parts = Parts(text.substr(1), 2);
  const auto boundary = machine::MultipartBoundary(parts[0]);
  machine::MultipartLimits limits;
  limits.preamble_bytes = 200;
  limits.header_bytes = 300;
  limits.body_bytes = 1000;
  machine::MultipartReader reader(boundary.value_or(""), limits);
  machine::FrameChecker checker;
  const auto take = [&](machine::MultipartPart part) {
    machine::CapturedFrame frame;
    frame.arrival_s = part.arrival_s;
    frame.image = std::move(part.body);
    machine::ReadFrameFields(part.fields, frame);
    checker.Check(frame);
  };
  std::span<const std::uint8_t> rest = Bytes(parts[1]);
  std::size_t bytes = 0;
  for (double now_s = 0; !rest.empty(); now_s += 1) {
    const std::size_t count = std::min(piece, rest.size());
    reader.Feed(rest.first(count), now_s);
    rest = rest.subspan(count);
    for (;;) {
      auto part = reader.Take();
      if (!Good(part)) return;
      if (!*part) break;
      bytes += (*part)->body.size();
      Require((*part)->arrival_s <= now_s, "a part comes with its bytes, not before");
      take(std::move(**part));
    }
  }
  if (auto last = reader.TakeRest()) {
    bytes += last->body.size();
    take(std::move(*last));
  }
  Require(bytes <= text.size(), "parts are no longer than what brought them");
}

// Text that comes from peers and people, as it is cleaned, shown and judged.
FUZZ_TARGET(outside_text)(std::string_view text) {
  const std::string clean = Utf8OrReplaced(text);
  (void)nlohmann::json(clean).dump();  // throws where it is not UTF-8
  Require(Utf8OrReplaced(clean) == clean, "what is clean stays as it is");
  constexpr std::size_t kMax = 40;
  constexpr std::size_t kEllipsis = 3;
  const std::string cut = Utf8OrReplaced(text, kMax);
  (void)nlohmann::json(cut).dump();
  Require(cut.size() <= kMax + kEllipsis, "what is cut is short");
  const std::string shown = EscapedForTerminal(text);
  (void)nlohmann::json(shown).dump();
  for (const char c : shown) {
    const auto byte = static_cast<unsigned char>(c);
    Require(byte >= 0x20 ? byte != 0x7F : c == '\n' || c == '\t',
            "a terminal gets no control character");
  }
  Require(IncompleteUtf8(text) <= 3, "at most three bytes begin a character");
  const std::string told = WithoutSecrets(text);
  Require(WithoutSecrets(told) == told, "what holds no secret any more stays as it is");
  (void)sim::IsOwnHost(text);
  (void)sim::IsOwnOrigin(text);
}

// The list of a scanner's options, as scanimage prints it.
FUZZ_TARGET(scanner_options)(std::string_view text) {
  machine::ScannerOptions options;
  const std::size_t size = text.size();
  while (!text.empty()) {
    options.Add(TakeUntil(text, "\n"));
  }
  for (const char* name : {"mode", "resolution", "x", "three-pass"}) {
    const machine::ScannerOption* option = options.Find(name);
    if (option == nullptr) continue;
    Require(option->Values().size() <= 2 * size + 100, "values come from the text");
    for (const std::string& choice : option->choices) {
      Require(option->range || option->Takes(std::string_view(choice)),
              "an option takes each of its choices");
    }
  }
}

// Messages of a printer while a script runs: the script, then its console, line by line.
FUZZ_TARGET(script_answers)(std::string_view text) {
  const auto parts = Parts(text, 2);
  machine::MessageLog log(3);
  machine::ScriptWatch watch(std::string(parts[0]), std::set<std::string>{"LASER_ON"});
  std::string_view rest = parts[1];
  while (!rest.empty()) {
    const std::string line(TakeUntil(rest, "\n"));
    watch.OnResponse(line);
    (void)machine::ProbeResult(line);
    log.Add(machine::MessageDirection::kIn, line);
  }
  (void)watch.Verdict();
  (void)machine::BlamedLine(parts[0], parts[1]);
  Require(log.All().size() <= 3 && log.Excerpt(2).size() < 1000, "the log stays short");
}

service::JobServerOptions Options() {
  service::JobKind kind;
  kind.name = "measure";
  kind.arguments = {"filament"};
  kind.check = [](const service::PrinterPlace&, const service::Arguments&, machine::Printer*) {
    return Result<service::Offer>(service::Offer{"Is the bed empty?"});
  };
  kind.answer = [](const std::string&) -> Result<service::AnswerSummary> { return Fail("none"); };
  service::JobServerOptions options;
  options.address = "localhost";
  options.recordings = "/no/such/folder";
  options.state_folder = "/no/such/folder";
  options.jobs = {kind};
  options.utc_now = [] { return std::string("2026-01-02T03:04:05Z"); };
  options.log = [](const std::string&) {};
  return options;
}

// Requests of front ends and programs to a service, while it has no printer.
FUZZ_TARGET(serve_request)(std::string_view text) {
  static service::JobServer server(Options());
  const auto parsed = ParseBoundedJson(text, "the request");
  if (!parsed || !parsed->is_object()) return;
  const auto method = parsed->find("method");
  if (method == parsed->end() || !method->is_string()) return;
  const machine::RpcAnswer answer =
      server.Answer(method->get<std::string>(), parsed->value("params", nlohmann::json::object()));
  if (answer.kind == machine::RpcAnswer::Kind::kError) {
    Require(answer.code != 0 && !answer.message.empty(), "a refusal says why");
  } else {
    Require(answer.kind == machine::RpcAnswer::Kind::kResult && !answer.result.is_null(),
            "an answer is a result or an error");
  }
}

// The head of a browser's request to the panel: method, host, origin, content type, path, address.
FUZZ_TARGET(panel_request)(std::string_view text) {
  const auto parts = Parts(text, 6);
  const panel::RequestHead head{
      .method = parts[0], .host = parts[1], .origin = parts[2], .content_type = parts[3]};
  const auto denial = panel::CheckRequest(head, {});
  Require(!denial || (denial->status >= 400 && !denial->message.empty()), "a refusal says why");
  if (!denial) {
    const std::string policy = panel::ContentSecurityPolicy(panel::HostName(head.host));
    Require(policy.find('\n') == std::string::npos && policy.find('\r') == std::string::npos,
            "a header is one line");
  }
  panel::HttpRequest request;
  if (panel::ParseTarget(parts[4], request)) {
    Require(request.path.starts_with('/') && request.path.find("..") == std::string::npos &&
                request.path.find('\0') == std::string::npos,
            "a path stays below the root");
  }
  (void)panel::IsNearby(parts[5]);
}

// Stored state of a printer in a service, and its jobs' progress lines.
FUZZ_TARGET(serve_state)(std::string_view text) {
  if (const auto progress = procedure::ParseProgressLine(text)) {
    const std::string line = procedure::ProgressLine(*progress);
    Require(line.find('\n') == std::string::npos, "progress is one line");
    const auto again = procedure::ParseProgressLine(line);
    Require(again && again->text == progress->text && again->done == progress->done,
            "progress reads back as it was said");
  }
  const auto state = service::ParseKeptState(text, "state");
  if (!Good(state)) return;
  if (state->run) {
    Require(service::IsRunId(state->run->id), "a run has a name that can stand in a path");
    Require(state->run->complete(), "no run of an earlier service goes on");
  }
}

// Whatever a Moonraker sends to who waits for taps, behind the first byte.
FUZZ_TARGET(tap_messages)(std::string_view text) {
  if (text.empty()) return;
  SetMessages(text.substr(1));
  machine::TapStreamOptions options;
  options.remote_method = "trammel_tap";
  const machine::TapStreamEvents events{
      .on_tap = [](const nlohmann::json& tap,
                   double) { Require(tap.is_object(), "a tap is an object"); },
      .on_firmware_z = [](double z_mm,
                          double) { Require(std::isfinite(z_mm), "a height is finite"); },
      .on_call = [](const nlohmann::json&, double) {},
      .on_news = [](const std::string&) {},
  };
  auto stream = machine::OpenTapStream(options, events, {1e-9, {}});
  if (!Good(stream)) return;
  (*stream)->Send("TRAMMEL_TAP");
  const auto nozzle_c = (*stream)->NozzleTemperature();
  Require(!nozzle_c || std::isfinite(*nozzle_c), "a temperature is finite");
}

// A server's list of webcams: the printer's address, then the answer.
FUZZ_TARGET(webcam_list)(std::string_view text) {
  const auto parts = Parts(text, 2);
  auto address = machine::ParseMoonrakerAddress(parts[0]);
  if (!address) address = machine::ParseMoonrakerAddress("localhost");
  const auto answer = nlohmann::json::parse(parts[1], nullptr, false);
  for (const machine::Webcam& webcam : machine::ReadWebcams(answer, *address)) {
    (void)Good(machine::ParseCameraUrl(webcam.stream_url));
  }
}

}  // namespace
}  // namespace trammel::fuzz
