#include "machine/moonraker/klipper_taps.h"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/bounded_json.h"
#include "machine/moonraker/moonraker_connection.h"
#include "machine/moonraker/tap_intake.h"
#include "machine/net/host_clock.h"
#include "machine/net/json_field.h"

namespace trammel::machine {
namespace {

using nlohmann::json;

constexpr double kAgain_s = 1;
constexpr int kMostTries = 5;  // of one question, on one connection

class KlipperTaps : public TapStream {
 public:
  KlipperTaps(const MoonrakerAddress& address, const MoonrakerOptions& options,
              std::string remote_method, TapStreamEvents events)
      : remote_method_(std::move(remote_method)),
        intake_(std::move(events)),
        connection_(address, options,
                    {.on_open =
                         [this] {
                           ++link_number_;
                           AskState();
                         },
                     .on_message = [this](std::string_view text) { OnMessage(text); },
                     .on_down = [this](const Error& error) { OnDown(error); }}) {}

  /// Waits for the first connection, not for a printer that is ready.
  Result<void> Start(const WaitLimit& limit) {
    connection_.Connect();
    std::unique_lock lock(mutex_);
    const bool known =
        changed_.wait_for(lock, limit.stop, std::chrono::duration<double>(limit.time_limit_s),
                          [this] { return opened_ || failed_; });
    if (opened_) return {};
    if (failed_) return tl::unexpected(*failed_);
    return Fail(known || !limit.stop.stop_requested() ? "Klipper's socket did not answer"
                                                      : "stopped while connecting",
                limit.stop.stop_requested() ? ErrorKind::kInterrupted : ErrorKind::kMachine);
  }

  void Send(const std::string& script) override {
    Call("gcode/script", {{"script", script}}, [](const json&) {});
  }

  std::optional<double> NozzleTemperature() const override { return intake_.temperature_c(); }

 private:
  using Done = std::function<void(const json& result)>;
  using Failed = std::function<void(const std::string& why)>;
  struct Waiting {
    std::string method;
    Done done;
    Failed failed;
  };

  /// Errors become news where nobody wants them.
  void Call(const std::string& method, json params, Done done, Failed failed = {}) {
    std::int64_t id = 0;
    {
      const std::lock_guard lock(mutex_);
      id = next_id_++;
      calls_[id] = {method, std::move(done), std::move(failed)};
    }
    const json message = {{"id", id}, {"method", method}, {"params", std::move(params)}};
    if (auto sent = connection_.Send(message.dump(-1, ' ', false, json::error_handler_t::replace));
        !sent) {
      intake_.Tell(fmt::format("{}: {}", method, sent.error().message));
    }
  }

  /// Asks once more after a while where it is refused, on the same connection; in the end says why.
  void Ask(const std::string& method, const json& params, const Done& done, int tries = 1) {
    Call(method, params, done, [=, this, link = link_number_](const std::string& why) {
      if (tries >= kMostTries) {
        return intake_.Tell(fmt::format("{}: {} (asked {} times)", method, why, tries));
      }
      connection_.RunAfter(kAgain_s, [=, this] {
        if (link == link_number_) Ask(method, params, done, tries + 1);
      });
    });
  }

  void AskState() {
    Ask("info", {{"client_info", {{"program", "trammel"}}}}, [this](const json& info) {
      {
        const std::lock_guard lock(mutex_);
        opened_ = true;
        changed_.notify_all();
      }
      if (TextOr(info, "state", "") == "ready") return Subscribe();
      connection_.RunAfter(kAgain_s, [this, link = link_number_] {
        if (link == link_number_) AskState();
      });
    });
  }

  void Subscribe() {
    intake_.Restart();
    Ask("objects/list", json::object(), [this](const json& result) {
      const json* objects = Member(result, "objects");
      const auto cell = FirstLoadCell(objects == nullptr ? json() : *objects);
      if (!cell) return intake_.Tell("the printer has no [load_cell_probe] and no [load_cell]");
      if (cell->probe) Dump("load_cell_probe/dump_taps", "load_cell_probe", cell->name, "taps");
      Dump("load_cell/dump_force", "load_cell", cell->name, "forces");
      Dump("motion_report/dump_trapq", "name", "toolhead", "moves");
    });
    Ask("objects/query", {{"objects", {{"configfile", {"settings"}}}}},
        [this](const json& result) { intake_.TakeSettings(ObjectOr(result, "status")); });
    Ask("objects/subscribe",
        {{"objects",
          {{"probe", {"last_z_result", "last_probe_position"}}, {"extruder", {"temperature"}}}},
         {"response_template", {{"method", "status"}}}},
        [this](const json& result) {
          intake_.TakeStatus(ObjectOr(result, "status"), HostNow(), true);
        });
    Ask("gcode/subscribe_output", {{"response_template", {{"method", "output"}}}},
        [](const json&) {});
    if (remote_method_.empty()) return;
    Ask("register_remote_method",
        {{"remote_method", remote_method_}, {"response_template", {{"method", "call"}}}},
        [](const json&) {});
  }

  void Dump(const std::string& method, const char* key, const std::string& name,
            const char* answer_to) {
    Ask(method, {{key, name}, {"response_template", {{"method", answer_to}}}},
        [this, taps = answer_to == std::string_view("taps")](const json&) {
          if (taps) intake_.ExpectTaps();
        });
  }

  void OnMessage(std::string_view text) {
    const double received_s = HostNow();
    const Result<json> parsed = ParseBoundedJson(text, "the message");
    if (!parsed || !parsed->is_object()) {
      connection_.Drop({ErrorKind::kMachine,
                        fmt::format("the socket sent something that is no message of Klipper ({})",
                                    parsed ? "it is no object" : parsed.error().message)});
      return;
    }
    const json& message = *parsed;
    if (const json* id = Member(message, "id"); id != nullptr && id->is_number_integer()) {
      return OnAnswer(id->get<std::int64_t>(), message);
    }
    const std::string method = TextOr(message, "method", "");
    const json& params = ObjectOr(message, "params");
    if (method == "taps") {
      intake_.TakeTap(params, received_s);
    } else if (method == "forces") {
      intake_.TakeForces(params, received_s);
    } else if (method == "moves") {
      intake_.TakeMoves(params, received_s);
    } else if (method == "status") {
      intake_.TakeStatus(ObjectOr(params, "status"), received_s, false);
    } else if (method == "output") {
      intake_.TakeLine(TextOr(params, "response", ""), received_s);
    } else if (method == "call") {
      if (intake_.MissesMoves()) Dump("motion_report/dump_trapq", "name", "toolhead", "moves");
      intake_.TakeCall(params, received_s);
    }
  }

  void OnAnswer(std::int64_t id, const json& message) {
    Waiting call;
    {
      const std::lock_guard lock(mutex_);
      const auto found = calls_.find(id);
      if (found == calls_.end()) return;
      call = std::move(found->second);
      calls_.erase(found);
    }
    if (const json* result = Member(message, "result")) return call.done(*result);
    const std::string why = TextOr(ObjectOr(message, "error"), "message", "no result");
    call.failed ? call.failed(why) : intake_.Tell(fmt::format("{}: {}", call.method, why));
  }

  void OnDown(const Error& error) {
    ++link_number_;
    {
      const std::lock_guard lock(mutex_);
      calls_.clear();
      if (!opened_) {
        failed_ = error;
        changed_.notify_all();
        return;
      }
    }
    intake_.Tell(error.message);
    connection_.RunAfter(kAgain_s, [this] { connection_.Connect(); });
  }

  const std::string remote_method_;
  TapIntake intake_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool opened_ = false;
  std::optional<Error> failed_;
  std::int64_t next_id_ = 1;
  std::map<std::int64_t, Waiting> calls_;
  std::uint64_t link_number_ = 0;   // of the connection's thread
  MoonrakerConnection connection_;  // last: its thread uses all the rest
};

}  // namespace

Result<std::unique_ptr<TapStream>> OpenKlipperTaps(const std::string& socket,
                                                   const std::string& remote_method,
                                                   TapStreamEvents events, const WaitLimit& limit) {
  MoonrakerOptions options;
  options.address = "unix:" + socket;
  const auto address = ParseMoonrakerAddress(options.address);
  if (!address) return tl::unexpected(address.error());
  auto stream = std::make_unique<KlipperTaps>(*address, options, remote_method, std::move(events));
  if (auto started = stream->Start(limit); !started) return tl::unexpected(started.error());
  return stream;
}

}  // namespace trammel::machine
