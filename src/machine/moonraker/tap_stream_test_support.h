// What the tests of taps share: a tap's forces and moves, a scripted Moonraker, and what it told.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "machine/moonraker/tap_stream.h"
#include "support/ready_moonraker.h"
#include "support/scripted_moonraker.h"

namespace trammel::machine {

using nlohmann::json;

constexpr double kRate_hz = 320;
constexpr double kHalt_s = 101;
constexpr double kRise_s = 101.3;
constexpr double kRiseTime_s = 0.35;

inline json Move(double time_s, double duration_s, double speed, double accel, double z,
                 double direction) {
  return json::array({time_s, duration_s, speed, accel, {10.0, 20.0, z}, {0.0, 0.0, direction}});
}

/// A descent that the trigger cuts short, a halt, a pull-back and a lift.
inline json TapMoves(double shift_s = 0) {
  return {
      {"data",
       {Move(shift_s + 100, 0.01, 0, 200, 2.1, -1), Move(shift_s + 100.01, 0.99, 2, 0, 2.09, -1),
        Move(shift_s + kHalt_s, 0, 0, 0, -0.03, 0),
        Move(shift_s + kRise_s, 0.001, 0, 300, -0.03, 1),
        Move(shift_s + kRise_s + 0.001, kRiseTime_s - 0.002, 0.3, 0, -0.02985, 1),
        Move(shift_s + kRise_s + kRiseTime_s - 0.001, 0.001, 0.3, -300, 0.0745, 1),
        Move(shift_s + 102.4, 0.5, 5, 0, 0.0746, 1)}}};
}

/// Batches of forces like load_cell/dump_force sends them, 36 samples each.
inline std::vector<json> Forces(double from_s, double to_s) {
  std::vector<json> batches;
  json data = json::array();
  for (double t = from_s; t < to_s; t += 1 / kRate_hz) {
    data.push_back({t, 1.5, 12345, 12000});
    if (data.size() == 36) {
      batches.push_back({{"data", data}, {"errors", 0}});
      data = json::array();
    }
  }
  return batches;
}

/// What a stream told, for a test's thread.
struct Heard {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<json> taps, calls;
  std::vector<double> firmware_z_mm;
  std::vector<std::string> news;

  TapStreamEvents Events() {
    return {.on_tap = [this](const json& tap, double) { Add(taps, tap); },
            .on_firmware_z = [this](double z, double) { Add(firmware_z_mm, z); },
            .on_call = [this](const json& call, double) { Add(calls, call); },
            .on_news = [this](const std::string& text) { Add(news, text); }};
  }
  template <class T>
  void Add(std::vector<T>& list, const T& value) {
    const std::lock_guard lock(mutex);
    list.push_back(value);
    changed.notify_all();
  }
  template <class Done>
  bool Wait(Done done) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(10), done);
  }
};

class TapStreamTest : public testing::Test {
 protected:
  TapStreamTest() {
    test::AnswerLikeMoonraker(server_);
    server_.Answer("connection.register_remote_method", "ok");
    server_.Answer("printer.objects.list",
                   {{"objects", {"toolhead", "load_cell_probe", "probe", "extruder"}}});
    for (const char* method : {"printer.load_cell_probe.dump_taps", "printer.load_cell.dump_force",
                               "printer.motion_report.dump_trapq"}) {
      server_.Answer(method, {{"header", json::array()}});
    }
  }

  std::unique_ptr<TapStream> Open(const std::string& one_shot_token = {}) {
    TapStreamOptions options;
    options.moonraker.one_shot_token = one_shot_token;
    options.moonraker.address = fmt::format("127.0.0.1:{}", server_.port());
    options.moonraker.connect_time_limit_s = connect_time_limit_s_;
    options.remote_method = "trammel_tap";
    options.ask_again_s = 0.02;
    auto stream = OpenTapStream(options, heard_.Events(), {10});
    EXPECT_TRUE(stream) << stream.error().message;
    return stream ? std::move(*stream) : nullptr;
  }

  /// The method that the printer was told to send a subscription to.
  std::string MethodOf(const std::string& endpoint) {
    const json request = server_.WaitForRequest(endpoint);
    EXPECT_FALSE(request.is_null()) << endpoint;
    return request.is_null() ? ""
                             : request["params"]["response_template"]["method"].get<std::string>();
  }

  void Push(const std::string& method, const json& params) {
    server_.Push({{"jsonrpc", "2.0"}, {"method", method}, {"params", params}});
  }

  double connect_time_limit_s_ = 10;
  test::ScriptedMoonraker server_;
  Heard heard_;
};

}  // namespace trammel::machine
