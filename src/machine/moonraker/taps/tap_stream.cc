#include "machine/moonraker/taps/tap_stream.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string_view>

#include "machine/moonraker/client/klippy_streams.h"
#include "machine/moonraker/client/moonraker.h"
#include "machine/moonraker/link/address.h"
#include "machine/moonraker/taps/tap_intake.h"
#include "machine/net/json_field.h"

namespace trammel::machine {
namespace {

using nlohmann::json;

constexpr double kListen_s = 1.5;  // forces come ten times a second
constexpr int kMaxTries = 5;       // per stream and Klipper session

class MoonrakerTaps : public TapStream {
 public:
  MoonrakerTaps(const MoonrakerAddress& address, const TapStreamOptions& options,
                TapStreamEvents events)
      : remote_method_(options.remote_method),
        ask_again_s_(options.ask_again_s),
        options_(options.moonraker),
        prefix_(options.moonraker.client_name + "_tap_"),
        intake_(std::move(events)),
        moonraker_(address, options.moonraker,
                   {.on_usable = [this](std::function<void()> done) { OnUsable(std::move(done)); },
                    .on_notification =
                        [this](const std::string& method, const json& params, double received_s) {
                          OnMessage(method, params, received_s);
                        },
                    .on_readiness =
                        [this](PrinterReadiness readiness, const std::string& message) {
                          if (readiness == PrinterReadiness::kDisconnected) ++session_;
                          intake_.Notify(fmt::format("the printer is {}{}{}", ToString(readiness),
                                                     message.empty() ? "" : ": ", message));
                        }}) {}

  ~MoonrakerTaps() override {
    std::unique_ptr<KlippyStreams> last;  // ends while there is a connection to hand batches to
    const std::lock_guard lock(streams_mutex_);
    ending_ = true;
    last.swap(streams_);
  }

  Result<void> Start(const WaitLimit& limit) {
    TRY(moonraker_.Start(limit));
    TRY(RegisterStreams(limit));
    if (!remote_method_.empty()) {
      auto done = moonraker_.RegisterRemoteMethod(remote_method_, limit);
      if (!done && IsTaken(done.error())) {
        return Fail(fmt::format("another trammel answers this printer's taps already: end that "
                                "`tap watch --answer`, or start this one without --answer ({})",
                                done.error().message),
                    done.error().kind);
      }
      if (!done) return done;
    }
    moonraker_.RunAfter(0, [this] {
      registered_ = true;
      Subscribe([] {});
    });
    return {};
  }

  void Send(const std::string& script) override {
    moonraker_.CallLater(
        "printer.gcode.script", {{"script", script}}, [this](const RpcAnswer& answer) {
          if (answer.kind == RpcAnswer::Kind::kResult) return;
          intake_.Notify(moonraker_.ToError("printer.gcode.script", answer).message);
        });
  }

  std::optional<double> NozzleTemperature() const override { return intake_.temperature_c(); }

 private:
  static bool IsTaken(const Error& error) {
    return error.message.find("already registered") != std::string::npos;
  }

  /// Uses the same names in every run: a subscription through Moonraker outlives the process, and
  /// the next run receives it. If another running trammel has them, ours end in a number.
  Result<void> RegisterStreams(const WaitLimit& limit) {
    constexpr int kMaxNames = 9;
    const std::string plain = prefix_;
    for (int number = 1;; ++number) {
      prefix_ = number == 1 ? plain : fmt::format("{}{}_", plain, number);
      auto first = moonraker_.RegisterRemoteMethod(prefix_ + "forces", limit);
      if (first) break;
      if (!IsTaken(first.error()) || number == kMaxNames) return first;
    }
    for (const char* stream : {"taps", "moves"}) {
      TRY(moonraker_.RegisterRemoteMethod(prefix_ + stream, limit));
    }
    return {};
  }

  void OnUsable(std::function<void()> done) {
    intake_.Restart();
    // During the first connection there is no method yet that could receive data.
    registered_ ? Subscribe(done) : done();
  }

  void Subscribe(const std::function<void()>& done) {
    ++session_;
    FindCell(1);
    SubscribeToStatus(1, done);
  }

  /// Retries after a while, unless Klipper's session has changed meanwhile. Finally reports the
  /// reason.
  void AskAgain(int tries, const std::string& why, std::function<void(int tries)> ask) {
    if (tries >= kMaxTries) {
      return intake_.Notify(
          fmt::format("the load cell's data do not come: {} (asked {} times; asked again when "
                      "Klipper restarts)",
                      why, tries));
    }
    moonraker_.RunAfter(ask_again_s_, [this, tries, ask = std::move(ask), session = session_] {
      if (session == session_) ask(tries + 1);
    });
  }

  void FindCell(int tries) {
    moonraker_.CallLater(
        "printer.objects.list", nullptr,
        [this, tries, session = session_](const RpcAnswer& answer) {
          if (session != session_) return;
          if (answer.kind != RpcAnswer::Kind::kResult) {
            return AskAgain(tries, "printer.objects.list: " + answer.message,
                            [this](int next) { FindCell(next); });
          }
          const json* objects = Member(answer.result, "objects");
          const auto cell = FirstLoadCell(objects == nullptr ? json() : *objects);
          if (!cell)
            return intake_.Notify("the printer has no [load_cell_probe] and no [load_cell]");
          AskSettings(1);
          SubscribeTo(*cell, 1);
        });
  }

  void AskSettings(int tries) {
    moonraker_.CallLater("printer.objects.query", {{"objects", {{"configfile", {"settings"}}}}},
                         [this, tries, session = session_](const RpcAnswer& answer) {
                           if (session != session_) return;
                           if (answer.kind != RpcAnswer::Kind::kResult) {
                             return AskAgain(tries, "printer.objects.query: " + answer.message,
                                             [this](int next) { AskSettings(next); });
                           }
                           intake_.TakeSettings(ObjectOr(answer.result, "status"));
                         });
  }

  void SubscribeTo(const LoadCellName& cell, int tries) {
    if (!KlippyStreams::MayWork(moonraker_.address())) return ListenFirst(cell);
    // Repeated after each restart, which may have added another cell.
    std::vector<KlippyStream> streams;
    if (cell.probe) {
      streams.push_back(
          {"load_cell_probe/dump_taps", {{"load_cell_probe", cell.name}}, prefix_ + "taps"});
    }
    streams.push_back({"load_cell/dump_force", {{"load_cell", cell.name}}, prefix_ + "forces"});
    streams.push_back({"motion_report/dump_trapq", {{"name", "toolhead"}}, prefix_ + "moves"});
    auto through = std::make_unique<KlippyStreams>(
        moonraker_.address(), options_, std::move(streams),
        [this](const std::string& method, const json& params, double received_s) {
          moonraker_.RunAfter(0, [=, this] { OnMessage(method, params, received_s); });
        },
        [this, cell, tries, session = session_](const std::optional<Error>& failed) {
          moonraker_.RunAfter(0, [=, this] {
            if (session == session_) OnThrough(failed, cell, tries);
          });
        });
    through->Begin();
    Keep(std::move(through));
  }

  /// Replaces the last streams, which end.
  void Keep(std::unique_ptr<KlippyStreams> streams) {
    const std::lock_guard lock(streams_mutex_);
    if (!ending_) streams_.swap(streams);
  }

  void OnThrough(const std::optional<Error>& failed, const LoadCellName& cell, int tries) {
    if (!failed) {
      came_through_ = true;
      if (cell.probe) intake_.ExpectTaps();
      return;
    }
    // After an earlier success, Klipper is only not ready yet.
    if (came_through_ && tries < kMaxTries) {
      return AskAgain(tries, failed->message, [this, cell](int next) { SubscribeTo(cell, next); });
    }
    if (came_through_) {
      intake_.Notify(fmt::format(
          "no connection of our own to Klipper for the load cell's data: {} (asked {} times; "
          "Moonraker is asked for them now)",
          failed->message, tries));
    }
    Keep(nullptr);
    ListenFirst(cell);
  }

  /// Checks for an existing subscription, whose forces arrive continuously.
  void ListenFirst(const LoadCellName& cell) {
    heard_ = false;
    moonraker_.RunAfter(kListen_s, [this, cell, session = session_] {
      if (session != session_) return;
      if (heard_) {
        if (cell.probe) intake_.ExpectTaps();
        return;
      }
      if (cell.probe) {
        Dump("printer.load_cell_probe.dump_taps", "load_cell_probe", cell.name, "taps", 1);
      }
      Dump("printer.load_cell.dump_force", "load_cell", cell.name, "forces", 1);
      AskForMoves();
    });
  }

  void AskForMoves() {
    {
      const std::lock_guard lock(streams_mutex_);
      if (streams_) return streams_->Reopen();
    }
    Dump("printer.motion_report.dump_trapq", "name", "toolhead", "moves", 1);
  }

  void Dump(const std::string& method, const std::string& key, const std::string& name,
            const std::string& answer_to, int tries) {
    moonraker_.CallLater(
        method, {{key, name}, {"response_template", {{"method", prefix_ + answer_to}}}},
        [=, this, session = session_](const RpcAnswer& answer) {
          if (session != session_) return;
          if (answer.kind != RpcAnswer::Kind::kResult) {
            return AskAgain(tries, fmt::format("{}: {}", method, answer.message),
                            [=, this](int next) { Dump(method, key, name, answer_to, next); });
          }
          if (answer_to == "taps") intake_.ExpectTaps();
        });
  }

  /// `done` comes with the first answer, whatever it is.
  void SubscribeToStatus(int tries, const std::function<void()>& done) {
    moonraker_.CallLater("printer.objects.subscribe",
                         {{"objects",
                           {{"webhooks", nullptr},
                            {"probe", {"last_z_result", "last_probe_position"}},
                            {"extruder", {"temperature"}}}}},
                         [this, tries, done, session = session_](const RpcAnswer& answer) {
                           if (session == session_ && answer.kind == RpcAnswer::Kind::kResult) {
                             intake_.TakeStatus(ObjectOr(answer.result, "status"),
                                                answer.received_s, true);
                           } else if (session == session_) {
                             AskAgain(tries, "printer.objects.subscribe: " + answer.message,
                                      [this](int next) { SubscribeToStatus(next, [] {}); });
                           }
                           done();
                         });
  }

  void OnMessage(const std::string& method, const json& params, double received_s) {
    if (method == "notify_status_update" && params.is_array() && !params.empty()) {
      intake_.TakeStatus(params[0], received_s, false);
    } else if (method == "notify_gcode_response" && params.is_array() && !params.empty() &&
               params[0].is_string()) {
      intake_.TakeLine(params[0].get<std::string>(), received_s);
    } else if (method == prefix_ + "taps") {
      intake_.TakeTap(params, received_s);
    } else if (method == prefix_ + "forces") {
      heard_ = true;
      intake_.TakeForces(params, received_s);
    } else if (method == prefix_ + "moves") {
      intake_.TakeMoves(params, received_s);
    } else if (!remote_method_.empty() && method == remote_method_) {
      if (intake_.MissesMoves()) AskForMoves();
      intake_.TakeCall(params, received_s);
    }
  }

  const std::string remote_method_;
  const double ask_again_s_;
  const MoonrakerOptions options_;
  std::string prefix_;  // of stream names; set before registered_
  TapIntake intake_;
  bool registered_ = false;    // this and the next of the connection's thread
  bool heard_ = false;         // forces, since the link or Klipper began
  bool came_through_ = false;  // streams, over a connection of our own to Klipper
  std::uint64_t session_ = 0;  // Klipper session; requests of earlier ones are void
  std::mutex streams_mutex_;
  bool ending_ = false;                     // guarded by the mutex
  std::unique_ptr<KlippyStreams> streams_;  // likewise; its own thread uses the rest, too
  Moonraker moonraker_;                     // last: its thread uses all others
};

}  // namespace

std::optional<ConsoleResult> ProbeResult(const std::string& line) {
  struct Sentence {
    std::string_view head, before_z;
    bool less_offset;
  };
  static constexpr std::array kSentences = {
      Sentence{"// probe at ", " is z=", false},
      Sentence{"// probe: at ", " bed will contact at z=", true}};
  for (const Sentence& sentence : kSentences) {
    const std::size_t at = line.find(sentence.before_z);
    if (!line.starts_with(sentence.head) || at == std::string::npos) continue;
    ConsoleResult result{0, sentence.less_offset};
    const char* const from = line.data() + at + sentence.before_z.size();
    const auto [stop, error] = std::from_chars(from, line.data() + line.size(), result.z_mm);
    if (error != std::errc{} || !std::isfinite(result.z_mm)) return std::nullopt;
    return result;
  }
  return std::nullopt;
}

Result<std::unique_ptr<TapStream>> OpenTapStream(const TapStreamOptions& options,
                                                 TapStreamEvents events, const WaitLimit& limit) {
  const auto address = TRY(ParseMoonrakerAddress(options.moonraker.address));
  auto stream = std::make_unique<MoonrakerTaps>(address, options, std::move(events));
  TRY(stream->Start(limit));
  return stream;
}

}  // namespace trammel::machine
