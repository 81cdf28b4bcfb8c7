#include "machine/tap_stream.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>
#include <vector>

#include "machine/json_field.h"
#include "machine/moonraker.h"
#include "machine/moonraker_address.h"
#include "machine/tap_builder.h"

namespace trammel::machine {
namespace {

using nlohmann::json;

/// The printer's load cells by their objects' names.
struct LoadCell {
  std::string name;    ///< for dump_force
  bool probe = false;  ///< also for dump_taps
};

/// "load_cell_probe" and "load_cell_probe left" are called by their last word in requests.
std::optional<LoadCell> FirstLoadCell(const json& answer) {
  std::optional<LoadCell> found;
  const json* objects = Member(answer, "objects");
  if (objects == nullptr || !objects->is_array()) return found;
  for (const json& object : *objects) {
    if (!object.is_string()) continue;
    const auto& name = object.get_ref<const std::string&>();
    const bool probe = name == "load_cell_probe" || name.starts_with("load_cell_probe ");
    const bool cell = name == "load_cell" || name.starts_with("load_cell ");
    if (!probe && !(cell && !found)) continue;
    const std::size_t blank = name.rfind(' ');
    found = LoadCell{blank == std::string::npos ? name : name.substr(blank + 1), probe};
    if (probe) break;
  }
  return found;
}

class MoonrakerTaps : public TapStream {
 public:
  MoonrakerTaps(const MoonrakerAddress& address, const TapStreamOptions& options,
                TapStreamEvents events)
      : remote_method_(options.remote_method),
        prefix_(fmt::format("{}_tap_{}_", options.moonraker.client_name, getpid())),
        events_(std::move(events)),
        moonraker_(address, options.moonraker,
                   {.on_usable = [this](std::function<void()> done) { OnUsable(std::move(done)); },
                    .on_notification =
                        [this](const std::string& method, const json& params, double received_s) {
                          OnMessage(method, params, received_s);
                        },
                    .on_readiness =
                        [this](PrinterReadiness readiness, const std::string& message) {
                          events_.on_news(fmt::format("the printer is {}{}{}", ToString(readiness),
                                                      message.empty() ? "" : ": ", message));
                        }}) {}

  Result<void> Start(const WaitLimit& limit) {
    if (auto started = moonraker_.Start(limit); !started) return started;
    for (const std::string& method :
         {prefix_ + "taps", prefix_ + "forces", prefix_ + "moves", remote_method_}) {
      if (method.empty()) continue;
      if (auto done = moonraker_.RegisterRemoteMethod(method, limit); !done) return done;
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
          events_.on_news(moonraker_.ToError("printer.gcode.script", answer).message);
        });
  }

  std::optional<double> NozzleTemperature() const override {
    const std::lock_guard lock(mutex_);
    return temperature_c_;
  }

 private:
  void OnUsable(std::function<void()> done) {
    builder_.Reset();
    // While connecting for the first time there is no method yet that could bring anything.
    registered_ ? Subscribe(std::move(done)) : done();
  }

  void Subscribe(std::function<void()> done) {
    moonraker_.CallLater("printer.objects.list", nullptr,
                         [this, done = std::move(done)](const RpcAnswer& answer) {
                           const auto cell = FirstLoadCell(answer.result);
                           if (!cell) {
                             events_.on_news(
                                 "the printer has no [load_cell_probe] and no "
                                 "[load_cell]");
                           } else {
                             SubscribeTo(*cell);
                           }
                           SubscribeToStatus(done);
                         });
  }

  void SubscribeTo(const LoadCell& cell) {
    if (cell.probe) {
      Dump("printer.load_cell_probe.dump_taps", "load_cell_probe", cell.name, "taps");
    }
    Dump("printer.load_cell.dump_force", "load_cell", cell.name, "forces");
    Dump("printer.motion_report.dump_trapq", "name", "toolhead", "moves");
  }

  void Dump(const std::string& method, const char* key, const std::string& name,
            const char* answer_to) {
    moonraker_.CallLater(method,
                         {{key, name}, {"response_template", {{"method", prefix_ + answer_to}}}},
                         [this, method](const RpcAnswer& answer) {
                           if (answer.kind != RpcAnswer::Kind::kError) return;
                           events_.on_news(fmt::format("{}: {}", method, answer.message));
                         });
  }

  void SubscribeToStatus(const std::function<void()>& done) {
    moonraker_.CallLater(
        "printer.objects.subscribe",
        {{"objects",
          {{"webhooks", nullptr}, {"probe", {"last_z_result"}}, {"extruder", {"temperature"}}}}},
        [this, done](const RpcAnswer& answer) {
          // The result of an earlier probe belongs to no tap of ours.
          if (answer.kind == RpcAnswer::Kind::kResult) {
            TakeTemperature(ObjectOr(answer.result, "status"));
          }
          done();
        });
  }

  void TakeTemperature(const json& status) {
    if (const auto temperature = Number(ObjectOr(status, "extruder"), "temperature")) {
      const std::lock_guard lock(mutex_);
      temperature_c_ = *temperature;
    }
  }

  void OnMessage(const std::string& method, const json& params, double received_s) {
    if (method == "notify_status_update" && params.is_array() && !params.empty()) {
      TakeTemperature(params[0]);
      if (const auto z = Number(ObjectOr(params[0], "probe"), "last_z_result")) {
        events_.on_firmware_z(*z, received_s);
      }
    } else if (method == "notify_gcode_response" && params.is_array() && !params.empty() &&
               params[0].is_string()) {
      if (const auto z = ProbeResult(params[0].get<std::string>())) {
        events_.on_firmware_z(*z, received_s);
      }
    } else if (method == prefix_ + "taps") {
      TakeTap(params, received_s);
    } else if (method == prefix_ + "forces") {
      builder_.AddForces(params);
      HandOnBuilt(received_s);
    } else if (method == prefix_ + "moves") {
      builder_.AddMoves(params);
      HandOnBuilt(received_s);
    } else if (!remote_method_.empty() && method == remote_method_) {
      events_.on_call(params, received_s);
    }
  }

  void TakeTap(const json& params, double received_s) {
    const json* tap = Member(params, "tap");
    const json* moves = tap == nullptr ? nullptr : Member(*tap, "moves");
    // Klipper itself sends no moves, and no pull-back either: such taps are built below.
    if (moves == nullptr || !moves->is_array() || moves->empty()) return;
    whole_taps_ = true;
    events_.on_tap(*tap, received_s);
  }

  void HandOnBuilt(double received_s) {
    for (const json& tap : builder_.Take()) {
      if (!whole_taps_) events_.on_tap(tap, received_s);
    }
  }

  const std::string remote_method_;
  const std::string prefix_;
  const TapStreamEvents events_;
  TapBuilder builder_;       // of the connection's thread
  bool whole_taps_ = false;  // of the connection's thread
  bool registered_ = false;  // of the connection's thread
  mutable std::mutex mutex_;
  std::optional<double> temperature_c_;
  Moonraker moonraker_;  // last: its thread uses all the rest
};

}  // namespace

std::optional<double> ProbeResult(const std::string& line) {
  if (!line.starts_with("//") || line.find("probe") == std::string::npos) return std::nullopt;
  const std::size_t at = line.find(" z=");
  if (at == std::string::npos) return std::nullopt;
  double z_mm = 0;
  const char* const end = line.data() + line.size();
  const auto [stop, error] = std::from_chars(line.data() + at + 3, end, z_mm);
  if (error != std::errc{} || !std::isfinite(z_mm)) return std::nullopt;
  return z_mm;
}

Result<std::unique_ptr<TapStream>> OpenTapStream(const TapStreamOptions& options,
                                                 TapStreamEvents events, const WaitLimit& limit) {
  const auto address = ParseMoonrakerAddress(options.moonraker.address);
  if (!address) return tl::unexpected(address.error());
  auto stream = std::make_unique<MoonrakerTaps>(*address, options, std::move(events));
  if (auto started = stream->Start(limit); !started) return tl::unexpected(started.error());
  return stream;
}

}  // namespace trammel::machine
