#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/camera/camera_http.h"
#include "sim/moonraker/server.h"
#include "sim/moonraker/test_client.h"

namespace trammel::sim {
namespace {

constexpr double kSpeed = 20;

struct Bench {
  explicit Bench(bool with_cell = true, bool pulls_back = true)
      : machine(Options(with_cell, pulls_back), MonotonicNow()) {
    auto started = PrinterServer::Start(machine, {});
    if (!started) throw std::runtime_error(started.error().message);
    server = std::move(*started);
  }
  static MachineOptions Options(bool with_cell, bool pulls_back) {
    MachineOptions options;
    options.speed = kSpeed;
    if (with_cell) {
      options.klipper.load_cell.emplace();
      options.klipper.load_cell->pulls_back = pulls_back;
    }
    return options;
  }

  MachineHost machine;
  std::unique_ptr<PrinterServer> server;
};

Json To(const char* key, const char* name, const char* method) {
  return {{key, name}, {"response_template", {{"method", method}}}};
}

void Become(TestClient& client, const std::vector<std::string>& methods) {
  (void)client.Call(
      "server.connection.identify",
      {{"client_name", "test"}, {"version", "1"}, {"type", "agent"}, {"url", "http://localhost"}});
  for (const std::string& method : methods) {
    (void)client.Call("connection.register_remote_method", {{"method_name", method}});
  }
}

// Shapes are those of a real server's: 04_trapq_and_force.jsonl of the recorded conversations.
TEST(CellDumps, ForceTapsAndMotionComeAsARealServerSendsThem) {
  Bench bench;
  TestClient client(bench.server->port());
  Become(client, {"forces", "taps", "motion"});
  EXPECT_EQ(client.Call("printer.load_cell.dump_force",
                        To("load_cell", "load_cell_probe", "forces"))["result"],
            (Json{{"header", {"time", "force (g)", "counts", "tare_counts"}}}));
  EXPECT_EQ(client.Call("printer.load_cell_probe.dump_taps",
                        To("load_cell_probe", "load_cell_probe", "taps"))["result"],
            (Json{{"header", {"probe_tap_event"}}}));
  (void)client.Call("printer.motion_report.dump_trapq", To("name", "toolhead", "motion"));
  const Json force = client.WaitFor("forces")["params"];
  EXPECT_EQ(force["errors"], 0);
  EXPECT_EQ(force["overflows"], 0);
  ASSERT_FALSE(force["data"].empty());
  ASSERT_EQ(force["data"][0].size(), 4u);
  ASSERT_EQ(client.Call("printer.gcode.script", {{"script", "G28\nG1 Z3\nPROBE"}})["result"], "ok");
  Json tap;
  for (const Json& message : client.passed) {
    if (message.value("method", "") == "taps") tap = message["params"]["tap"];
  }
  if (tap.is_null()) tap = client.WaitFor("taps")["params"]["tap"];
  EXPECT_EQ(tap["is_valid"], true);
  ASSERT_GT(tap["time"].size(), 200u);
  EXPECT_EQ(tap["time"].size(), tap["force"].size());
  ASSERT_EQ(tap["moves"].size(), 6u);
  for (const char* key : {"print_time", "move_t", "start_v", "accel", "start_x", "start_y",
                          "start_z", "x_r", "y_r", "z_r"}) {
    EXPECT_TRUE(tap["moves"][4].contains(key)) << key;
  }
  // What comes as a stream is what the tap holds.
  std::map<double, double> streamed;
  for (const Json& message : client.passed) {
    if (message.value("method", "") != "forces") continue;
    for (const Json& row : message["params"]["data"]) streamed[row[0]] = row[1];
  }
  for (std::size_t i = 0; i < tap["time"].size(); ++i) {
    const auto found = streamed.find(tap["time"][i]);
    if (found == streamed.end()) continue;
    EXPECT_EQ(found->second, tap["force"][i].get<double>());
  }
  EXPECT_GT(streamed.size(), tap["time"].size() / 2);
}

TEST(CellDumps, KlipperItselfTellsNoMovesAndANewListenerNoOldTaps) {
  Bench bench(true, false);
  TestClient client(bench.server->port());
  Become(client, {"taps"});
  (void)client.Call("printer.gcode.script", {{"script", "G28\nG1 Z3\nPROBE"}});
  (void)client.Call("printer.load_cell_probe.dump_taps",
                    To("load_cell_probe", "load_cell_probe", "taps"));
  (void)client.Call("printer.gcode.script", {{"script", "G1 X20 Z3\nPROBE SAMPLES=2"}});
  Json taps = Json::array();
  for (const Json& message : client.passed) {
    if (message.value("method", "") == "taps") taps.push_back(message["params"]["tap"]);
  }
  while (taps.size() < 2) taps.push_back(client.WaitFor("taps")["params"]["tap"]);
  EXPECT_EQ(taps.size(), 2u);
  EXPECT_FALSE(taps[0].contains("moves"));
}

TEST(CellDumps, StatusAndErrorsAreKlippers) {
  Bench bench;
  TestClient client(bench.server->port());
  const Json status = client.Call(
      "printer.objects.query",
      {{"objects", {{"probe", nullptr}, {"load_cell_probe", nullptr}}}})["result"]["status"];
  EXPECT_TRUE(status["probe"].contains("last_z_result"));
  EXPECT_EQ(status["load_cell_probe"]["is_calibrated"], true);
  EXPECT_TRUE(status["load_cell_probe"].contains("force_g"));
  EXPECT_EQ(client.Call("printer.load_cell.dump_force")["error"]["message"],
            "Missing Argument [load_cell]");
  EXPECT_EQ(
      client.Call("printer.load_cell.dump_force", To("load_cell", "no", "x"))["error"]["message"],
      "The value 'no' is not valid for load_cell");
  Bench without(false);
  TestClient other(without.server->port());
  EXPECT_EQ(other.Call("printer.load_cell_probe.dump_taps",
                       To("load_cell_probe", "load_cell_probe", "x"))["error"]["code"],
            -32601);
}

}  // namespace
}  // namespace trammel::sim
