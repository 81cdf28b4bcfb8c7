#include "panel/panel.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "measurement/outcome_file.h"
#include "panel/http_test_client.h"
#include "panel/page_files.h"
#include "service/job_record.h"
#include "support/temporary_folder.h"

namespace trammel::panel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

constexpr const char* kUtc = "2026-01-02T03:04:05Z";
constexpr const char* kRun = "upload-20260102T030405Z";

constexpr const char* kMeasures =
    "cp \"$here/result.json\" \"$result\"\nmkdir \"$figures\"\n"
    "printf picture > \"$figures/answer.png\"\n";

// A panel of one printer that is not connected, and a stand-in of trammel that writes its words
// and a result.
class PanelTest : public ::testing::Test {
 protected:
  PanelTest() {
    Program(
        "cp \"$here/result.json\" \"$result\"\nmkdir \"$figures\"\n"
        "printf picture > \"$figures/answer.png\"\n");
    Result(Measured::Good({0.0172, 0.0004, {0.0164, 0.018}}));
    fs::create_directories(recordings_);
    service::JobServerOptions options;
    options.address = "voron";
    options.recordings = recordings_;
    options.state_folder = folder_.path();
    options.utc_now = [] { return std::string(kUtc); };
    options.log = [](const std::string&) {};
    server_ = std::make_unique<service::JobServer>(options);
    auto panel = Panel::Open(
        {{},
         {(folder_.path() / "program").string(), recordings_, options.utc_now, options.log},
         true});
    EXPECT_TRUE(panel) << panel.error().message;
    panel_ = std::move(*panel);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      service::JobServer* const servers[] = {server_.get()};
      panel_->Run(servers, stop);
    });
  }

  void Program(const std::string& script) {
    const fs::path program = folder_.path() / "program";
    test::WriteWhole(program, "#!/bin/sh\nhere='" + folder_.path().string() +
                                  "'\nfor word in \"$@\"; do echo \"$word\" >> \"$here/words\"\n"
                                  "case \"$word\" in --result=*) result=\"${word#--result=}\";; "
                                  "--figures=*) figures=\"${word#--figures=}\";; esac; done\n" +
                                  script);
    fs::permissions(program, fs::perms::owner_all);
  }

  void Result(const Measured& measured) {
    measurement::Outcome outcome;
    outcome.provenance = {
        measurement::Instrument::kPressureAdvance, "trammel 9.8.7", kUtc, {"photo.jpg"}};
    outcome.answers = {{"pressure_advance", "s", measured}};
    test::WriteWhole(folder_.path() / "result.json", files::ToJson(outcome));
  }

  std::string Get(const std::string& path) {
    return Connection(panel_->port())
        .Send(fmt::format("GET {} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n", path))
        .ReadAll();
  }

  std::string Post(const std::string& path, const std::string& type, const std::string& body) {
    return Connection(panel_->port())
        .Send(fmt::format("POST {} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
                          "Content-Type: {}\r\nContent-Length: {}\r\n\r\n{}",
                          path, type, body.size(), body))
        .ReadAll();
  }

  json Ask(const std::string& method, const json& params) {
    return Say(json{{"id", 1}, {"method", method}, {"params", params}}.dump());
  }

  json Say(const std::string& text) {
    if (!socket_) socket_ = Socket::Open(panel_->port());
    socket_->Write(text);
    for (;;) {
      const json answer = json::parse(socket_->Read());
      if (!answer.contains("method")) return answer;
    }
  }

  test::TemporaryFolder folder_;
  const fs::path recordings_ = folder_.path() / "recordings";
  std::unique_ptr<service::JobServer> server_;
  std::unique_ptr<Panel> panel_;
  std::jthread thread_;
  std::unique_ptr<Socket> socket_;
};

TEST_F(PanelTest, ServesItsPageAndNothingElseOfTheDisk) {
  EXPECT_THAT(Get("/"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("text/html"),
                              HasSubstr("Content-Encoding: gzip")));
  for (const PageFile& file : PageFiles()) {
    EXPECT_THAT(Get(file.path), StartsWith("HTTP/1.1 200")) << file.path;
  }
  fs::create_directories(recordings_ / kRun);
  test::WriteWhole(recordings_ / kRun / "secret.txt", "secret");
  test::WriteWhole(recordings_ / kRun / "result.json", "{}");
  fs::create_directory_symlink(folder_.path(), recordings_ / "link");
  for (const std::string& path :
       {"/runs/" + std::string(kRun) + "/secret.txt", "/runs/" + std::string(kRun) + "/",
        "/runs/" + std::string(kRun), std::string("/runs/link/result.json"),
        std::string("/runs//result.json"), std::string("/runs/./result.json"),
        std::string("/panel.css/"), std::string("/etc/passwd"),
        std::string("/runs/none/result.json")}) {
    EXPECT_THAT(Get(path), StartsWith("HTTP/1.1 404")) << path;
  }
  EXPECT_THAT(Get("/runs/" + std::string(kRun) + "/result.json"), StartsWith("HTTP/1.1 200"));
}

TEST_F(PanelTest, MeasuresAnUploadedPhotoAndShowsItsPicture) {
  EXPECT_THAT(Post("/photos", "image/jpeg", "bytes"), HasSubstr(kRun));
  EXPECT_EQ(test::ReadWhole(recordings_ / kRun / "photo.jpg"), "bytes");
  EXPECT_THAT(Post("/gcodes?run=" + std::string(kRun), "application/octet-stream", "G1"),
              StartsWith("HTTP/1.1 200"));
  const json answer =
      Ask("measure", {{"run", kRun}, {"pattern", "orca-line"}, {"filament", "My PETG"}})
          .at("result");
  EXPECT_EQ(answer["verdict"], "good");
  EXPECT_EQ(answer["words"], "0.01720 s (95 %: 0.01640 to 0.01800 s)");
  EXPECT_EQ(answer["value_s"], 0.0172);
  EXPECT_THAT(answer["pictures"], ElementsAre("answer.png"));
  EXPECT_THAT(answer["lines"].dump(), AllOf(HasSubstr("SET_PRESSURE_ADVANCE ADVANCE=0.0172"),
                                            HasSubstr("M900 K0.0172"), HasSubstr("OrcaSlicer")));
  EXPECT_THAT(test::ReadWhole(folder_.path() / "words"),
              AllOf(HasSubstr("photo.jpg\n"), HasSubstr("--gcode="), HasSubstr("photo.gcode"),
                    HasSubstr("--filament=My PETG\n")));
  EXPECT_THAT(Get("/runs/" + std::string(kRun) + "/answer.png"),
              AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("image/png"), HasSubstr("picture")));
  const json result = Ask("history", {{"last", 1}}).at("result").at("results")[0];
  EXPECT_EQ(result.at("answers")[0].at("words"), "0.01720 s (95 %: 0.01640 to 0.01800 s)");
  // A measuring that fails leaves the result of the one before.
  for (const char* pattern : {"nonsense", "ellis"}) {
    Program("exit 3\n");
    EXPECT_TRUE(Ask("measure", {{"run", kRun}, {"pattern", pattern}}).contains("error"));
    EXPECT_TRUE(fs::exists(recordings_ / kRun / "result.json"));
    EXPECT_TRUE(fs::exists(recordings_ / kRun / "figures" / "answer.png"));
  }
  Program(kMeasures);
  EXPECT_THAT(Ask("measure", {{"run", kRun}, {"pattern", "a\nb"}}).at("error").at("message"),
              HasSubstr("one line"));
  // Results of jobs are no uploads.
  fs::create_directories(recordings_ / "photo-20260102T030405Z");
  EXPECT_TRUE(Ask("measure", {{"run", "photo-20260102T030405Z"}}).contains("error"));
  // A 3MF takes the place of the G-code.
  (void)Post("/gcodes?run=" + std::string(kRun), "application/octet-stream", "PK");
  EXPECT_FALSE(fs::exists(recordings_ / kRun / "photo.gcode"));
  // A second photo within the second, and one measured again.
  EXPECT_THAT(Post("/photos", "image/png", "other"), HasSubstr(std::string(kRun) + "-2"));
  Result(Measured::Refused("too dark: more light"));
  const json again = Ask("measure", {{"run", kRun}}).at("result");
  EXPECT_EQ(again["verdict"], "refused");
  EXPECT_EQ(again["words"], "too dark: more light");
  EXPECT_THAT(again["lines"], IsEmpty());
  const json refused = Ask("history", {{"last", 1}}).at("result").at("results")[0];
  EXPECT_EQ(refused.at("answers")[0].at("words"), "too dark: more light");
}

// As of a page whose link broke meanwhile.
TEST_F(PanelTest, APhotoThatIsAskedForTwiceIsAnsweredTwice) {
  (void)Post("/photos", "image/jpeg", "bytes");
  Program("sleep 0.3\n" + std::string(kMeasures));
  std::vector<std::unique_ptr<Socket>> pages;
  for (int i = 0; i < 2; ++i) {
    pages.push_back(Socket::Open(panel_->port()));
    pages.back()->Write(json{{"id", 1}, {"method", "measure"}, {"params", {{"run", kRun}}}}.dump());
  }
  for (const auto& page : pages) {
    EXPECT_EQ(json::parse(page->Read()).at("result").at("verdict"), "good");
  }
}

TEST_F(PanelTest, SaysWhyAPhotoIsNotMeasured) {
  EXPECT_THAT(Post("/photos", "application/octet-stream", "x"),
              AllOf(StartsWith("HTTP/1.1 400"), HasSubstr("JPEG")));
  EXPECT_THAT(Post("/photos", "image/jpeg", ""),
              AllOf(StartsWith("HTTP/1.1 400"), HasSubstr("empty")));
  EXPECT_THAT(Post("/gcodes?run=none", "application/octet-stream", "x"),
              StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(Ask("measure", {{"run", "none"}}).at("error").at("message"), HasSubstr("no run"));
  EXPECT_THAT(Ask("measure", {{"run", "../etc"}}).at("error").at("message"), HasSubstr("no run"));
  (void)Post("/photos", "image/jpeg", "bytes");
  Program("echo 'trammel: photo.jpg is no picture' >&2\nexit 1\n");
  EXPECT_EQ(Ask("measure", {{"run", kRun}}).at("error").at("message"), "photo.jpg is no picture");
  Program("kill -9 $$\n");
  EXPECT_THAT(Ask("measure", {{"run", kRun}}).at("error").at("message"), HasSubstr("signal 9"));
  EXPECT_THAT(Ask("use", {{"run", kRun}}).at("error").at("message"), HasSubstr("no good answer"));
  Program(kMeasures);
  EXPECT_TRUE(Ask("measure", {{"run", kRun}}).contains("result")) << "it was not used";
}

TEST_F(PanelTest, ShowsTheHistoryAsTableAndToMonitors) {
  EXPECT_THAT(Get("/history.csv"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("utc,instrument,")));
  EXPECT_THAT(Get("/metrics"), AllOf(StartsWith("HTTP/1.1 200"),
                                     HasSubstr("trammel_printer_ready{printer=\"voron:7125\"} 0\n"),
                                     Not(HasSubstr("pressure_advance"))));
  measurement::Outcome outcome;
  outcome.provenance = {measurement::Instrument::kPressureAdvance, "trammel", kUtc, {"scan"}};
  outcome.answers = {{"pressure_advance", "s", Measured::Good({0.0172, 0.0004, {0.0164, 0.018}})}};
  outcome.subject = {.printer = "voron", .nozzle = "0.40", .filament = "a \"b\\"};
  fs::create_directories(recordings_ / "measure-1");
  ASSERT_TRUE(files::KeepOutcome(recordings_ / "measure-1", outcome));
  EXPECT_THAT(Get("/history.csv"), HasSubstr("\"voron:7125\",\"0.40\",\"a \"\"b\\\","));
  EXPECT_THAT(
      Get("/metrics"),
      AllOf(HasSubstr("trammel_pressure_advance_seconds{printer=\"voron:7125\","
                      "filament=\"a \\\"b\\\\\",nozzle=\"0.40\",toolhead=\"\"} 0.0172\n"),
            HasSubstr("_high_seconds"), HasSubstr("timestamp_seconds{printer"),
            HasSubstr(" 1767323045\n"), HasSubstr("trammel_due{printer=\"voron:7125\"} 0")));
  for (const char* path : {"/history.csv?printer=1", "/history.csv?printer=-1",
                           "/history.csv?printer=x", "/metrics/"}) {
    EXPECT_THAT(Get(path), StartsWith("HTTP/1.1 404")) << path;
  }
  const json result = Ask("history", json::object()).at("result").at("results").at(0);
  EXPECT_EQ(result.at("run"), "measure-1");
  EXPECT_THAT(result.at("pictures"), IsEmpty());
  EXPECT_EQ(result.at("report"), nullptr);
}

// A video that is being written: its last picture may be there in part.
TEST_F(PanelTest, ShowsTheNewestWholeFrameOfARun) {
  const std::string path = "/runs/measure-1/now.jpg";
  EXPECT_THAT(Get(path), StartsWith("HTTP/1.1 404"));
  fs::create_directories(recordings_ / "measure-1");
  EXPECT_THAT(Get(path), StartsWith("HTTP/1.1 404"));
  const auto chunk = [](const std::string& picture, std::size_t there) {
    const std::string jpeg = "\xff\xd8\xff" + picture;
    const std::string size = {static_cast<char>(jpeg.size()), 0, 0, 0};
    return "00dc" + size + jpeg.substr(0, there);
  };
  const std::string whole = "RIFF" + chunk("first", 99) + chunk("second 00dc", 99);
  test::WriteWhole(recordings_ / "measure-1" / "line1.avi", whole);
  EXPECT_THAT(Get(path), AllOf(HasSubstr("image/jpeg"), HasSubstr("no-store"),
                               EndsWith("\xff\xd8\xffsecond 00dc")));
  for (std::size_t there = 0; there < 8; ++there) {
    test::WriteWhole(recordings_ / "measure-1" / "line1.avi", whole + chunk("third", there));
    EXPECT_THAT(Get(path), EndsWith("second 00dc")) << there;
  }
  test::WriteWhole(recordings_ / "measure-1" / "line1.avi", "00dc");
  EXPECT_THAT(Get(path), StartsWith("HTTP/1.1 404"));
}

// A stand-in of `trammel align survey` that adds a picture for each file it is given.
TEST_F(PanelTest, ASurveyGrowsPictureByPicture) {
  test::WriteWhole(folder_.path() / "survey.py", R"(
import json, os, sys
words = sys.argv[1:]
named = {w.split("=")[0]: w.split("=", 1)[1] for w in words if w.startswith("--") and "=" in w}
seen = json.load(open(named["--observations"]))["pictures"] if "--observations" in named else []
for word in words:
    if word.endswith(".jpg"):
        name = os.path.basename(word)
        if b"bad" in open(word, "rb").read():
            sys.exit(print("trammel: " + word + " is no picture", file=sys.stderr) or 1)
        seen.append({"name": name, "observations": [{"target": "7"}, {"target": str(len(seen))}]})
json.dump({"pictures": seen}, open(named["--keep-observations"], "w"))
bars = "--scale-bars" in named
if bars: open(named["--out"], "w").write("{}")
print(json.dumps({"verdict": "good" if bars else "cannot_tell", "reason": "" if bars else "no bar",
                  "stations": [{"picture": "photo-001.jpg", "used": False, "reason": "dark"}],
                  "precision": [{"id": "7", "standard_uncertainty_mm": [1, 2, 3]}] if bars else None,
                  "advice": ["more"]}, indent=1))
)");
  Program("exec python3 \"$here/survey.py\" \"$@\"\n");
  const std::string run = "survey-20260102T030405Z";
  EXPECT_TRUE(Ask("survey", {{"run", run}}).contains("error"));
  EXPECT_THAT(Post("/surveys", "image/heic", "x"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(Post("/surveys?run=../x", "image/jpeg", "x"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(Post("/surveys", "image/jpeg", "one"), HasSubstr(run));
  json answer = Ask("survey", {{"run", run}}).at("result");
  EXPECT_EQ(answer["verdict"], "cannot_tell");
  EXPECT_EQ(answer["reason"], "no bar");
  EXPECT_EQ(answer["pictures"][0],
            (json{{"picture", "photo-001.jpg"}, {"targets", 2}, {"reason", "dark"}}));
  EXPECT_THAT(answer["files"], IsEmpty());
  (void)Post("/surveys?run=" + run, "image/jpeg", "two");
  const json bars = {{{"from", "1"}, {"to", "2"}, {"length_mm", 1000.5}, {"sigma_mm", 0.02}}};
  answer = Ask("survey", {{"run", run}, {"bars", bars}}).at("result");
  EXPECT_EQ(answer["verdict"], "good");
  EXPECT_EQ(answer["bars"], bars);
  EXPECT_THAT(answer["files"], ElementsAre("surveyed.json"));
  EXPECT_EQ(answer["targets"].back(),
            (json{{"target", "7"}, {"pictures", 2}, {"standard_uncertainty_mm", {1, 2, 3}}}));
  EXPECT_THAT(Get("/runs/" + run + "/surveyed.json"), HasSubstr("application/json"));
  // One that cannot be read, and one that is taken out, leave the others.
  (void)Post("/surveys?run=" + run, "image/jpeg", "bad");
  EXPECT_THAT(Ask("survey", {{"run", run}}).at("error").at("message"), HasSubstr("no picture"));
  answer = Ask("survey", {{"run", run}, {"without", "photo-001.jpg"}}).at("result");
  ASSERT_EQ(answer["pictures"].size(), 1U);
  EXPECT_EQ(answer["pictures"][0]["picture"], "photo-002.jpg");
  (void)Post("/surveys?run=" + run, "image/jpeg", "three");
  EXPECT_EQ(Ask("survey", {{"run", run}}).at("result")["pictures"].size(), 2U);
  // Pictures that were removed to make room leave what they showed, and their names.
  for (const char* name : {"photo-002.jpg", "photo-003.jpg"}) fs::remove(recordings_ / run / name);
  EXPECT_EQ(Ask("survey", {{"run", run}}).at("result")["pictures"].size(), 2U);
  (void)Post("/surveys?run=" + run, "image/jpeg", "four");
  answer = Ask("survey", {{"run", run}, {"without", "photo-002.jpg"}}).at("result");
  ASSERT_EQ(answer["pictures"].size(), 2U);
  EXPECT_EQ(answer["pictures"][1]["picture"], "photo-004.jpg");
  for (const json& wrong :
       {json(7), json{{{"from", "1"}}},
        json{{{"from", "1"}, {"to", "2"}, {"length_mm", -1}, {"sigma_mm", 1}}}}) {
    EXPECT_THAT(Ask("survey", {{"run", run}, {"bars", wrong}}).at("error").at("message"),
                HasSubstr("'bars' must be"));
  }
  EXPECT_TRUE(Ask("survey", {{"run", run}, {"without", "bars.json"}}).contains("error"));
}

TEST_F(PanelTest, TakesScansOfASheetForAConnectedPrinterOnly) {
  EXPECT_THAT(Post("/sheets", "application/octet-stream", "x"), StartsWith("HTTP/1.1 415"));
  EXPECT_THAT(Post("/sheets?printer=7", "application/pdf", "x"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Post("/sheets", "application/pdf", "x"),
              AllOf(StartsWith("HTTP/1.1 409"), HasSubstr("not connected")));
}

TEST_F(PanelTest, AnswersTheServicesMethodsAndRefusesOtherMessages) {
  const json printer = Ask("printers", json::object()).at("result").at("printers").at(0);
  EXPECT_EQ(printer.at("name"), "voron");
  EXPECT_EQ(printer.at("subject"), "voron:7125");
  EXPECT_EQ(printer.at("nozzle"), nullptr);
  EXPECT_EQ(Ask("status", {{"printer", 0}}).at("result").at("printer").at("readiness"),
            "disconnected");
  EXPECT_THAT(Ask("status", {{"printer", 1}}).at("error").at("message"), HasSubstr("below 1"));
  EXPECT_THAT(Ask("status", {{"printer", -1}}).at("error").at("message"), HasSubstr("below 1"));
  EXPECT_EQ(Ask("status", {{"sesame", 1}}).at("error").at("code"), service::kInvalidParameters);
  EXPECT_THAT(Ask("emergency_stop", json::object()).at("error").at("message"),
              HasSubstr("not connected"));
  for (const char* text :
       {"", "{", "[]", "7", "{\"id\": {}, \"method\": \"status\"}", "{\"id\": 1}",
        "{\"id\": 1, \"method\": 7}", "{\"id\": 1, \"method\": \"status\", \"params\": []}"}) {
    EXPECT_TRUE(Say(text).contains("error")) << text;
  }
  EXPECT_TRUE(Say(std::string(1000, '[')).contains("error"));
}

}  // namespace
}  // namespace trammel::panel
