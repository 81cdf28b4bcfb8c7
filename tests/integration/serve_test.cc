// trammel serve over real sockets, as a front end uses it: requests to the agent, events from it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include "fault_scenario.h"
#include "machine_shop.h"
#include "sim/moonraker/test_client.h"

namespace trammel::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;

constexpr int kBusy = -32001;
constexpr int kNothing = -32002;

class Serve : public testing::Test {
 protected:
  void Start(ShopOptions options = {}) {
    auto& macros = options.klipper.macros;
    macros["_TRAMMEL_KEEP_ALIVE"].lines = {"LIGHTS_ON"};
    macros["_TRAMMEL_RELEASE"].lines = {"LASER_OFF"};
    shop_ = std::make_unique<MachineShop>(std::move(options));
    shop_->Script(kWorkedWith);
    before_ = shop_->Look();
    Launch();
    OpenPanel();
  }
  void Launch() { process_ = shop_->Serve(); }
  void OpenPanel() {
    panel_ = std::make_unique<sim::TestClient>(shop_->server().port());
    (void)panel_->Call(
        "server.connection.identify",
        {{"client_name", "panel"}, {"version", "1"}, {"type", "web"}, {"url", "http://localhost"}});
    // Messages come all the time then, however long a step of a run takes.
    (void)panel_->Call("printer.objects.subscribe", {{"objects", {{"toolhead", nullptr}}}});
  }

  // The whole answer of Moonraker, which wraps an agent's error.
  json Request(const std::string& method, const json& arguments = nullptr) {
    json params = {{"agent", "trammel"}, {"method", method}};
    if (!arguments.is_null()) params["arguments"] = arguments;
    return panel_->Call("server.extensions.request", params);
  }
  json Ask(const std::string& method, const json& arguments = nullptr) {
    const json answer = Request(method, arguments);
    EXPECT_TRUE(answer.contains("result")) << answer;
    return answer.value("result", json::object());
  }
  int CodeOf(const std::string& method, const json& arguments = nullptr) {
    const json answer = Request(method, arguments);
    if (!answer.contains("error")) return 0;
    EXPECT_EQ(answer["error"]["code"], 424);
    return answer["error"]["data"]["code"];
  }
  // The one that has the printer, as its lock names it.
  [[nodiscard]] pid_t JobsProcess() const {
    for (const auto& entry : fs::recursive_directory_iterator(shop_->folder() / "state")) {
      if (entry.path().extension() != ".lock") continue;
      const std::string text = ReadWhole(entry.path());
      const std::size_t at = text.find("process ");
      if (at != std::string::npos)
        return std::stoi(text.substr(at + std::string("process ").size()));
    }
    throw std::runtime_error("nobody has the printer");
  }
  std::string StartJob() { return Ask("start", {{"job", "pressure_advance"}})["run"]; }

  // The next event of a run; those that came while something else was waited for are first.
  json NextEvent() {
    for (;;) {
      auto& passed = panel_->passed;
      for (auto message = passed.begin(); message != passed.end(); ++message) {
        if (message->value("method", "") != "notify_agent_event") continue;
        const json event = (*message)["params"][0];
        passed.erase(passed.begin(), message + 1);
        if (event["event"] == "run") return event["data"];
        return NextEvent();
      }
      passed.clear();
      auto message = panel_->Next();
      if (!message) throw std::runtime_error("the server closed");
      passed.push_back(std::move(*message));
    }
  }
  // The last event of a run; its phases so far are noted.
  json FollowToItsEnd(const std::string& run) {
    for (;;) {
      const json event = NextEvent();
      EXPECT_EQ(event["run"], run);
      phases_.insert(event["phase"].get<std::string>());
      if (event["complete"] == true) return event;
    }
  }
  bool WaitFor(const std::function<bool()>& so) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(kEnough_s);
    while (!so()) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return true;
  }

  std::unique_ptr<MachineShop> shop_;
  PrinterLook before_;
  std::unique_ptr<TrammelProcess> process_;
  std::unique_ptr<sim::TestClient> panel_;
  std::set<std::string> phases_;
};

TEST_F(Serve, AJobIsStartedFollowedAndItsAnswerAppliedByRequest) {
  Start();
  EXPECT_EQ(panel_->Call("server.extensions.list")["result"]["agents"][0]["name"], "trammel");
  const json idle = Ask("status");
  EXPECT_EQ(idle["api_version"], 1);
  EXPECT_EQ(idle["busy"], false);
  EXPECT_EQ(idle["jobs"][0]["job"], "pressure_advance");
  EXPECT_EQ(idle["jobs"][0]["blocker"], nullptr) << idle;
  EXPECT_EQ(CodeOf("format_disk"), -32601);
  const auto ask = [this](const std::string& method) {
    return shop_->Run({"serve", "--ask", method, "--printer", shop_->address()});
  };
  EXPECT_EQ(json::parse(ask("status").standard_output)["jobs"], idle["jobs"]);
  EXPECT_THAT(ask("format_disk").standard_error, HasSubstr("format_disk"));
  constexpr int kMaxTimes = 3;  // a computer with too much else to do may see too few frames
  json end = json::object();
  for (int asked = 0; asked < kMaxTimes && end.value("verdict", json()) != "good"; ++asked) {
    const std::string run = StartJob();
    EXPECT_EQ(CodeOf("start", {{"job", "pressure_advance"}}), kBusy);
    EXPECT_EQ(Ask("status")["run"]["run"], run);
    // The command line sees that the printer is taken.
    if (asked == 0) {
      shop_->WaitUntilPrinting(*process_);
      const ProcessEnd other = shop_->Run({"pa", "print", "--printer", shop_->address()});
      EXPECT_EQ(other.exit_code, 3) << other.standard_error;
    }
    end = FollowToItsEnd(run);
    EXPECT_EQ(end["end"], "done") << end;
  }
  ASSERT_EQ(end["verdict"], "good") << end;
  EXPECT_THAT(phases_, IsSupersetOf({"starting", "checking", "heating", "printing", "scanning",
                                     "restoring", "analysing", "ended"}));
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
  const json status = Ask("status");
  EXPECT_EQ(status["proposal"]["run"], end["run"]);
  EXPECT_EQ(Ask("result")["result"]["verdict"], "good");
  EXPECT_EQ(Ask("history")["results"][0]["verdict"], "good");
  const std::string apply = Ask("start", {{"job", "apply"}})["run"];
  EXPECT_EQ(FollowToItsEnd(apply)["end"], "done");
  // Four times the uncertainty that a quick calibration states.
  EXPECT_NEAR(shop_->Look().settings.at("pressure advance"), 0.03, 0.008);
  process_->Send(SIGTERM);
  EXPECT_EQ(process_->Wait().exit_code, 0);
}

TEST_F(Serve, AStopLeavesThePrinterAsItWas) {
  Start();
  const std::string run = StartJob();
  shop_->WaitUntilSweeping(1, *process_);
  EXPECT_EQ(Ask("stop", {{"run", run}})["run"], run);
  const json end = FollowToItsEnd(run);
  EXPECT_EQ(end["end"], "stopped") << end;
  EXPECT_THAT(shop_->Faulty(before_), IsEmpty());
  EXPECT_EQ(CodeOf("stop"), kNothing);
}

TEST_F(Serve, AKilledServiceLeavesThePrinterSafeAndKnowsOfTheRunAfterwards) {
  Start();
  const std::string run = StartJob();
  shop_->WaitUntilSweeping(1, *process_);
  process_->Send(SIGKILL);
  EXPECT_EQ(process_->Wait().signal, SIGKILL);
  EXPECT_THAT(shop_->Faulty(before_, kEnough_s), IsEmpty());
  // Moonraker has let go of the agent, although the run's process went on for a moment.
  EXPECT_EQ(Request("status")["error"]["message"], "Agent trammel not connected");
  Launch();
  const json status = Ask("status");
  EXPECT_EQ(status["run"]["run"], run);
  EXPECT_EQ(status["run"]["end"], "unknown");
  EXPECT_EQ(status["busy"], false);
  // The run has given the printer back, and the next one may have it.
  EXPECT_TRUE(WaitFor([this] { return CodeOf("start", {{"job", "pressure_advance"}}) == 0; }));
  (void)Ask("stop");
}

TEST_F(Serve, WhatAJobLeftThatWasKilledIsBroughtBackAtOnce) {
  Start();
  const std::string run = StartJob();
  shop_->WaitUntilSweeping(1, *process_);
  ASSERT_EQ(kill(JobsProcess(), SIGKILL), 0);
  const json end = FollowToItsEnd(run);
  EXPECT_EQ(end["end"], "failed") << end;
  PrinterLook wanted = before_;
  wanted.nozzle_target_c = wanted.bed_target_c = 0;
  EXPECT_THAT(shop_->Faulty(wanted), IsEmpty());
  EXPECT_THAT(process_->StandardErrorSoFar(), HasSubstr("died here: brought back"));
}

TEST_F(Serve, TheAgentComesBackUnderItsNameAfterALostLinkAndARestartOfKlipper) {
  Start();
  sim::ServerFaults faults;
  faults.close_at_s = 0.1;
  faults.refuse_for_s = 1;
  shop_->server().Inject(faults);
  const auto served = [this] {
    try {
      OpenPanel();
      return Request("status").contains("result");
    } catch (const std::runtime_error&) {
      return false;  // closed, or refused still
    }
  };
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_TRUE(WaitFor(served));
  shop_->Script("FIRMWARE_RESTART");
  EXPECT_TRUE(WaitFor([this] { return Ask("status")["printer"]["readiness"] == "ready"; }));
  const json agents = panel_->Call("server.extensions.list")["result"]["agents"];
  ASSERT_EQ(agents.size(), 1U);
  EXPECT_EQ(agents[0]["name"], "trammel");
}

}  // namespace
}  // namespace trammel::test
