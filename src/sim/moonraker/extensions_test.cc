// Agents over real sockets, as a real Moonraker treats them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "sim/camera/camera_http.h"
#include "sim/moonraker/server.h"
#include "sim/moonraker/test_client.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

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

}  // namespace
}  // namespace trammel::sim
