#include "sim/moonraker/hub.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <string>

#include "sim/camera/camera_http.h"
#include "sim/moonraker/server.h"
#include "sim/moonraker/test_client.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

// The hub without sockets, on a clock of the test's own.
class HubTest : public ::testing::Test {
 protected:
  struct Inbox : Peer {
    void Send(const std::string& message) override { messages.push_back(Json::parse(message)); }
    void Close() override {}
    std::vector<Json> messages;
  };

  static std::uint64_t Join(Hub& hub, Inbox& inbox) { return hub.Open(inbox, true).value(); }

  // The answer to one request, within two seconds of the machine's time.
  Json Call(std::uint64_t connection, Inbox& inbox, const std::string& method, const Json& params) {
    const int id = ++last_id_;
    hub_.Receive(
        connection,
        Json{{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params}}.dump());
    for (int step = 0; step < 20; ++step) {
      for (const Json& message : inbox.messages) {
        if (message.value("id", Json()) == id) return message;
      }
      Run(0.1);
    }
    return nullptr;
  }

  void Run(double time_s) {
    now_s_ += time_s;
    hub_.Tick(now_s_);
  }

  Json Status(const Json& objects) {
    return Call(agent_, inbox_, "printer.objects.query",
                {{"objects", objects}})["result"]["status"];
  }

  Json Script(const std::string& text) {
    return Call(agent_, inbox_, "printer.gcode.script", {{"script", text}});
  }

  double now_s_ = 1000;
  int last_id_ = 0;
  MachineHost machine_{MachineOptions{}, now_s_};
  Hub hub_{machine_, HubOptions{}};
  Inbox inbox_;
  std::uint64_t agent_ = Join(hub_, inbox_);
};

Json Client(const std::string& type, const std::string& name = "test") {
  return {{"client_name", name}, {"version", "1"}, {"type", type}, {"url", "u"}};
}

TEST_F(HubTest, AnUnknownFieldIsNullAndAnUnknownObjectEmpty) {
  const Json status = Status({{"toolhead", {"homed_axes", "nope"}}, {"nope", {"field"}}});
  EXPECT_EQ(status["toolhead"], (Json{{"homed_axes", ""}, {"nope", nullptr}}));
  EXPECT_EQ(status["nope"], Json::object());
}

TEST_F(HubTest, SubscriptionsToMovesAddUpUntilKlipperIsRestarted) {
  (void)Call(agent_, inbox_, "server.connection.identify", Client("agent"));
  (void)Call(agent_, inbox_, "connection.register_remote_method", {{"method_name", "moves"}});
  const Json dump = {{"name", "toolhead"}, {"response_template", {{"method", "moves"}}}};
  const auto batches = [&] {
    inbox_.messages.clear();
    (void)Script("G28\nG91\nG1 X5 F6000\nG1 X-5\nG90\nM400");
    Run(2);
    int count = 0;
    std::set<std::string> different;
    for (const Json& message : inbox_.messages) {
      if (message.value("method", "") != "moves") continue;
      ++count;
      different.insert(message["params"].dump());
    }
    return different.empty() ? 0 : count / static_cast<int>(different.size());
  };
  (void)Call(agent_, inbox_, "printer.motion_report.dump_trapq", dump);
  EXPECT_EQ(batches(), 1);
  (void)Call(agent_, inbox_, "printer.motion_report.dump_trapq", dump);
  (void)batches();  // the second one begins with what was before it
  EXPECT_EQ(batches(), 2) << "each batch twice, though the client is one";
  (void)Call(agent_, inbox_, "printer.firmware_restart", Json::object());
  for (int i = 0; i < 200; ++i) Run(0.1);
  EXPECT_EQ(batches(), 0);
}

TEST_F(HubTest, WhatGoesThroughToKlipperEndsWithItsConnection) {
  struct Closed : Inbox {
    void Close() override { closed = true; }
    bool closed = false;
  };
  Closed own;
  const std::uint64_t number = hub_.OpenThrough(own, true).value();
  const auto ask = [&](const char* endpoint, const Json& params) {
    own.messages.clear();
    hub_.Receive(number, Json{{"id", 1}, {"method", endpoint}, {"params", params}}.dump());
    return own.messages.empty() ? Json() : own.messages.front();
  };
  EXPECT_TRUE(ask("motion_report/dump_trapq",
                  {{"name", "toolhead"}, {"response_template", {{"method", "mine"}}}})
                  .contains("result"));
  EXPECT_THAT(ask("no/such", Json::object())["error"]["message"].get<std::string>(),
              HasSubstr("No registered callback for path 'no/such'"));
  own.messages.clear();
  (void)Script("G28\nM400");
  Run(2);
  ASSERT_FALSE(own.messages.empty());
  for (const Json& message : own.messages) EXPECT_EQ(message.value("method", ""), "mine");
  for (const Json& message : inbox_.messages) EXPECT_NE(message.value("method", ""), "mine");
  (void)Call(agent_, inbox_, "printer.firmware_restart", Json::object());
  for (int i = 0; i < 200; ++i) Run(0.1);
  EXPECT_TRUE(own.closed);
}

class ExtensionsTest : public ::testing::Test {
 protected:
  ExtensionsTest() {
    auto started = PrinterServer::Start(machine_, {});
    if (!started) throw std::runtime_error(started.error().message);
    server_ = std::move(*started);
    agent_ = std::make_unique<TestClient>(server_->port());
    panel_ = std::make_unique<TestClient>(server_->port());
    (void)panel_->Call("server.connection.identify", Client("web"));
  }

  Json Identify() { return agent_->Call("server.connection.identify", Client("agent", "helper")); }
  int Ask() {
    return panel_->Send("server.extensions.request", {{"agent", "helper"}, {"method", "status"}});
  }
  void SendAnswer(const Json& answer) {
    Json message = answer;
    message["jsonrpc"] = "2.0";
    agent_->SendText(message.dump());
  }

  MachineHost machine_{MachineOptions{}, MonotonicNow()};
  std::unique_ptr<PrinterServer> server_;
  std::unique_ptr<TestClient> agent_;
  std::unique_ptr<TestClient> panel_;
};

TEST_F(ExtensionsTest, AnAgentIsListedAndItsComingAndGoingAreTold) {
  ASSERT_TRUE(Identify().contains("result"));
  const Json helper = {{"name", "helper"}, {"version", "1"}, {"type", "agent"}, {"url", "u"}};
  EXPECT_EQ(panel_->WaitFor("notify_agent_event")["params"],
            Json::array({{{"agent", "helper"}, {"event", "connected"}, {"data", helper}}}));
  EXPECT_EQ(panel_->Call("server.extensions.list")["result"]["agents"], Json::array({helper}));
  agent_.reset();
  EXPECT_EQ(panel_->WaitFor("notify_agent_event")["params"],
            Json::array({{{"agent", "helper"}, {"event", "disconnected"}}}));
  EXPECT_EQ(panel_->Call("server.extensions.list")["result"]["agents"], Json::array());
}

TEST_F(ExtensionsTest, AnAgentsErrorIsAnAgentErrorWithItsOwnAsData) {
  (void)Identify();
  const Json own = {{"code", -32601}, {"message", "no such method"}};
  const int asked = Ask();
  SendAnswer({{"id", agent_->WaitFor("status")["id"]}, {"error", own}});
  EXPECT_EQ(panel_->AnswerTo(asked)["error"],
            (Json{{"code", 424}, {"message", "Agent helper RPC error"}, {"data", own}}));
  // A null result passes for an error.
  const int null = Ask();
  SendAnswer({{"id", agent_->WaitFor("status")["id"]}, {"result", nullptr}});
  EXPECT_EQ(panel_->AnswerTo(null)["error"]["code"], 424);
}

TEST_F(ExtensionsTest, WhatAnAgentLeavesUnansweredEndsWithItsConnection) {
  (void)Identify();
  const int asked = Ask();
  (void)agent_->WaitFor("status");
  SendAnswer({{"id", "no number"}, {"result", 1}});
  SendAnswer({{"id", 5}, {"result", 1}});
  SendAnswer({{"result", 1}});
  agent_.reset();
  EXPECT_EQ(panel_->AnswerTo(asked)["error"],
            (Json{{"code", 500}, {"message", "Client Socket Disconnected"}}));
  EXPECT_EQ(panel_->AnswerTo(Ask())["error"]["message"], "Agent helper not connected");
}

// Shapes are those of a real server's: 04_trapq_and_force.jsonl of the recorded conversations.
TEST(CellDumps, ForceTapsAndMotionComeAsARealServerSendsThem) {
  MachineOptions options;
  options.speed = 20;
  options.klipper.load_cell.emplace().pulls_back = true;
  MachineHost machine(options, MonotonicNow());
  const auto server = PrinterServer::Start(machine, {});
  ASSERT_TRUE(server) << server.error().message;
  TestClient client((*server)->port());
  (void)client.Call("server.connection.identify", Client("agent"));
  const auto follow = [&](const char* method, const char* key, const char* name, const char* as) {
    (void)client.Call("connection.register_remote_method", {{"method_name", as}});
    return client.Call(method, {{key, name}, {"response_template", {{"method", as}}}})["result"];
  };
  EXPECT_EQ(follow("printer.load_cell.dump_force", "load_cell", "load_cell_probe", "forces"),
            (Json{{"header", {"time", "force (g)", "counts", "tare_counts"}}}));
  EXPECT_EQ(
      follow("printer.load_cell_probe.dump_taps", "load_cell_probe", "load_cell_probe", "taps"),
      (Json{{"header", {"probe_tap_event"}}}));
  (void)follow("printer.motion_report.dump_trapq", "name", "toolhead", "motion");
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
  // The stream's samples equal the tap's.
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

}  // namespace
}  // namespace trammel::sim
