#include "sim/moonraker/hub.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

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

}  // namespace
}  // namespace trammel::sim
