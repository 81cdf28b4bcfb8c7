#include "sim/moonraker/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "sim/camera/camera_http.h"
#include "sim/moonraker/http_api.h"
#include "sim/moonraker/test_client.h"

namespace trammel::sim {
namespace {

using ::testing::StartsWith;

// Fast enough for a test of seconds, slow enough for a loaded machine.
constexpr double kSpeed = 30;

struct Bench {
  explicit Bench(ServerOptions options = {}, MachineOptions machine_options = {})
      : machine(Faster(std::move(machine_options)), MonotonicNow()) {
    auto started = PrinterServer::Start(machine, std::move(options));
    if (!started) throw std::runtime_error(started.error().message);
    server = std::move(*started);
  }
  static MachineOptions Faster(MachineOptions options) {
    options.speed = kSpeed;
    return options;
  }
  [[nodiscard]] std::uint16_t port() const { return server->port(); }

  MachineHost machine;
  std::unique_ptr<PrinterServer> server;
};

Json Script(const std::string& text) { return {{"script", text}}; }

Json Agent(const std::string& name = "test") {
  return {{"client_name", name}, {"version", "1"}, {"type", "agent"}, {"url", "http://localhost"}};
}

// A conversation's requests, in order, each with the answer and the responses that came before it.
struct Exchange {
  Json request;
  Json answer;
  std::vector<std::string> responses;
};

std::vector<Exchange> ReadConversation(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<Exchange> exchanges;
  std::vector<std::string> responses;
  std::string line;
  while (std::getline(file, line)) {
    const Json entry = Json::parse(line);
    const Json& message = entry["msg"];
    if (entry["dir"] == "out") {
      exchanges.push_back({message, nullptr, {}});
    } else if (message.contains("id")) {
      for (Exchange& exchange : exchanges) {
        if (exchange.request["id"] != message["id"]) continue;
        exchange.answer = message;
        exchange.responses = responses;
      }
      responses.clear();
    } else if (message["method"] == "notify_gcode_response") {
      responses.push_back(message["params"][0]);
    }
  }
  return exchanges;
}

// A text with its numbers blanked out.
std::string WithoutNumbers(const std::string& text) {
  std::string plain;
  for (const char c : text) {
    if (c >= '0' && c <= '9') {
      if (plain.empty() || plain.back() != '#') plain += '#';
    } else if (c != '.' && c != '-') {
      plain += c;
    }
  }
  return plain;
}

// Everything that the real answer has must be there with the same type; values may differ.
void ExpectShape(const Json& real, const Json& ours, const std::string& where) {
  if (real.is_number() && ours.is_number()) return;
  ASSERT_EQ(real.type_name(), std::string(ours.type_name())) << where;
  if (!real.is_object()) return;
  for (const auto& [key, value] : real.items()) {
    // A printer's hardware and its config are its own.
    if (key == "settings" || key == "config") continue;
    ASSERT_TRUE(ours.contains(key)) << where << " lacks " << key;
    ExpectShape(value, ours[key], where + "." + key);
  }
}

bool IsTemperature(const std::string& response) { return response.rfind("B:", 0) == 0; }

std::vector<std::string> Comparable(const std::vector<std::string>& responses) {
  std::vector<std::string> kept;
  for (const std::string& response : responses) {
    // Alarms of the host's state come at moments that a fast clock moves about.
    if (!IsTemperature(response) && response.rfind("// Klipper state", 0) != 0) {
      kept.push_back(WithoutNumbers(response));
    }
  }
  return kept;
}

void Replay(const std::filesystem::path& path, Bench& bench) {
  TestClient client(bench.port());
  for (const Exchange& exchange : ReadConversation(path)) {
    const Json& request = exchange.request;
    const std::string where = path.filename().string() + " " + request.dump().substr(0, 160);
    client.SendText(request.dump());
    // A script that was under way when the next request was sent is answered later.
    const Json parameters = request.value("params", Json::object());
    const bool overtaken = parameters.is_object() &&
                           parameters.value("script", "").find("G4 P20000") != std::string::npos;
    if (overtaken) continue;
    client.passed.clear();
    const Json ours = client.AnswerTo(request["id"]);
    ASSERT_EQ(exchange.answer.contains("error"), ours.contains("error")) << where << ours;
    if (ours.contains("error")) {
      EXPECT_EQ(exchange.answer["error"]["code"], ours["error"]["code"]) << where;
      EXPECT_EQ(WithoutNumbers(exchange.answer["error"]["message"]),
                WithoutNumbers(ours["error"]["message"]))
          << where;
    } else {
      ExpectShape(exchange.answer["result"], ours["result"], where);
    }
    std::vector<std::string> responses;
    for (const Json& message : client.passed) {
      if (message.value("method", "") == "notify_gcode_response") {
        responses.push_back(message["params"][0]);
      }
    }
    EXPECT_EQ(Comparable(exchange.responses), Comparable(responses)) << where;
    if (request["method"] == "printer.firmware_restart") {
      (void)client.WaitFor("notify_klippy_disconnected");
      (void)client.WaitFor("notify_klippy_ready");
    }
  }
}

TEST(PrinterServer, AnswersTheRecordedRequestsInTheFormOfARealServer) {
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  if (data == nullptr) GTEST_SKIP() << "TRAMMEL_TEST_DATA names no folder with recordings";
  const std::filesystem::path folder = std::filesystem::path(data) / "moonraker";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  MachineOptions recorded;  // the printer of the recordings calls its laser's macro so
  recorded.klipper.macros["LASER_ON"] = recorded.klipper.macros.at("_LASER_ON");
  Bench bench({}, std::move(recorded));
  for (const char* name : {"01_connect", "02_home_heat_move", "03_errors", "05_agent_macro",
                           "06_emergency_stop_and_restart"}) {
    Replay(folder / (std::string(name) + ".jsonl"), bench);
    if (HasFatalFailure()) return;
  }
}

TEST(PrinterServer, TellsChangesOnlyAndNotifiesBeforeItAnswers) {
  Bench bench;
  TestClient client(bench.port());
  const Json first = client.Call(
      "printer.objects.subscribe",
      {{"objects", {{"toolhead", {"homed_axes", "max_accel"}}, {"gcode_move", {"speed_factor"}}}}});
  EXPECT_EQ(first["result"]["status"]["toolhead"]["homed_axes"], "");
  const int failing = client.Send("printer.gcode.script", Script("G1 X10"));
  ASSERT_TRUE(client.AnswerTo(failing).contains("error"));
  ASSERT_FALSE(client.passed.empty());
  EXPECT_THAT(client.passed.back()["params"][0].get<std::string>(), StartsWith("!! Must home"));
  (void)client.Call("printer.gcode.script", Script("SET_VELOCITY_LIMIT ACCEL=1234"));
  const Json update = client.WaitFor("notify_status_update");
  EXPECT_EQ(update["params"][0], (Json{{"toolhead", {{"max_accel", 1234.0}}}}));
  EXPECT_TRUE(update["params"][1].is_number());
}

TEST(PrinterServer, CallsInFlightFailWithTheDisconnect) {
  Bench bench;
  TestClient client(bench.port());
  const int waiting = client.Send("printer.gcode.script", Script("TEMPERATURE_WAIT SENSOR=extruder "
                                                                 "MINIMUM=200"));
  TestClient other(bench.port());
  (void)other.Call("printer.restart");
  const Json answer = client.AnswerTo(waiting);
  EXPECT_EQ(answer["error"]["code"], 503);
  EXPECT_EQ(answer["error"]["message"], "Klippy Disconnected");
}

TEST(PrinterServer, LetsNobodyCallWithoutTheKey) {
  ServerOptions options;
  options.hub.api_key = "secret";
  Bench bench(options);
  TestClient stranger(bench.port());
  const Json refused = stranger.Call("server.info");
  EXPECT_EQ(refused["error"]["code"], -32602);
  EXPECT_EQ(refused["error"]["message"], "Unauthorized");
  Json identity = Agent();
  identity["api_key"] = "wrong";
  EXPECT_EQ(stranger.Call("server.connection.identify", identity)["error"]["code"], -32602);
  identity["api_key"] = "secret";
  EXPECT_TRUE(stranger.Call("server.connection.identify", identity).contains("result"));
  EXPECT_TRUE(stranger.Call("server.info").contains("result"));
  EXPECT_EQ(stranger.Call("server.connection.identify", identity)["error"]["code"], 400);
  TestClient keyed(bench.port(), "/websocket", "secret");
  EXPECT_TRUE(keyed.Call("server.info").contains("result"));
  EXPECT_EQ(TestHttp(bench.port(), "GET", "/server/info").status, 401);
  const TestResponse token =
      TestHttp(bench.port(), "GET", "/access/oneshot_token", {}, {{"X-Api-Key", "secret"}});
  ASSERT_EQ(token.status, 200);
  const std::string target =
      "/websocket?token=" + Json::parse(token.body)["result"].get<std::string>();
  EXPECT_TRUE(TestClient(bench.port(), target).Call("server.info").contains("result"));
  EXPECT_TRUE(TestClient(bench.port(), target).Call("server.info").contains("error"))
      << "a token is good once";
}

std::string Form(const std::string& text, const std::string& sum, const std::string& print) {
  std::string body;
  const auto field = [&body](const std::string& head, const std::string& value) {
    body += "--XX\r\nContent-Disposition: form-data; " + head + "\r\n\r\n" + value + "\r\n";
  };
  field("name=\"root\"", "gcodes");
  field("name=\"checksum\"", sum);
  field("name=\"print\"", print);
  field("name=\"file\"; filename=\"a b.gcode\"", text);
  return body + "--XX--\r\n";
}

TEST(PrinterServer, TakesUploadsChecksThemAndPrintsThem) {
  Bench bench;
  const std::vector<std::pair<std::string, std::string>> type = {
      {"Content-Type", "multipart/form-data; boundary=XX"}};
  const std::string text = "G28\r\nG1 X50 F6000\nG4 P1000000\n";
  const auto upload = [&](const std::string& body) {
    return TestHttp(bench.port(), "POST", "/server/files/upload", body, type);
  };
  const TestResponse wrong = upload(Form(text, std::string(64, 'a'), "false"));
  EXPECT_EQ(wrong.status, 422);
  const TestResponse good = upload(Form(text, Sha256(text), "false"));
  ASSERT_EQ(good.status, 201) << good.body;
  EXPECT_EQ(Json::parse(good.body)["item"]["path"], "a b.gcode");
  EXPECT_EQ(TestHttp(bench.port(), "GET", "/server/files/gcodes/a%20b.gcode").body, text);
  EXPECT_EQ(upload("--XX\r\nnonsense").status, 400);
  TestClient client(bench.port());
  EXPECT_EQ(client.Call("printer.print.start", {{"filename", "a b.gcode"}})["result"], "ok");
  const Json status =
      client.Call("printer.objects.query", {{"objects", {{"print_stats", {"state"}}}}});
  EXPECT_EQ(status["result"]["status"]["print_stats"]["state"], "printing");
  const TestResponse query =
      TestHttp(bench.port(), "GET", "/printer/objects/query?print_stats=filename&webhooks");
  EXPECT_EQ(Json::parse(query.body)["result"]["status"]["print_stats"]["filename"], "a b.gcode");
  EXPECT_EQ(TestHttp(bench.port(), "GET", "/no/such/path").status, 404);
  const TestResponse script =
      TestHttp(bench.port(), "POST", "/printer/gcode/script?script=M118%20x");
  EXPECT_EQ(Json::parse(script.body)["result"], "ok");
}

TEST(PrinterServer, AnswersNoPageOfSomewhereElse) {
  Bench bench;
  const auto status = [&](const std::vector<std::pair<std::string, std::string>>& headers,
                          const std::string& target) {
    return TestHttp(bench.port(), "GET", target, {}, headers).status;
  };
  for (const char* target : {"/server/info", "/websocket"}) {
    // A name of somebody else's that was made to point here, and a page that asks across sites.
    EXPECT_EQ(status({{"Host", "evil.example"}}, target), 403) << target;
    EXPECT_EQ(status({{"Origin", "http://evil.example"}}, target), 403) << target;
  }
  EXPECT_EQ(status({{"Origin", "http://evil.example"},
                    {"Upgrade", "websocket"},
                    {"Connection", "Upgrade"},
                    {"Sec-WebSocket-Version", "13"},
                    {"Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ=="}},
                   "/websocket"),
            403);
  EXPECT_EQ(status({{"Host", "localhost"}, {"Origin", "http://localhost:8080"}}, "/server/info"),
            200);
}

TEST(PrinterServer, SurvivesWhateverIsSent) {
  Bench bench;
  TestClient client(bench.port());
  for (const std::string& text :
       {std::string("{"), std::string("[]"), std::string("null"), std::string(100000, '['),
        std::string(R"({"jsonrpc":"2.0","method":7,"id":1})"),
        std::string(R"({"jsonrpc":"2.0","method":"x","params":[],"id":1})"),
        std::string(R"({"jsonrpc":"2.0","method":"x","id":[[1]]})"),
        R"({"jsonrpc":"2.0","method":"printer.objects.query","id":1,"params":{"objects":)" +
            std::string(50000, '[') + std::string(50000, ']') + "}}"}) {
    client.SendText(text);
    const auto answer = client.Next();
    ASSERT_TRUE(answer) << text.substr(0, 40);
    EXPECT_TRUE(answer->contains("error")) << text.substr(0, 40);
  }
  for (const Json& objects : {Json(1), Json("x"), Json{{"toolhead", 1}}, Json{{"toolhead", {1}}}}) {
    EXPECT_EQ(client.Call("printer.objects.query", {{"objects", objects}})["error"]["code"], 400);
  }
  EXPECT_EQ(client.Call("printer.gcode.script", {{"script", 5}})["error"]["code"], 400);
  EXPECT_EQ(
      client.Call("printer.gcode.script", Script("G1 X1e999 Y\nSET_PIN PIN=\"a"))["error"]["code"],
      400);
  EXPECT_TRUE(client.Call("server.info").contains("result"));
  TestClient garbled(bench.port());
  garbled.SendText("\xff\xfe");
  EXPECT_FALSE(garbled.Next()) << "a text frame that is no UTF-8 costs the connection";
  EXPECT_TRUE(client.Call("server.info").contains("result")) << "but only that one";
}

TEST(PrinterServer, ItsFaultsAreWhatTheySay) {
  ServerOptions closing;
  closing.hub.faults.close_at_laser_move = 1;
  closing.hub.faults.refuse_for_s = 90;
  Bench bench(closing);
  TestClient client(bench.port());
  (void)client.Call("printer.gcode.script", Script("G28\n_LASER_ON\nM400"));
  client.Send("printer.gcode.script", Script("G1 X50 F400\nM400"));
  while (client.Next()) {
  }
  EXPECT_ANY_THROW((void)TestClient(bench.port()).Call("server.info"))
      << "90 s of the machine's time";
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (true) {
    try {
      EXPECT_TRUE(TestClient(bench.port()).Call("server.info").contains("result"));
      break;
    } catch (const std::exception& error) {
      ASSERT_LT(std::chrono::steady_clock::now(), limit) << "still closed: " << error.what();
    }
  }
  MachineOptions busy;
  busy.faults.printing_at_start = true;
  Bench other({}, busy);
  TestClient watcher(other.port());
  const Json status =
      watcher.Call("printer.objects.query", {{"objects", {{"print_stats", {"state"}}}}});
  EXPECT_EQ(status["result"]["status"]["print_stats"]["state"], "printing");
  MachineOptions broken;
  broken.faults.error_at_start = true;
  Bench third({}, broken);
  EXPECT_EQ(TestClient(third.port()).Call("printer.info")["result"]["state"], "error");
}

}  // namespace
}  // namespace trammel::sim
