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

Json Client(const std::string& type) {
  return {{"client_name", "test"}, {"version", "1"}, {"type", type}, {"url", "u"}};
}

TEST_F(HubTest, OnlyAgentsRegisterMethodsAndEachNameOnce) {
  const Json method = {{"method_name", "called"}};
  const auto register_it = [&] {
    return Call(agent_, inbox_, "connection.register_remote_method", method);
  };
  EXPECT_THAT(register_it()["error"]["message"], HasSubstr("'agent' type"));
  Inbox other_inbox;
  const std::uint64_t other = Join(hub_, other_inbox);
  (void)Call(other, other_inbox, "server.connection.identify", Client("other"));
  EXPECT_EQ(Call(other, other_inbox, "connection.register_remote_method", method)["error"]["code"],
            400);
  (void)Call(agent_, inbox_, "server.connection.identify", Client("agent"));
  EXPECT_EQ(register_it()["result"], "ok");
  EXPECT_EQ(register_it()["error"]["message"], "Remote method (called) already registered");
}

TEST_F(HubTest, AnUnknownFieldIsNullAndAnUnknownObjectEmpty) {
  const Json status = Status({{"toolhead", {"homed_axes", "nope"}}, {"nope", {"field"}}});
  EXPECT_EQ(status["toolhead"], (Json{{"homed_axes", ""}, {"nope", nullptr}}));
  EXPECT_EQ(status["nope"], Json::object());
}

TEST_F(HubTest, ListsItsCommandsAndTheHelpOfThoseThatHaveOne) {
  const Json commands = Status({{"gcode", {"commands"}}})["gcode"]["commands"];
  EXPECT_TRUE(commands.contains("G28"));
  EXPECT_TRUE(commands.contains("_LASER_ON"));
  const Json help = Call(agent_, inbox_, "printer.gcode.help", Json::object())["result"];
  EXPECT_FALSE(help.contains("G28"));
  EXPECT_EQ(help["_LASER_ON"], Json("G-Code macro"));
}

TEST_F(HubTest, AFileIsCountedInBytesAndClosedAtItsEnd) {
  const std::string text = "M105\nG4 P3000\nM105\n";
  machine_.With([&](VirtualKlipper& klipper) { klipper.files()["a.gcode"] = text; });
  ASSERT_EQ(Script("SDCARD_PRINT_FILE FILENAME=a.gcode")["result"], "ok");
  const auto card = [&] { return Status({{"virtual_sdcard", nullptr}})["virtual_sdcard"]; };
  EXPECT_EQ(card()["file_size"], text.size());
  EXPECT_THAT(card()["file_path"].dump(), HasSubstr("a.gcode"));
  Run(10);
  EXPECT_EQ(card(), (Json{{"file_path", nullptr},
                          {"progress", 1.0},
                          {"is_active", false},
                          {"file_position", text.size()},
                          {"file_size", text.size()}}));
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

TEST_F(HubTest, AMillionLevelsAreNoMessage) {
  std::string text = R"({"jsonrpc":"2.0","id":1,"method":"printer.info","params":{"a":)";
  text += std::string(1'000'000, '[') + std::string(1'000'000, ']') + "}}";
  hub_.Receive(agent_, text);
  ASSERT_EQ(inbox_.messages.size(), 1U);
  EXPECT_EQ(inbox_.messages[0]["error"]["code"], -32700);
}

TEST_F(HubTest, PausingWithoutAFileIsLeftToWhoeverSendsTheLines) {
  (void)Script("PAUSE");
  (void)Script("RESUME");
  std::vector<std::string> said;
  for (const Json& message : inbox_.messages) {
    if (message.value("method", "") == "notify_gcode_response")
      said.push_back(message["params"][0]);
  }
  EXPECT_EQ(said, (std::vector<std::string>{"// action:paused", "// action:resumed"}));
}

class ExtensionsTest : public ::testing::Test {
 protected:
  static Json Client(const std::string& name, const std::string& type) {
    return {{"client_name", name}, {"version", "1"}, {"type", type}, {"url", "u"}};
  }

  ExtensionsTest() {
    auto started = PrinterServer::Start(machine_, {});
    if (!started) throw std::runtime_error(started.error().message);
    server_ = std::move(*started);
    agent_ = std::make_unique<TestClient>(server_->port());
    panel_ = std::make_unique<TestClient>(server_->port());
    (void)panel_->Call("server.connection.identify", Client("panel", "web"));
  }

  Json Identify(const std::string& name = "helper") {
    return agent_->Call("server.connection.identify", Client(name, "agent"));
  }
  int Ask(const Json& arguments, const std::string& agent = "helper") {
    Json params = {{"agent", agent}, {"method", "status"}};
    if (!arguments.is_null()) params["arguments"] = arguments;
    return panel_->Send("server.extensions.request", params);
  }
  void Say(const Json& answer) {
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

TEST_F(ExtensionsTest, ARequestIsPassedOnAndItsAnswerHandedBack) {
  (void)Identify();
  const int asked = Ask({{"a", 1}});
  const Json request = agent_->WaitFor("status");
  EXPECT_EQ(request["params"], (Json{{"a", 1}}));
  EXPECT_TRUE(request["id"].is_number_integer());
  Say({{"id", request["id"]}, {"result", {{"state", "idle"}}}});
  EXPECT_EQ(panel_->AnswerTo(asked)["result"], (Json{{"state", "idle"}}));
  // A list is passed on, too; an empty object is left out.
  const int list = Ask({1, 2});
  const Json listed = agent_->WaitFor("status");
  EXPECT_EQ(listed["params"], Json::array({1, 2}));
  Say({{"id", listed["id"]}, {"result", "ok"}});
  (void)panel_->AnswerTo(list);
  const int empty = Ask(Json::object());
  const Json bare = agent_->WaitFor("status");
  EXPECT_FALSE(bare.contains("params"));
  Say({{"id", bare["id"]}, {"result", "ok"}});
  (void)panel_->AnswerTo(empty);
}

TEST_F(ExtensionsTest, AnAgentsErrorIsAnAgentErrorWithItsOwnAsData) {
  (void)Identify();
  const Json own = {{"code", -32601}, {"message", "no such method"}};
  const int asked = Ask(nullptr);
  Say({{"id", agent_->WaitFor("status")["id"]}, {"error", own}});
  EXPECT_EQ(panel_->AnswerTo(asked)["error"],
            (Json{{"code", 424}, {"message", "Agent helper RPC error"}, {"data", own}}));
  // A null result passes for an error.
  const int null = Ask(nullptr);
  Say({{"id", agent_->WaitFor("status")["id"]}, {"result", nullptr}});
  EXPECT_EQ(panel_->AnswerTo(null)["error"]["code"], 424);
}

TEST_F(ExtensionsTest, WhatAnAgentLeavesUnansweredEndsWithItsConnection) {
  (void)Identify();
  const int asked = Ask(nullptr);
  (void)agent_->WaitFor("status");
  Say({{"id", "no number"}, {"result", 1}});
  Say({{"id", 5}, {"result", 1}});
  Say({{"result", 1}});
  agent_.reset();
  EXPECT_EQ(panel_->AnswerTo(asked)["error"],
            (Json{{"code", 500}, {"message", "Client Socket Disconnected"}}));
  EXPECT_EQ(panel_->AnswerTo(Ask(nullptr))["error"]["message"], "Agent helper not connected");
}

TEST_F(ExtensionsTest, RequestsThatMakeNoSenseAreRefused) {
  (void)Identify();
  const auto message = [this](const Json& params) {
    return panel_->Call("server.extensions.request", params)["error"]["message"].get<std::string>();
  };
  EXPECT_THAT(message({{"method", "status"}}), HasSubstr("argument: agent"));
  EXPECT_THAT(message({{"agent", "helper"}}), HasSubstr("argument: method"));
  EXPECT_THAT(message({{"agent", "helper"}, {"method", "status"}, {"arguments", 3}}),
              HasSubstr("an object or a list"));
}

TEST_F(ExtensionsTest, EventsOfAgentsReachAllOthersAndReservedOnesNobody) {
  const auto send = [](TestClient& client, const std::string& event) {
    return client.Call("connection.send_event", {{"event", event}, {"data", {{"run", "a"}}}});
  };
  EXPECT_THAT(send(*panel_, "run")["error"]["message"], HasSubstr("'agent' type"));
  (void)Identify();
  (void)panel_->WaitFor("notify_agent_event");
  EXPECT_EQ(send(*agent_, "connected")["error"]["message"], "Event 'connected' is reserved");
  EXPECT_EQ(send(*agent_, "run")["result"], "ok");
  EXPECT_EQ(panel_->WaitFor("notify_agent_event")["params"],
            Json::array({{{"agent", "helper"}, {"event", "run"}, {"data", {{"run", "a"}}}}}));
  for (const Json& message : agent_->passed) {
    EXPECT_NE(message.value("method", ""), "notify_agent_event") << "an agent hears itself";
  }
}

TEST_F(ExtensionsTest, TheConnectionOfARefusedAgentCountsAsIdentified) {
  (void)Identify();
  TestClient second(server_->port());
  const auto identify = [&second](const std::string& name) {
    return second.Call("server.connection.identify", Client(name, "agent"))["error"]["message"]
        .get<std::string>();
  };
  EXPECT_THAT(identify("helper"), HasSubstr("already registered"));
  EXPECT_THAT(identify("other"), HasSubstr("already identified"));
  EXPECT_EQ(panel_->Call("server.extensions.list")["result"]["agents"].size(), 1U);
}

TEST_F(ExtensionsTest, HttpAsksAnAgentToo) {
  EXPECT_EQ(TestHttp(server_->port(), "GET", "/server/extensions/list").status, 200);
  const TestResponse response = TestHttp(server_->port(), "POST", "/server/extensions/request",
                                         R"({"agent": "nobody", "method": "status"})",
                                         {{"Content-Type", "application/json"}});
  EXPECT_EQ(response.status, 400);
  EXPECT_THAT(response.body, HasSubstr("Agent nobody not connected"));
}

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
