// The conversations that a real Moonraker was recorded in (TRAMMEL_TEST_DATA/moonraker): our
// requests have their form, and everything that came in is understood.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "machine/moonraker/moonraker_test_support.h"
#include "support/matchers.h"

namespace trammel::machine {
namespace {

using nlohmann::json;
using test::ScriptedMoonraker;
using ::testing::HasSubstr;

struct Recorded {
  bool out = false;  ///< true if sent by the client
  json message;
};

class MoonrakerRecordings : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("TRAMMEL_TEST_DATA");
    if (data == nullptr ||
        !std::filesystem::is_directory(std::filesystem::path(data) / "moonraker")) {
      GTEST_SKIP() << "TRAMMEL_TEST_DATA names no folder with moonraker/ in it";
    }
    folder_ = std::filesystem::path(data) / "moonraker";
    test::AnswerLikeMoonraker(server_);
    auto printer = Must(ConnectToMoonraker(OptionsFor(server_), kPatience));
    printer_ = std::move(printer);
  }

  std::vector<Recorded> Read(const std::string& name) const {
    std::vector<Recorded> conversation;
    std::ifstream file(folder_ / name);
    for (std::string line; std::getline(file, line);) {
      const json entry = json::parse(line);
      conversation.push_back({entry.at("dir") == "out", entry.at("msg")});
    }
    EXPECT_FALSE(conversation.empty()) << name;
    return conversation;
  }

  /// Everything of a conversation that came in, as it came; the answers are to nobody, so that they
  /// answer none of our own calls.
  void PushIncoming(const std::vector<Recorded>& conversation) {
    for (const Recorded& recorded : conversation) {
      if (!recorded.out) {
        json message = recorded.message;
        if (message.contains("id")) message["id"] = message["id"].get<int>() + 1'000'000;
        server_.Push(message);
      }
    }
  }

  std::filesystem::path folder_;
  ScriptedMoonraker server_;
  std::unique_ptr<Printer> printer_;
};

TEST_F(MoonrakerRecordings, EveryIncomingMessageIsDigested) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    SCOPED_TRACE(entry.path().filename());
    PushIncoming(Read(entry.path().filename()));
    ASSERT_TRUE(printer_->State(kPatience));
    EXPECT_EQ(server_.CountRequests("server.connection.identify"), 1) << "the link was dropped";
    ++files;
  }
  EXPECT_GE(files, 6);
}

TEST_F(MoonrakerRecordings, TheStateAfterHomingHeatingAndMovingIsTheSumOfItsUpdates) {
  const std::vector<Recorded> conversation = Read("02_home_heat_move.jsonl");
  json sum = test::SmallPrinterStatus();
  double eventtime_s = 0;
  for (const Recorded& recorded : conversation) {
    if (recorded.message.value("method", "") == "notify_status_update") {
      sum.merge_patch(recorded.message["params"][0]);
      eventtime_s = recorded.message["params"][1];
    }
  }
  server_.Answer("printer.objects.query", {{"eventtime", eventtime_s}, {"status", json::object()}});
  PushIncoming(conversation);
  const auto state = Must(printer_->State(kPatience));
  EXPECT_EQ(state.homed_axes, "xyz");
  EXPECT_EQ(json(state.position_mm), sum["toolhead"]["position"]);
  EXPECT_EQ(state.heaters.at("extruder").target_c, sum["extruder"]["target"]);
  EXPECT_EQ(state.heaters.at("extruder").temperature_c, sum["extruder"]["temperature"]);
  EXPECT_EQ(state.heaters.at("heater_bed").temperature_c, sum["heater_bed"]["temperature"]);
  EXPECT_EQ(json(state.idle_state), sum["idle_timeout"]["state"]);
}

TEST_F(MoonrakerRecordings, RecordedScriptsGetTheVerdictThatTheServerMeant) {
  const std::vector<Recorded> conversation = Read("03_errors.jsonl");
  int failures = 0;
  for (std::size_t i = 0; i < conversation.size(); ++i) {
    const json& request = conversation[i].message;
    if (!conversation[i].out || request["method"] != "printer.gcode.script" ||
        !request.contains("params")) {
      continue;
    }
    // Collects the messages between the request and its answer, and the answer.
    std::vector<json> replies;
    std::string wanted;
    for (std::size_t k = i + 1; k < conversation.size(); ++k) {
      json reply = conversation[k].message;
      replies.push_back(reply);
      if (reply.value("method", "") == "notify_gcode_response") {
        const std::string line = reply["params"][0];
        wanted = line.starts_with("// Unknown command") ? "does not know" : wanted;
      }
      if (reply.value("id", 0) == request["id"]) {
        if (reply.contains("error")) {
          const std::string words = reply["error"]["message"];
          wanted = words.substr(0, words.find('\n'));
        }
        break;
      }
    }
    server_.Handle("printer.gcode.script", [replies](const json& ours) mutable {
      replies.back()["id"] = ours["id"];
      return replies;
    });
    const std::string script = request["params"]["script"];
    const Result<void> ran = printer_->Run(script, kPatience);
    EXPECT_EQ(ran.has_value(), wanted.empty()) << script;
    if (!ran) {
      ++failures;
      EXPECT_THAT(ran.error().message, HasSubstr(wanted)) << script;
    }
  }
  EXPECT_EQ(failures, 4) << "out of range, unknown, too cold, a bad parameter";
}

TEST_F(MoonrakerRecordings, AnEmergencyStopAndARestartAreFollowedToReady) {
  PushIncoming(Read("06_emergency_stop_and_restart.jsonl"));
  EXPECT_FALSE(server_.WaitForRequest("printer.objects.subscribe", 2).is_null());
  ASSERT_TRUE(printer_->WaitUntilReady(kPatience));
}

/// The names of an object's members, or what else it is.
json Form(const json& value) {
  if (!value.is_object()) return value.type_name();
  json form = json::object();
  for (const auto& [name, member] : value.items()) {
    form[name] = name == "objects" ? json("objects") : Form(member);
  }
  return form;
}

TEST_F(MoonrakerRecordings, OurRequestsHaveTheRecordedForm) {
  std::map<std::string, std::set<std::string>> recorded_forms;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    for (const Recorded& recorded : Read(entry.path().filename())) {
      if (recorded.out) {
        recorded_forms[recorded.message["method"]].insert(Form(recorded.message).dump());
      }
    }
  }
  server_.Answer("printer.emergency_stop", "ok");
  server_.Answer("server.webcams.list", {{"webcams", json::array()}});
  const WaitLimit brief{.time_limit_s = 0.05};
  EXPECT_TRUE(printer_->Run("G28", kPatience));
  EXPECT_TRUE(printer_->State(kPatience));
  EXPECT_TRUE(printer_->Webcams(kPatience));
  EXPECT_TRUE(printer_->RecordMoves(kPatience));
  EXPECT_FALSE(printer_->EmergencyStop(brief)) << "the server never says that it is shut down";
  EXPECT_TRUE(printer_->Moves(-2, -1, brief)) << "asked for where none are told";
  for (const char* method :
       {"server.connection.identify", "server.info", "printer.objects.list",
        "printer.objects.subscribe", "printer.objects.query", "printer.gcode.script",
        "server.webcams.list", "connection.register_remote_method",
        "printer.motion_report.dump_trapq", "printer.emergency_stop"}) {
    const json ours = server_.WaitForRequest(method);
    ASSERT_FALSE(ours.is_null()) << method;
    EXPECT_THAT(recorded_forms[method], ::testing::Contains(Form(ours).dump())) << method;
  }
}

}  // namespace

}  // namespace trammel::machine
