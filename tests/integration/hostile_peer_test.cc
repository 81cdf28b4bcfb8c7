// Servers that are no friends: each answers, or fails to answer, in a way of its own, and every
// command that talks to a printer has to end by itself or when asked to, in words, with little
// memory, and without a control character of the server's on the terminal.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "support/sanitized.h"
#include "support/scripted_moonraker.h"
#include "support/temporary_folder.h"
#include "support/trammel_process.h"

namespace trammel::test {
namespace {

using Json = nlohmann::json;

constexpr double kEnd_s = 100;  // until a command has given up by itself; they wait 60 at most
// Resident; an analysis of frames needs half of it.
constexpr double kMax_mb = 400 * kSanitizerMemory;
constexpr int kLevels = 1'000'000;  // JSON nesting: 2 MB with closing brackets
constexpr int kSoftwareBug = 70;    // CONVENTIONS.md: the exit code of a bug

struct Mode {
  std::string name;
  ServerOptions options = {};
  /// Above what a small printer in good order answers.
  std::function<void(ScriptedMoonraker&)> misbehave = {};
};

std::string Nested(const std::string& open, const std::string& close, int levels) {
  std::string text;
  for (int i = 0; i < levels; ++i) text += open;
  for (int i = 0; i < levels; ++i) text += close;
  return text;
}

// Everything that asks for the printer's state gets this patch over it.
std::function<void(ScriptedMoonraker&)> WithStatus(Json patch) {
  return [patch = std::move(patch)](ScriptedMoonraker& server) {
    Json status = SmallPrinterStatus();
    status.merge_patch(patch);
    for (const char* method : {"printer.objects.subscribe", "printer.objects.query"}) {
      server.Answer(method, {{"eventtime", 3045.4}, {"status", status}});
    }
  };
}

// Made by the test that sends them: every test is a process, which would fill 60 MB first.
using MakeBytes = std::function<std::string()>;

// The bytes come instead of an answer to `method`.
std::function<void(ScriptedMoonraker&)> BytesAt(const std::string& method, MakeBytes make) {
  return [method, make = std::move(make)](ScriptedMoonraker& server) {
    server.Handle(method, [&server, bytes = make()](const Json&) {
      server.PushBytes(bytes);
      return std::vector<Json>{};
    });
  };
}

// The bytes come as a notification would, before the answer to the first look at the state.
std::function<void(ScriptedMoonraker&)> BytesBefore(MakeBytes make, int times = 1) {
  return [make = std::move(make), times](ScriptedMoonraker& server) {
    const std::string bytes = make();
    for (const char* method : {"printer.objects.subscribe", "printer.objects.query"}) {
      server.Handle(method, [&server, bytes, times](const Json& request) {
        for (int i = 0; i < times; ++i) server.PushBytes(bytes);
        return std::vector{
            ResultFor(request, {{"eventtime", 3045.4}, {"status", SmallPrinterStatus()}})};
      });
    }
  };
}

std::function<void(ScriptedMoonraker&)> BytesBefore(const char* bytes) {
  return BytesBefore([bytes] { return std::string(bytes); });
}

Json ManyHeaters(int count) {
  Json objects = Json::object();
  for (int i = 0; i < count; ++i) {
    objects[fmt::format("heater_generic h{}", i)] = {{"temperature", 20}, {"target", 0}};
  }
  return objects;
}

std::vector<Mode> BeforeAnyWord() {
  ServerOptions silent, banner, teapot;
  silent.silent = true;
  banner.banner = std::string("SSH-2.0-OpenSSH_9.2\x1b[2J\r\n");
  teapot.upgrade_status = 500;
  return {{"Silent", silent}, {"AnotherProtocol", banner}, {"RefusesTheUpgrade", teapot}};
}

std::vector<Mode> Texts() {
  const MakeBytes nested_arrays = [] { return Nested("[", "]", kLevels); };
  const MakeBytes nested_objects = [] { return Nested("{\"\":", "}", kLevels); };
  std::vector<Mode> modes;
  modes.push_back({"NestedAnswer", {}, BytesAt("server.info", nested_arrays)});
  modes.push_back({"NestedMessage", {}, BytesBefore(nested_arrays)});
  modes.push_back({"NestedNotification", {}, BytesBefore([nested_arrays] {
                     return R"({"method":"notify_status_update","params":)" + nested_arrays() + "}";
                   })});
  modes.push_back({"NestedObjects", {}, BytesBefore(nested_objects)});
  modes.push_back({"NestedAndCut", {}, BytesBefore([nested_arrays] {
                     return nested_arrays().substr(0, kLevels);
                   })});
  modes.push_back({"NoJson", {}, BytesBefore("\x80\xff{\"a\"")});
  modes.push_back({"Empty", {}, BytesBefore("")});
  modes.push_back({"BareNumber", {}, BytesBefore("1e999")});
  modes.push_back(
      {"LongText", {}, BytesBefore([] { return "\"" + std::string(30'000'000, 'x') + "\""; })});
  modes.push_back(
      {"Storm",
       {},
       BytesBefore([] { return GcodeResponse("// " + std::string(500, 's')).dump(); }, 20'000)});
  modes.push_back({"AnswersNobodyAskedFor", {}, BytesBefore(R"({"id":987654321,"result":"ok"})")});
  modes.push_back({"IdsOfEveryKind",
                   {},
                   BytesBefore(R"({"id":{"a":[]},"result":1})"
                               "\n")});
  modes.push_back({"RequestsOfTheirOwn",
                   {},
                   BytesBefore(R"({"jsonrpc":"2.0","method":"trammel.status","id":5})")});
  modes.push_back({"ParametersOfTheWrongKind",
                   {},
                   BytesBefore(R"({"jsonrpc":"2.0","method":"notify_status_update","params":7})")});
  modes.push_back({"ControlCharacters", {}, [](ScriptedMoonraker& server) {
                     server.AnswerError("printer.gcode.script", 400,
                                        "\x1b[2J\x1b]0;owned\x07 no \xc2\x9b"
                                        "31m move\r\nfake line");
                     WithStatus({{"print_stats", {{"filename", "\x1b[31mvase.gcode"}}}})(server);
                   }});
  modes.push_back({"ClosesInTheMiddle", {}, [](ScriptedMoonraker& server) {
                     server.Handle("printer.objects.query", [&server](const Json&) {
                       server.BreakConnections();
                       return std::vector<Json>{};
                     });
                   }});
  return modes;
}

std::vector<Mode> States() {
  std::vector<Mode> modes;
  const Json huge_position = Json::array({1e308, -1e308, 1e300, 0});
  modes.push_back({"HugePositions",
                   {},
                   WithStatus({{"toolhead",
                                {{"position", huge_position},
                                 {"axis_minimum", {-1e308, -1e308, -1e308, 0}},
                                 {"axis_maximum", {1e308, 1e308, 1e308, 0}}}},
                               {"motion_report", {{"live_position", huge_position}}}})});
  modes.push_back({"HugeSettings",
                   {},
                   WithStatus({{"toolhead", {{"max_velocity", 1e308}, {"max_accel", 1e308}}},
                               {"extruder", {{"pressure_advance", 1e308}, {"target", 1e308}}}})});
  modes.push_back({"NegativeSettings",
                   {},
                   WithStatus({{"toolhead", {{"max_velocity", -5}, {"max_accel", -1}}},
                               {"extruder", {{"pressure_advance", -3}, {"target", -273.2}}}})});
  modes.push_back({"WrongKinds",
                   {},
                   WithStatus({{"toolhead", {{"position", "here"}, {"homed_axes", 7}}},
                               {"extruder", Json::array({1, 2})},
                               {"gcode_move", "no"},
                               {"print_stats", {{"state", Json::object()}}}})});
  modes.push_back({"LongNames", {}, [](ScriptedMoonraker& server) {
                     const std::string name(5'000'000, 'n');
                     WithStatus({{"print_stats", {{"state", "printing"}, {"filename", name}}},
                                 {"webhooks", {{"state_message", name}}}})(server);
                   }});
  modes.push_back({"ManyHeaters", {}, [](ScriptedMoonraker& server) {
                     WithStatus(ManyHeaters(100'000))(server);
                   }});
  modes.push_back(
      {"ManyTools", {}, [](ScriptedMoonraker& server) {
         Json numbers = Json::array();
         Json names = Json::array();
         for (int i = 0; i < 100'000; ++i) {
           numbers.push_back(i % 3 == 0 ? Json(-1) : i % 3 == 1 ? Json(1) : Json(1e300));
           names.push_back("tool T1");
         }
         WithStatus({{"toolchanger", {{"tool_numbers", numbers}, {"tool_names", names}}},
                     {"tool T1",
                      {{"extruder", std::string(1'000'000, 'x')},
                       {"gcode_x_offset", 0.1},
                       {"gcode_y_offset", 0.1}}}})(server);
       }});
  modes.push_back(
      {"NoState", {}, [](ScriptedMoonraker& server) {
         for (const char* method : {"printer.objects.subscribe", "printer.objects.query"}) {
           server.Answer(method, nullptr);
         }
       }});
  modes.push_back({"NeverAnswersAScript", {}, [](ScriptedMoonraker& server) {
                     server.Handle("printer.gcode.script",
                                   [](const Json&) { return std::vector<Json>{}; });
                   }});
  return modes;
}

struct Command {
  std::string name;
  std::vector<std::string> words;
  bool serves = false;  ///< goes on until it is asked to end
};

std::vector<Command> Commands() {
  return {{"Doctor", {"doctor"}},
          {"Calibrate", {"pa", "calibrate", "--out", "rec"}},
          {"Setup", {"pa", "setup", "--material", "pla", "--clear-z", "11,25", "--out", "set"}},
          {"Apply", {"pa", "apply", "0.03"}},
          {"Start", {"offset", "start", "--yes", "move,paper", "--out", "sheet"}},
          {"Serve", {"serve"}, true},
          {"Watch", {"tap", "watch", "--answer"}, true}};
}

struct HostileCase {
  Mode mode;
  Command command;
};

std::vector<HostileCase> AllCases() {
  std::vector<HostileCase> cases;
  for (const auto& modes : {BeforeAnyWord(), Texts(), States()}) {
    for (const Mode& mode : modes) {
      for (const Command& command : Commands()) cases.push_back({mode, command});
    }
  }
  return cases;
}

void PrintTo(const HostileCase& one, std::ostream* stream) {
  *stream << one.command.name << one.mode.name;
}

class HostilePeer : public testing::TestWithParam<HostileCase> {};

// Long enough for a service to have met the mode: it has spoken with the server, or said its
// trouble.
void LetItMeet(ScriptedMoonraker& server, TrammelProcess& process) {
  static_cast<void>(server.WaitForConnections(1));
  for (int i = 0; i < 100 && process.Running(); ++i) {
    if (server.CountRequests("printer.objects.subscribe") > 0) break;
    if (!process.StandardErrorSoFar().empty()) break;
    usleep(20'000);
  }
  for (int i = 0; i < 20 && process.Running(); ++i) usleep(20'000);
}

TEST_P(HostilePeer, IsSurvived) {
  const Mode& mode = GetParam().mode;
  const Command& command = GetParam().command;
  ScriptedMoonraker server(mode.options);
  AnswerLikeMoonraker(server);
  if (mode.misbehave) mode.misbehave(server);
  const TemporaryFolder folder;
  WriteWhole(folder.path() / "trammel.toml",
             "[filament]\nnozzle_temperature = 210\nbed_temperature = 60\n");
  std::vector<std::string> words = command.words;
  words.insert(words.end(), {"--printer", fmt::format("127.0.0.1:{}", server.port())});
  TrammelProcess process(words, folder.path());
  if (command.serves) {
    LetItMeet(server, process);
    process.Send(SIGTERM);
  }
  const ProcessEnd end = process.Wait(kEnd_s);
  EXPECT_FALSE(end.timed_out) << end.standard_error;
  EXPECT_EQ(end.signal, 0) << end.standard_error;
  EXPECT_NE(end.exit_code, kSoftwareBug) << end.standard_error;
  EXPECT_LT(end.peak_memory_mb, kMax_mb);
  const std::string said = end.standard_output + end.standard_error;
  EXPECT_EQ(said.find('\x1b'), std::string::npos) << said;
  EXPECT_EQ(said.find('\x07'), std::string::npos) << said;
  EXPECT_LT(said.size(), 200'000U) << "a server's long words are repeated whole";
  EXPECT_FALSE(said.empty());
}

INSTANTIATE_TEST_SUITE_P(Each, HostilePeer, testing::ValuesIn(AllCases()),
                         [](const testing::TestParamInfo<HostileCase>& one) {
                           return one.param.command.name + one.param.mode.name;
                         });

}  // namespace
}  // namespace trammel::test
