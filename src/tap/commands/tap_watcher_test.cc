// trammel tap watch against a scripted Moonraker over a real socket.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "support/drawn_tap_json.h"
#include "support/matchers.h"
#include "support/scripted_moonraker.h"
#include "support/trammel_process.h"

namespace trammel::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class TapWatch : public testing::Test {
 protected:
  void Start(const std::vector<std::string>& more) {
    AnswerLikeMoonraker(server_);
    server_.Answer("connection.register_remote_method", "ok");
    server_.Answer("printer.objects.list",
                   {{"objects", {"toolhead", "load_cell_probe", "probe", "extruder"}}});
    for (const char* method : {"printer.load_cell_probe.dump_taps", "printer.load_cell.dump_force",
                               "printer.motion_report.dump_trapq"}) {
      server_.Answer(method, {{"header", json::array()}});
    }
    std::vector<std::string> arguments = {"tap",       "watch",
                                          "--printer", fmt::format("127.0.0.1:{}", server_.port()),
                                          "--out",     "taps.jsonl"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    process_ = std::make_unique<TrammelProcess>(arguments, folder_.path());
    const json request = server_.WaitForRequest("printer.load_cell_probe.dump_taps");
    ASSERT_FALSE(request.is_null());
    taps_method_ = request["params"]["response_template"]["method"];
    // Subscriptions are answered in order, so that all are in place behind the last.
    (void)server_.WaitForRequest("printer.objects.subscribe");
  }

  void Push(const std::string& method, const json& params) {
    server_.Push({{"jsonrpc", "2.0"}, {"method", method}, {"params", params}});
  }
  void PushTap(const json& tap) { Push(taps_method_, {{"tap", tap}}); }

  /// The n-th answer to a macro.
  std::string Answer(int n) {
    const json request = server_.WaitForRequest("printer.gcode.script", n);
    return request.is_null() ? "" : request["params"]["script"].get<std::string>();
  }

  TemporaryFolder folder_;
  ScriptedMoonraker server_;
  std::unique_ptr<TrammelProcess> process_;
  std::string taps_method_;
};

TEST_F(TapWatch, ShowsTapsBesideThePrintersOwnResultAndKeepsThem) {
  Start({"--count", "2"});
  PushTap(DrawnTap(-0.01));
  server_.Push(GcodeResponse("// probe at 10.000,20.000 is z=-0.008000"));
  PushTap(DrawnTap(-0.0101));
  server_.Push(GcodeResponse("// probe at 10.000,20.000 is z=-0.007000"));
  EXPECT_THAT(process_->Wait(30), Prints(0, "printer's own z -0.0080 mm", "mm over 2 taps",
                                         "printer minus ours", "taps              2, 2 good"));
  const std::string kept = ReadWhole(folder_.path() / "taps.jsonl");
  const json first = json::parse(kept.substr(0, kept.find('\n')));
  EXPECT_EQ(first["x_firmware_z_mm"], -0.008);
  EXPECT_EQ(first["time"].size(), DrawnTap(0)["time"].size());
  const json& answer = first["x_trammel"];
  EXPECT_EQ(answer["verdict"], "good");
  EXPECT_EQ(answer["firmware_z_mm"], -0.008);
  EXPECT_THAT(answer["words"].get<std::string>(), HasSubstr("mm (95 %: "));
  const json& curve = answer["curve"];
  EXPECT_EQ(curve["time_s"].size(), curve["z_mm"].size());
  EXPECT_EQ(curve["time_s"].size(), curve["force_g"].size());
  EXPECT_GT(curve["contact_time_s"], curve["time_s"].front());
  EXPECT_LT(curve["contact_time_s"], curve["time_s"].back());
}

TEST_F(TapWatch, HandsTheContactBackToTheMacroThatAsks) {
  Start({"--answer", "--count", "1"});
  PushTap(DrawnTap(-0.01));
  Push("trammel_tap", {{"id", "bed 1\nG28"}});
  const std::string answer = Answer(1);
  EXPECT_THAT(answer,
              Containing("TRAMMEL_TAP_RESULT VERDICT=good Z=-0.0", " U=0.00", " ID=bed1G28"));
  EXPECT_THAT(answer, Not(HasSubstr("\n"))) << "no macro's word becomes a command";
  EXPECT_EQ(process_->Wait(30).exit_code, 0);
}

TEST_F(TapWatch, TheTapOfBeforeTheMacroIsNotTakenForItsOwn) {
  Start({"--answer", "--count", "2"});
  json before = DrawnTap(-0.5);
  before["x_rise_print_time_s"] = 100.0;
  PushTap(before);
  Push("trammel_tap", {{"since", 101.5}});  // its own tap is not complete yet
  json own = DrawnTap(-0.01);
  own["x_rise_print_time_s"] = 102.0;
  PushTap(own);
  EXPECT_THAT(Answer(1), HasSubstr("VERDICT=good Z=-0.0"));
  EXPECT_EQ(process_->Wait(30).exit_code, 0);
}

// A fork's tap does not tell when it rose: the macro tells how long it took itself.
TEST_F(TapWatch, ATapBeforeALongLiftIsTheMacrosOwn) {
  Start({"--answer", "--count", "2", "--answer-within", "0.5"});
  PushTap(DrawnTap(-0.01));
  std::this_thread::sleep_for(std::chrono::milliseconds(5600));
  Push("trammel_tap", {{"since", 101.5}, {"now", 109.0}});
  EXPECT_THAT(Answer(1), HasSubstr("VERDICT=good"));
  PushTap(DrawnTap(-0.01));
  std::this_thread::sleep_for(std::chrono::milliseconds(5600));
  Push("trammel_tap", {{"since", 111.5}, {"now", 111.5}});
  EXPECT_THAT(Answer(2), HasSubstr("REASON=no_tap"));
}

TEST_F(TapWatch, NonsenseFromThePrinterIsNamedAndWatchingGoesOn) {
  Start({"--count", "1"});
  Push(taps_method_, {{"tap", {{"time", "now"}, {"force", 3}, {"moves", {1}}}}});
  Push(taps_method_, json::array());
  Push("notify_status_update", json::array({{{"probe", {{"last_z_result", "high"}}}}, 1}));
  PushTap(DrawnTap(0));
  EXPECT_THAT(process_->Wait(30), Notes("cannot be read"));
}

}  // namespace
}  // namespace trammel::test
