// A server with a printer in memory and a shell script in place of trammel.
#include "service/job_server.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "base/bug_note.h"
#include "base/check.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "service/job_record.h"
#include "service/kept_results.h"
#include "session/crash_recovery.h"
#include "session/fake_printer.h"
#include "support/temporary_folder.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kUtc = "2026-01-02T03:04:05Z";
constexpr const char* kRun = "measure-20260102T030405Z";

measurement::Outcome OutcomeWith(const Measured& measured) {
  measurement::Outcome outcome;
  outcome.provenance = {measurement::Instrument::kPressureAdvance, "trammel 9.8.7", kUtc, {"rec"}};
  outcome.answers = {{"pressure_advance", "s", measured}};
  return outcome;
}

const Measured kGoodAnswer = Measured::Good({0.0172, 0.0004, {0.0164, 0.018}});

class JobServerTest : public ::testing::Test {
 protected:
  JobServerTest() {
    printer_.state.pressure_advance["extruder"].advance_s = 0.045;
    Answers(kGoodAnswer);
    Program("cp \"$here/result.json\" \"$folder\"\n");
    MakeServer();
  }
  ~JobServerTest() override { StopServing(); }

  // The script notes its words, and goes on after a file `go` has come where it is to wait.
  void Program(const std::string& script, int exit_code = 0) {
    const fs::path program = folder_.path() / "program";
    test::WriteWhole(program,
                     "#!/bin/sh\nhere='" + folder_.path().string() +
                         "'\nfor word in \"$@\"; do echo \"$word\" >> \"$here/words\"\n"
                         "case \"$word\" in --out=*) folder=\"${word#--out=}\";; esac; done\n"
                         "[ -n \"$folder\" ] && mkdir -p \"$folder\"\n" +
                         script + "exit " + std::to_string(exit_code) + "\n");
    fs::permissions(program, fs::perms::owner_all);
  }
  void Answers(const Measured& measured) {
    test::WriteWhole(folder_.path() / "result.json", files::ToJson(OutcomeWith(measured)));
  }
  void MakeServer() {
    JobKind kind;
    kind.name = "measure";
    kind.method = "ask_it";
    kind.arguments = {"filament", "temp"};
    kind.check = [this](const PrinterPlace&, const Arguments& arguments,
                        machine::Printer*) -> Result<Offer> {
      if (!blocker_.empty()) return Fail(blocker_);
      const auto filament = arguments.find("filament");
      return Offer{starts_unasked_ ? "" : "Is the bed empty?",
                   filament == arguments.end() ? Arguments{} : Arguments{{"filament", "key"}}};
    };
    kind.command = {"pa", "calibrate"};
    kind.instrument = kind_instrument_;
    kind.undo = {"pa", "apply", "--undo"};
    kind.apply = [](const std::string& folder, const Arguments&) {
      return std::vector<std::string>{"pa", "apply", folder};
    };
    kind.in_force = [this](const machine::PrinterState& state) {
      in_force_();
      return fmt::format("{:.4f} s", state.pressure_advance.at("extruder").advance_s);
    };
    kind.use = [](const PrinterPlace& place, const Arguments&) {
      EXPECT_EQ(place.address, "voron");
      return std::string("Use it");
    };
    kind.answer = [this](const std::string& folder) -> Result<AnswerSummary> {
      if (several_) return *several_;
      const auto outcome = TRY(files::ReadOutcome(folder));
      const Measured& value = outcome.answers.front().value;
      if (!value.good()) return AnswerSummary{value.verdict(), value.reason()};
      return AnswerSummary{Verdict::kGood, "0.01720 s"};
    };
    const PrinterPlace place{
        .config = "trammel.toml", .set = {"a=1"}, .address = "voron", .material = "pla"};
    job_server_ =
        std::make_unique<JobServer>(JobServerOptions{place,
                                                     "voron",
                                                     (folder_.path() / "program").string(),
                                                     "trammel 9.8.7",
                                                     folder_.path() / "recordings",
                                                     folder_.path(),
                                                     {kind},
                                                     [] { return std::string(kUtc); },
                                                     [](const std::string&) {}});
  }

  void Serve() {
    server_ = std::jthread([this](const std::stop_token& stop) {
      const auto served = job_server_->Serve(printer_, stop);
      EXPECT_TRUE(served) << served.error().message;
      was_working_ = served && *served;
    });
    WaitUntil([this] { return Status()["printer"]["readiness"] == "ready"; });
  }
  void StopServing() {
    if (!server_.joinable()) return;
    server_.request_stop();
    server_.join();
  }
  // Another service on the same files, as after a restart.
  void Restart() {
    StopServing();
    MakeServer();
    printer_.scripts.clear();
    Serve();
  }

  static void WaitUntil(const std::function<bool()>& so) {
    constexpr int kMax = 4000;
    for (int i = 0; i < kMax && !so(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ASSERT_TRUE(so());
  }

  json Ask(const std::string& method, const json& params = json::object()) {
    const machine::RpcAnswer answer = job_server_->Answer(method, params);
    EXPECT_EQ(answer.kind, machine::RpcAnswer::Kind::kResult) << answer.message;
    return answer.result;
  }
  int CodeOf(const std::string& method, const json& params = json::object()) {
    const machine::RpcAnswer answer = job_server_->Answer(method, params);
    message_ = answer.message;
    return answer.kind == machine::RpcAnswer::Kind::kError ? answer.code : 0;
  }
  json Status() { return Ask("status"); }
  std::string Start(const json& arguments = json::object()) {
    return Ask("start", {{"job", "measure"}, {"arguments", arguments}})["run"];
  }
  void WaitForEnd() {
    WaitUntil([this] { return !Status()["busy"].get<bool>(); });
  }
  std::vector<std::string> ProgramArguments() {
    std::vector<std::string> words;
    std::string text = test::ReadWhole(folder_.path() / "words");
    for (std::size_t end = 0; (end = text.find('\n')) != std::string::npos;) {
      words.push_back(text.substr(0, end));
      text.erase(0, end + 1);
    }
    return words;
  }
  void KeepResult(const std::string& run, const measurement::Outcome& outcome) {
    const fs::path folder = folder_.path() / "recordings" / run;
    fs::create_directories(folder);
    test::WriteWhole(folder / "result.json", files::ToJson(outcome));
  }
  // Returns a shell line that notes the set answer.
  std::string Notes() {
    const fs::path file = folder_.path() / "noted";
    fs::remove(file);
    EXPECT_TRUE(files::NoteApplication(file, OutcomeWith(kGoodAnswer), {kUtc, "voron"}));
    return "cat \"$here/noted\" >> \"$here/applied.jsonl\"\n";
  }
  // The token of the dialog that was opened last.
  std::string Token() {
    const std::string key = "TOKEN=";
    WaitUntil([&] { return !printer_.LastScriptWith(key).empty(); });
    const std::string dialog = printer_.LastScriptWith(key);
    const std::size_t at = dialog.find(key) + key.size();
    return dialog.substr(at, dialog.find(' ', at) - at);
  }
  // A printer's macro calls us, on the connection's thread.
  void CallMacro(const std::string& method, const json& arguments = json::object()) {
    WaitUntil([&] { return printer_.Registered(method); });
    printer_.methods[method](arguments);
  }

  test::TemporaryFolder folder_;
  procedure::testing::FakePrinter printer_;
  std::function<void()> in_force_ = [] {};
  std::optional<AnswerSummary> several_;
  std::string blocker_;
  measurement::Instrument kind_instrument_ = measurement::Instrument::kPressureAdvance;
  std::string message_;
  bool starts_unasked_ = false;
  bool was_working_ = false;
  std::unique_ptr<JobServer> job_server_;
  std::jthread server_;
};

TEST_F(JobServerTest, ARunIsFollowedToItsAnswerAndNothingIsApplied) {
  Program(
      "echo '{\"progress\":\"printing\",\"phase\":\"printing\",\"done\":0.5}' >&2\n"
      "cp \"$here/result.json\" \"$folder\"\n");
  Serve();
  EXPECT_EQ(Start({{"filament", "--out=x y"}, {"temp", "240"}}), kRun);
  WaitForEnd();
  const json status = Status();
  const json& run = status["run"];
  EXPECT_EQ(run["run"], kRun);
  EXPECT_EQ(run["end"], "done");
  EXPECT_EQ(run["verdict"], "good");
  EXPECT_THAT(run["message"], HasSubstr("0.01720 s"));
  EXPECT_EQ(status["proposal"]["run"], kRun);
  const json result = Ask("result", {{"run", kRun}});
  EXPECT_EQ(result["result"]["verdict"], "good");
  EXPECT_EQ(result["run"]["complete"], true);
  const std::string out = "--out=" + (folder_.path() / "recordings" / kRun).string();
  EXPECT_THAT(ProgramArguments(),
              ElementsAre("--progress", "json", "pa", "calibrate", "--config=trammel.toml",
                          "--set=a=1", "--printer=voron", "--material=pla", "--filament=--out=x y",
                          "--set=filament.nozzle_temperature=240", out));
  StopServing();
  EXPECT_FALSE(was_working_);
  std::vector<std::string> phases;
  for (const auto& [event, data] : printer_.events) {
    EXPECT_EQ(event, "run");
    EXPECT_EQ(data["run"], kRun);
    phases.push_back(data["phase"]);
  }
  EXPECT_THAT(phases, ElementsAre("starting", "printing", "ended"));
  EXPECT_EQ(printer_.events[1].second["progress"], 0.5);
  EXPECT_EQ(printer_.events.back().second["complete"], true);
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("TRAMMEL_ASK BUTTONS=use MSG=\"0.01720 s")));
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("now 0.0450 s. Nothing applied")));
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("s. In force now: 0.0450 s. Use it?\"")));
}

TEST_F(JobServerTest, AnAnswerOfSeveralValuesIsSaidLineByLineAndOfferedAtOnce) {
  several_ = AnswerSummary{Verdict::kGood, "T1 and T2", {"tool_offset T1 x = 1", "tool_offset T2"}};
  MakeServer();
  Serve();
  (void)Start();
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["message"], "T1 and T2");
  EXPECT_EQ(Status()["proposal"]["answer"], "T1 and T2");
  Program(Notes() + "echo 'trammel: T2 did not answer' >&2\n", 3);
  (void)Ask("start", {{"job", "apply"}});
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["message"], "applied in part: T2 did not answer");
  StopServing();
  for (const char* said : {"MSG=\"tool_offset T1 x = 1\"", "MSG=\"tool_offset T2\"",
                           "TRAMMEL_ASK BUTTONS=use MSG=\"T1 and T2."}) {
    EXPECT_THAT(printer_.scripts, Contains(HasSubstr(said)));
  }
}

TEST_F(JobServerTest, AnAnswerThatIsNotGoodIsNoProposal) {
  Answers(Measured::CannotTell("too few lines"));
  Program("cp \"$here/result.json\" \"$folder\"\n", 2);
  Serve();
  (void)Start();
  WaitForEnd();
  const json status = Status();
  EXPECT_EQ(status["run"]["verdict"], "cannot_tell");
  EXPECT_EQ(status["run"]["message"], "too few lines");
  EXPECT_EQ(status["proposal"], nullptr);
  EXPECT_EQ(CodeOf("start", {{"job", "apply"}}), kNothing);
}

TEST_F(JobServerTest, AFailureIsToldInItsLastErrorsWords) {
  Program(
      "echo 'trammel: NOT AS IT WAS: the bed' >&2\necho 'trammel: the camera is away' >&2\n"
      "echo '  > details' >&2\n",
      3);
  Serve();
  (void)Start();
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["end"], "failed");
  EXPECT_EQ(Status()["run"]["message"], "the camera is away; NOT AS IT WAS: the bed");
  EXPECT_EQ(Status()["run"]["verdict"], nullptr);
  StopServing();
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("MSG=\"NOT AS IT WAS: the bed")));
  EXPECT_THAT(printer_.scripts,
              Contains(HasSubstr("BUTTONS=close MSG=\"no calibration: the camera")));
}

TEST_F(JobServerTest, WhyARunEndedIsSaidWhenThePrinterIsBackFromItsEmergencyStop) {
  Program("while [ ! -e \"$here/go\" ]; do sleep 0.01; done\necho 'trammel: it was stopped' >&2\n",
          3);
  Serve();
  Start();
  WaitUntil([this] { return Status()["busy"].get<bool>(); });
  (void)printer_.EmergencyStop({1});
  test::WriteWhole(folder_.path() / "go", "");
  WaitForEnd();
  WaitUntil([this] { return Status()["printer"]["readiness"] == "ready"; });
  StopServing();
  EXPECT_THAT(printer_.scripts,
              Contains(HasSubstr("TRAMMEL_ASK BUTTONS=close MSG=\"no calibration: "
                                 "it was stopped")));
}

TEST_F(JobServerTest, OneJobAtATimeAndStopEndsItSafely) {
  Program(
      "trap 'echo safe > \"$here/safe\"; exit 130' TERM\n"
      ": > \"$here/ready\"\n"
      "while :; do sleep 0.01; done\n");
  Serve();
  const std::string run = Start();
  EXPECT_EQ(CodeOf("start", {{"job", "measure"}}), kBusy);
  EXPECT_THAT(message_, HasSubstr(run));
  EXPECT_THAT(Status()["jobs"][0]["blocker"], HasSubstr(run));
  EXPECT_EQ(CodeOf("stop", {{"run", "measure-other"}}), kNothing);
  WaitUntil([this] { return fs::exists(folder_.path() / "ready"); });
  EXPECT_EQ(Ask("stop")["run"], run);
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["end"], "stopped");
  EXPECT_EQ(test::ReadWhole(folder_.path() / "safe"), "safe\n");
  EXPECT_EQ(CodeOf("stop"), kNothing);
}

// The command catches signals some milliseconds after its start.
TEST_F(JobServerTest, AStopBeforeTheCommandCanCatchItIsAStop) {
  Serve();
  Program("exec sleep 60\n");
  (void)Start();
  (void)Ask("stop");
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["end"], "stopped");
  EXPECT_THAT(Status()["run"]["message"], HasSubstr("signal 15"));
}

TEST_F(JobServerTest, RequestsThatMakeNoSenseAreRefusedByName) {
  Serve();
  EXPECT_EQ(CodeOf("format_disk"), machine::kUnknownMethod);
  EXPECT_EQ(CodeOf("status", json::array({1})), kInvalidParameters);
  EXPECT_EQ(CodeOf("status", {{"a", 1}}), kInvalidParameters);
  EXPECT_EQ(CodeOf("start", json::object()), kInvalidParameters);
  EXPECT_EQ(CodeOf("start", {{"job", "cook"}}), kInvalidParameters);
  EXPECT_THAT(message_, HasSubstr("measure"));
  EXPECT_EQ(CodeOf("start", {{"job", 3}}), kInvalidParameters);
  EXPECT_EQ(CodeOf("start", {{"job", "measure"}, {"arguments", {{"gcode", "G28"}}}}),
            kInvalidParameters);
  EXPECT_THAT(message_, HasSubstr("gcode"));
  EXPECT_EQ(CodeOf("start", {{"job", "measure"}, {"arguments", {{"filament", 3}}}}),
            kInvalidParameters);
  EXPECT_EQ(
      CodeOf("start", {{"job", "measure"}, {"arguments", {{"filament", std::string(300, 'a')}}}}),
      kInvalidParameters);
  EXPECT_EQ(CodeOf("result", {{"run", "../../etc"}}), kInvalidParameters);
  EXPECT_EQ(CodeOf("result", {{"run", "measure-never"}}), kNothing);
  EXPECT_EQ(CodeOf("history", {{"last", -1}}), kInvalidParameters);
  EXPECT_EQ(CodeOf("history", {{"instrument", "spoon"}}), kInvalidParameters);
  blocker_ = "name the material";
  EXPECT_EQ(CodeOf("start", {{"job", "measure"}}), kRefused);
  EXPECT_EQ(Status()["jobs"][0]["blocker"], "name the material");
  EXPECT_THAT(ProgramArguments(), ElementsAre());
}

TEST_F(JobServerTest, AProposalSurvivesARestartAndIsOfferedAgainUntilItIsDecidedOn) {
  Serve();
  (void)Start();
  WaitForEnd();
  Restart();
  EXPECT_EQ(Status()["proposal"]["run"], kRun);
  EXPECT_EQ(Status()["run"]["end"], "done");
  WaitUntil([this] { return !printer_.LastScriptWith("TRAMMEL_ASK BUTTONS=use").empty(); });
  EXPECT_EQ(Ask("dismiss")["dismissed"], true);
  EXPECT_EQ(Ask("dismiss")["dismissed"], false);
  Restart();
  EXPECT_EQ(Status()["proposal"], nullptr);
  StopServing();
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("TRAMMEL_ASK"))));
}

TEST_F(JobServerTest, WhatWasDroppedOnAFullDiskIsNotOfferedAgain) {
  Serve();
  Start();
  WaitForEnd();
  StopServing();
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit full = before;
  full.rlim_cur = 0;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  const json dropped = Ask("dismiss");
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  (void)std::signal(SIGXFSZ, handler);
  EXPECT_EQ(dropped["dismissed"], true);
  MakeServer();
  EXPECT_EQ(Status()["proposal"], nullptr);
}

TEST_F(JobServerTest, ApplyingRunsTheCommandAndDecidesTheProposal) {
  Serve();
  const std::string run = Start();
  WaitForEnd();
  Program("echo 'pressure advance  0.0450  ->  0.0172 s'\necho 'kept for          x'\n");
  fs::remove(folder_.path() / "words");
  CallMacro("trammel_apply");
  WaitUntil([this] { return Status()["run"]["job"] == "apply" && !Status()["busy"]; });
  EXPECT_EQ(Status()["run"]["end"], "done");
  EXPECT_EQ(Status()["run"]["message"], "pressure advance 0.0450 -> 0.0172 s; kept for x");
  EXPECT_EQ(Status()["proposal"], nullptr);
  EXPECT_THAT(ProgramArguments(),
              ElementsAre("--progress", "json", "pa", "apply",
                          (folder_.path() / "recordings" / run).string(), "--config=trammel.toml",
                          "--set=a=1", "--printer=voron"));
}

TEST_F(JobServerTest, WhereOnlyTheKeepingFailsItSaysThatTheValueIsSet) {
  Serve();
  (void)Start();
  WaitForEnd();
  // Whatever its sentences begin with: what is noted of the result decides.
  Program(Notes() + "echo 'set: 0.0172'\necho 'trammel: the printer keeps nothing' >&2\n", 1);
  (void)Ask("start", {{"job", "apply"}});
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["end"], "failed");
  EXPECT_EQ(Status()["run"]["message"], "applied in part: the printer keeps nothing");
  EXPECT_EQ(Status()["proposal"]["run"], kRun);  // to be applied again after the repair
  StopServing();
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("not applied"))));
}

// Neither "applied" nor "not applied" would be true.
TEST_F(JobServerTest, OfAnApplicationThatIsKilledItSaysWhatIsInForce) {
  Serve();
  (void)Start();
  WaitForEnd();
  Program("kill -9 $$\n");
  (void)Ask("start", {{"job", "apply"}});
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["end"], "failed");
  EXPECT_THAT(
      Status()["run"]["message"].get<std::string>(),
      HasSubstr("whether it was applied is not known, in force is 0.0450 s: TRAMMEL_APPLY"));
  EXPECT_EQ(Status()["proposal"]["run"], kRun);
}

TEST_F(JobServerTest, MacrosAskOfferStartAndDrop) {
  Serve();
  CallMacro("trammel_apply");
  CallMacro("ask_it", {{"filament", "PLA+"}, {"other", 3}});
  CallMacro("trammel_start", {{"token", Token()}});
  WaitUntil([this] { return Status()["proposal"] != nullptr; });
  EXPECT_EQ(Status()["proposal"]["arguments"], (json{{"filament", "PLA+"}}));
  CallMacro("trammel_dismiss");
  WaitUntil([this] { return Status()["proposal"] == nullptr; });
  StopServing();
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("nothing to apply")));
  EXPECT_THAT(printer_.scripts, Contains("TRAMMEL_ASK BUTTONS=start TOKEN=20260102T030405Z-1 "
                                         "MSG=\"Is the bed empty?\""));
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("at work")));
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("nothing applied")));
}

TEST_F(JobServerTest, AButtonBeginsWhatItsOwnDialogAskedOnce) {
  Serve();
  for (const json& given : {json::object(), json{{"token", ""}}, json{{"token", 3}},
                            json{{"token", "20260102T030405Z-1"}}}) {
    CallMacro("trammel_start", given);  // no dialog is open
  }
  CallMacro("ask_it");
  const std::string first = Token();
  CallMacro("ask_it", {{"filament", "PLA+"}});
  WaitUntil([&] { return Token() != first; });
  CallMacro("trammel_start", {{"token", first}});  // from a page not reloaded
  CallMacro("trammel_start", {{"token", Token()}});
  WaitUntil([this] { return Status()["proposal"] != nullptr; });
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["arguments"], (json{{"filament", "PLA+"}}));
  const std::string used = Token();
  CallMacro("trammel_dismiss");
  CallMacro("trammel_start", {{"token", used}});
  WaitUntil([this] {
    return !printer_.LastScriptWith("nothing to drop").empty() || Status()["proposal"] == nullptr;
  });
  CallMacro("trammel_dismiss");  // behind it
  WaitUntil([this] { return !printer_.LastScriptWith("nothing to drop").empty(); });
  StopServing();
  int closed = 0;
  for (const std::string& script : printer_.scripts) {
    closed += script.find("that dialog is closed, and nothing was started") != std::string::npos;
  }
  EXPECT_EQ(closed, 6);
}

// As from a page, while the dialog is open: its print lies on the bed now.
TEST_F(JobServerTest, ADialogStartsNothingAfterAnotherRun) {
  Serve();
  CallMacro("ask_it");
  const std::string token = Token();
  Start();
  WaitForEnd();
  const std::string last = Status()["run"]["run"];
  WaitUntil([this] { return !printer_.LastScriptWith("_TRAMMEL_CLOSE").empty(); });
  CallMacro("trammel_start", {{"token", token}});
  WaitUntil([this] { return !printer_.LastScriptWith("that dialog is closed").empty(); });
  EXPECT_EQ(Status()["run"]["run"], last);
}

TEST_F(JobServerTest, WhatMovesNothingIsStartedUnaskedWithWhatFollowsFromIt) {
  starts_unasked_ = true;
  MakeServer();
  Serve();
  CallMacro("ask_it", {{"filament", "PLA+"}});
  WaitUntil([this] { return Status()["proposal"] != nullptr; });
  EXPECT_EQ(Status()["proposal"]["arguments"], (json{{"filament", "PLA+"}}));
}

TEST_F(JobServerTest, ANewNozzleIsNotedAndDropsTheAnswerOfTheOldOne) {
  Serve();
  Start();
  WaitForEnd();
  ASSERT_NE(Status()["proposal"], nullptr);
  CallMacro("trammel_new_nozzle");
  WaitUntil([this] { return Status()["proposal"] == nullptr; });
  const auto history = files::ReadHistory(folder_.path() / "recordings", {});
  ASSERT_TRUE(history && history->nozzle_changes.size() == 1U);
  EXPECT_EQ(history->nozzle_changes[0].utc, kUtc);
  EXPECT_EQ(history->nozzle_changes[0].printer, procedure::PrinterName("voron"));
  EXPECT_EQ(CodeOf("start", {{"job", "apply"}}), kNothing);
  StopServing();
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("the answer that waited is dropped")));
}

TEST_F(JobServerTest, ABugInARunIsSaidAndEndsNeitherTheServerNorTheProcess) {
  in_force_ = [test = std::this_thread::get_id()] {
    if (std::this_thread::get_id() != test) throw Bug("one is not two");
  };
  Serve();
  (void)Start();
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["end"], "failed");
  EXPECT_THAT(Status()["run"]["message"], HasSubstr("one is not two"));
  EXPECT_TRUE(NotedBug());
  in_force_ = [] {};
  const std::string again = Start();
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["run"], again);
  EXPECT_EQ(Status()["run"]["end"], "done");
}

// As a photo that a browser uploaded, or an answer of last month.
TEST_F(JobServerTest, UsesAGoodResultOfTheHistoryAndSetsItBack) {
  std::vector<std::string> events;
  job_server_->OnEvent([&events](const std::string& event, const json& data) {
    events.push_back(event == "run" ? data["phase"].get<std::string>() : event);
  });
  const json asked = {{"run", "photo-1"}, {"filament", "key"}};
  EXPECT_EQ(CodeOf("use", {{"run", "../x"}}), kInvalidParameters);
  EXPECT_EQ(CodeOf("use", asked), kNothing) << "no such run";
  KeepResult("photo-1", OutcomeWith(kGoodAnswer));
  EXPECT_EQ(CodeOf("use", asked), kBusy) << "not connected";
  KeepResult("refused-1", OutcomeWith(Measured::Refused("too dark")));
  EXPECT_EQ(CodeOf("use", {{"run", "refused-1"}}), kNothing);
  measurement::Outcome sheet = OutcomeWith(kGoodAnswer);
  sheet.provenance.instrument = measurement::Instrument::kToolOffset;
  KeepResult("sheet-1", sheet);
  EXPECT_EQ(CodeOf("use", {{"run", "sheet-1"}}), kRefused) << "no job sets it";
  EXPECT_EQ(CodeOf("undo", {{"instrument", "tool_offset"}}), kRefused);
  EXPECT_EQ(CodeOf("undo", {{"instrument", "x"}}), kInvalidParameters);
  Program("echo 'pressure advance  0.0450  ->  0.0172 s'\n");
  Serve();
  EXPECT_EQ(Status()["in_force"], "0.0450 s");
  (void)Ask("use", asked);
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["job"], "apply");
  EXPECT_EQ(Status()["run"]["end"], "done");
  EXPECT_EQ(Status()["run"]["looks"], false);
  EXPECT_THAT(ProgramArguments(), Contains((folder_.path() / "recordings/photo-1").string()));
  fs::remove(folder_.path() / "words");
  Program("echo 'pressure advance  0.0172  ->  0.0450 s'\n");
  (void)Ask("undo", {{"instrument", "pressure_advance"}});
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["job"], "undo");
  EXPECT_THAT(ProgramArguments(),
              ElementsAre("--progress", "json", "pa", "apply", "--undo", "--config=trammel.toml",
                          "--set=a=1", "--printer=voron"));
  Program("echo 'trammel: nothing to undo' >&2\n", 1);
  (void)Ask("undo", {{"instrument", "pressure_advance"}});
  WaitForEnd();
  EXPECT_EQ(Status()["run"]["message"], "nothing to undo");
  StopServing();
  EXPECT_EQ(events.front(), "changed");
  EXPECT_EQ(events.back(), "ended");
}

TEST_F(JobServerTest, OffsetsOfAnotherPrinterAreNotSet) {
  measurement::Outcome outcome = OutcomeWith(kGoodAnswer);
  outcome.provenance.instrument = measurement::Instrument::kToolOffset;
  outcome.subject.printer = "ender";
  kind_instrument_ = measurement::Instrument::kToolOffset;
  MakeServer();
  KeepResult("sheet-1", outcome);
  EXPECT_EQ(CodeOf("use", {{"run", "sheet-1"}}), kRefused);
  EXPECT_THAT(message_, HasSubstr("measured on ender"));
  outcome.subject.printer = "http://voron/";
  KeepResult("sheet-2", outcome);
  EXPECT_EQ(CodeOf("use", {{"run", "sheet-2"}}), kBusy) << "not connected";
}

TEST_F(JobServerTest, ComparesResultsAndKeepsWhatTheirOwnerNotes) {
  measurement::Outcome other = OutcomeWith(Measured::Good({0.0272, 0.0004, {0.0264, 0.028}}));
  other.subject.nozzle = "0.60";
  KeepResult("a-1", OutcomeWith(kGoodAnswer));
  KeepResult("b-1", other);
  const json compared = Ask("compare", {{"before", "a-1"}, {"after", "b-1"}});
  EXPECT_EQ(compared["changes"][0]["differs"], true);
  EXPECT_THAT(compared["changes"][0]["words"].get<std::string>(), HasSubstr("+0.0100 s (95 %"));
  EXPECT_THAT(compared["others"], ElementsAre("another nozzle: not noted, then 0.60"));
  EXPECT_EQ(CodeOf("compare", {{"before", "a-1"}, {"after", "c"}}), kNothing);
  EXPECT_EQ(CodeOf("compare", {{"before", "a-1"}}), kNothing);

  const auto row = [this](const std::string& run) {
    const json history = Ask("history");
    for (const json& result : history["results"]) {
      if (result["run"] == run) return result;
    }
    return json();
  };
  EXPECT_EQ(row("a-1")["note"], "");
  const std::string note = "new nozzle\n\xc3\xa4";
  (void)Ask("annotate", {{"run", "a-1"}, {"note", note}, {"pinned", true}});
  EXPECT_EQ(row("a-1")["note"], note);
  EXPECT_EQ(row("a-1")["answers"][0]["words"], "0.01720 s (95 %: 0.01640 to 0.01800 s)");
  EXPECT_EQ(CodeOf("delete", {{"run", "a-1"}}), kRefused);
  EXPECT_THAT(message_, HasSubstr("pinned"));
  EXPECT_EQ(Ask("annotate", {{"run", "a-1"}, {"pinned", false}})["note"], note);
  for (const json& wrong : {json{{"run", "a-1"}, {"pinned", 1}}, json{{"run", "a-1"}, {"note", 1}},
                            json{{"run", "a-1"}, {"note", std::string(501, 'x')}},
                            json{{"run", "a-1"}, {"note", "\x01"}}, json{{"run", "a/b"}}}) {
    EXPECT_EQ(CodeOf("annotate", wrong), kInvalidParameters) << wrong.dump();
  }
  (void)Ask("delete", {{"run", "a-1"}});
  EXPECT_TRUE(row("a-1").is_null());
  EXPECT_FALSE(fs::exists(folder_.path() / "recordings/a-1"));
  EXPECT_EQ(CodeOf("delete", {{"run", "a-1"}}), kNothing);
  EXPECT_EQ(CodeOf("delete", {{"run", ".."}}), kInvalidParameters);
}

TEST_F(JobServerTest, ARecordingAtWorkIsNotDeletedAndOtherFoldersNever) {
  const fs::path documents = folder_.path() / "recordings/Documents";
  fs::create_directories(documents);
  EXPECT_EQ(CodeOf("delete", {{"run", "Documents"}}), kNothing);
  EXPECT_EQ(CodeOf("annotate", {{"run", "Documents"}, {"note", "x"}}), kNothing);
  EXPECT_TRUE(fs::exists(documents));
  Program(
      "while [ ! -e \"$here/go\" ]; do sleep 0.01; done\n"
      "cp \"$here/result.json\" \"$folder\"\n");
  Serve();
  const std::string run = Start();
  WaitUntil([&] { return fs::exists(folder_.path() / "recordings" / run); });
  JobServer other(job_server_->options());  // of another printer
  EXPECT_EQ(other.Answer("delete", {{"run", run}}).code, kBusy);
  EXPECT_EQ(CodeOf("delete", {{"run", run}}), kBusy);
  test::WriteWhole(folder_.path() / "go", "");
  WaitForEnd();
  (void)Ask("dismiss");
  EXPECT_EQ(other.Answer("delete", {{"run", run}}).kind, machine::RpcAnswer::Kind::kResult);
}

TEST_F(JobServerTest, AValueThatIsNotSetLeavesTheAnswerThatWaits) {
  Serve();
  const std::string run = Start();
  WaitForEnd();
  KeepResult("old-1", OutcomeWith(kGoodAnswer));
  Program("echo 'trammel: too high' >&2\n", 1);
  (void)Ask("use", {{"run", "old-1"}});
  WaitForEnd();
  EXPECT_EQ(Status()["proposal"]["run"], run);
  EXPECT_EQ(CodeOf("start", {{"job", "apply"}, {"arguments", {{"run", "old-1"}}}}), kNothing);
  EXPECT_THAT(message_, HasSubstr("waits no more"));
  EXPECT_EQ(CodeOf("undo", {{"instrument", "pressure_advance"}, {"run", "old-1"}}), kRefused);
  EXPECT_THAT(message_, HasSubstr("another value was set since"));
}

TEST_F(JobServerTest, AnAnswerThatWaitsIsNotDeleted) {
  Serve();
  const std::string run = Start();
  WaitForEnd();
  EXPECT_EQ(CodeOf("delete", {{"run", run}}), kRefused);
  EXPECT_THAT(message_, HasSubstr("waits"));
  (void)Ask("dismiss");
  (void)Ask("delete", {{"run", run}});
}

TEST_F(JobServerTest, NamesWhatIsDueOfItsOwnPrinter) {
  EXPECT_TRUE(Ask("due")["due"].empty());
  measurement::Outcome old = OutcomeWith(kGoodAnswer);
  old.provenance.utc = "2025-01-02T03:04:05Z";
  old.subject = {.printer = "voron", .filament = "pla"};
  KeepResult("a-1", old);
  old.subject.printer = "ender";
  KeepResult("b-1", old);
  const json due = Ask("due")["due"];
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0]["subject"]["filament"], "pla");
  EXPECT_THAT(due[0]["reasons"].dump(), HasSubstr("365 days old"));
}

TEST_F(JobServerTest, AnEmergencyStopReachesAConnectedPrinter) {
  EXPECT_EQ(job_server_->EmergencyStop().code, kRefused);
  Serve();
  EXPECT_EQ(job_server_->EmergencyStop().kind, machine::RpcAnswer::Kind::kResult);
  EXPECT_TRUE(printer_.stopped);
}

TEST_F(JobServerTest, TellsTheQuestionBeforeAJob) {
  EXPECT_EQ(job_server_->OfferAsked({{"job", "measure"}}).result.at("question"),
            "Is the bed empty?");
  EXPECT_EQ(job_server_->OfferAsked({{"job", "x"}}).code, kInvalidParameters);
  EXPECT_EQ(job_server_->OfferAsked({{"job", "measure"}, {"arguments", {{"x", "1"}}}}).code,
            kInvalidParameters);
  blocker_ = "no material";
  EXPECT_EQ(job_server_->OfferAsked({{"job", "measure"}}).message, "no material");
}

TEST_F(JobServerTest, SetsAPrinterUpOnlyWhileItIsColdAndIdle) {
  EXPECT_EQ(job_server_->SetUp("setup", {}).code, kRefused) << "not connected";
  Serve();
  EXPECT_EQ(job_server_->SetUp("setup", {}).result.at("has_macros"), true);
  printer_.state.heaters["extruder"].target_c = 200;
  EXPECT_THAT(job_server_->SetUp("set_up", {}).message, HasSubstr("extruder is on"));
  printer_.state.heaters.clear();
  printer_.state.print_state = "printing";
  EXPECT_EQ(job_server_->SetUp("undo_set_up", {}).code, kBusy);
  EXPECT_TRUE(printer_.config_files.empty());
}

TEST_F(JobServerTest, APrinterHasOneNameInTheHistoryWhateverItsAddress) {
  const fs::path recordings = folder_.path() / "recordings";
  for (const char* printer :
       {"voron.local:80", "http://voron.local/", "voron.local:7125", "ender"}) {
    measurement::Outcome outcome = OutcomeWith(kGoodAnswer);
    outcome.subject.printer = printer;
    const fs::path folder = recordings / std::to_string(std::string(printer).size());
    fs::create_directories(folder);
    ASSERT_TRUE(files::KeepOutcome(folder, outcome));
  }
  files::HistoryQuery query;
  query.subject.printer = "https://Voron.local/websocket";
  const auto history = ReadHistoryByPrinter(recordings, query);
  ASSERT_TRUE(history && history->entries.size() == 3U);
  for (const auto& entry : history->entries) {
    EXPECT_EQ(entry.outcome.subject.printer, "voron.local:7125");
  }
  query.last = 2;
  EXPECT_EQ(ReadHistoryByPrinter(recordings, query)->entries.size(), 2U);
}

}  // namespace
}  // namespace trammel::service
