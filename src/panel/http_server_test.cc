#include "panel/http_server.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "panel/http_test_client.h"

namespace trammel::panel {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class Server : public ::testing::Test {
 protected:
  void Start(HttpLimits limits = {}) {
    HttpServerOptions options;
    options.limits = limits;
    auto server =
        HttpServer::Listen(options, {[this](const HttpRequest& request) { return Answer(request); },
                                     [this](std::string_view text) {
                                       while (text == "wait" && !go_on_) std::this_thread::yield();
                                       return "heard " + std::string(text);
                                     },
                                     [](std::string_view text) { return text == "stop"; }});
    ASSERT_TRUE(server) << server.error().message;
    server_ = std::move(*server);
    thread_ = std::jthread([this](const std::stop_token& stop) { server_->Run(stop); });
  }

  HttpAnswer Answer(const HttpRequest& request) {
    ++answered_;
    if (request.path == "/large") return {.body = std::string(8 << 20, 'x')};
    if (request.path == "/bug") throw std::runtime_error("a bug");
    std::string query;
    for (const auto& [name, value] : request.query) query += name + "=" + value + ";";
    return {.content_type = "text/plain",
            .body = fmt::format("{} {} {} {} bytes", request.method, request.path, query,
                                request.body.size())};
  }

  std::string Ask(const std::string& head, const std::string& body = {}) {
    return Connection(server_->port())
        .Send(head + "\r\nConnection: close\r\n\r\n" + body)
        .ReadAll();
  }

  std::unique_ptr<HttpServer> server_;
  std::atomic<int> answered_ = 0;
  std::atomic<bool> go_on_ = false;
  std::jthread thread_;
};

TEST_F(Server, AnswersRequestsOneBehindTheOther) {
  Start();
  Connection connection(server_->port());
  for (const char* path : {"/a", "/b?x=1%202&y"}) {
    connection.Send(fmt::format("GET {} HTTP/1.1\r\nHost: localhost\r\n\r\n", path));
    EXPECT_THAT(connection.ReadOne(),
                AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("nosniff"),
                      HasSubstr("frame-ancestors 'self' http://localhost:*"), HasSubstr("GET /")));
  }
  EXPECT_THAT(Ask("POST /p HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/jpeg\r\n"
                  "Content-Length: 3",
                  "abc"),
              HasSubstr("POST /p  3 bytes"));
  EXPECT_THAT(Ask("HEAD /a HTTP/1.1\r\nHost: localhost"), Not(HasSubstr("bytes")));
}

TEST_F(Server, RefusesWhatTheGuardRefusesBeforeItReadsIt) {
  Start();
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: evil.example"),
              AllOf(StartsWith("HTTP/1.1 421"), HasSubstr("--panel-name")));
  EXPECT_THAT(Ask("POST / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n"
                  "Content-Type: application/json\r\nContent-Length: 50000000"),
              StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Ask("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/plain\r\n"
                  "Content-Length: 2",
                  "{}"),
              StartsWith("HTTP/1.1 415"));
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: localhost\r\nX-Real-IP: 8.8.8.8"),
              AllOf(StartsWith("HTTP/1.1 403"), HasSubstr("own network")));
  EXPECT_THAT(Ask("PUT / HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/png"),
              StartsWith("HTTP/1.1 405"));
  for (const char* path : {"/../etc/passwd", "/a/%2e%2e/b", "/%00", "/%zz", "a"}) {
    EXPECT_THAT(Ask(fmt::format("GET {} HTTP/1.1\r\nHost: localhost", path)),
                StartsWith("HTTP/1.1 400"))
        << path;
  }
  EXPECT_EQ(answered_, 0);
}

TEST_F(Server, BoundsWhatAClientSends) {
  Start({.header_bytes = 1000, .body_bytes = 2 << 20, .header_s = 0.2});
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(2000, 'x')),
              Not(HasSubstr("200 OK")));
  EXPECT_THAT(Ask("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/png\r\n"
                  "Content-Length: 1000000000"),
              AllOf(StartsWith("HTTP/1.1 413"), HasSubstr("too large")));
  std::string chunks;
  for (int i = 0; i < 40; ++i) chunks += "10000\r\n" + std::string(0x10000, 'y') + "\r\n";
  EXPECT_THAT(Ask("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/png\r\n"
                  "Transfer-Encoding: chunked",
                  chunks + "0\r\n\r\n"),
              StartsWith("HTTP/1.1 413"));
  EXPECT_EQ(answered_, 0);
  // A head that never ends, and one that never comes.
  EXPECT_EQ(Connection(server_->port()).Send("GET / HT").ReadAll(), "");
  EXPECT_EQ(Connection(server_->port()).ReadAll(), "");
}

TEST_F(Server, ManySlowClientsDoNotKeepOthersOutForLong) {
  Start({.header_s = 0.3, .connections = 50});
  std::vector<std::unique_ptr<Connection>> slow;
  for (int i = 0; i < 500; ++i) {
    slow.push_back(std::make_unique<Connection>(server_->port()));
    slow.back()->Send("GET /");
  }
  std::string answer;
  for (int i = 0; i < 1000 && answer.empty(); ++i) {
    answer = Ask("GET / HTTP/1.1\r\nHost: localhost");
    if (answer.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
}

TEST_F(Server, APhoneThatIsGoneHoldsAnUploadForSomeSecondsOnly) {
  Start({.piece_s = 0.3, .bodies = 1});
  Connection gone(server_->port());
  gone.Send(
      "POST / HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/png\r\n"
      "Content-Length: 2000000\r\n\r\nabc");
  const std::string body(1'500'000, 'x');
  std::string answer;
  for (int i = 0; i < 500 && !answer.starts_with("HTTP/1.1 200"); ++i) {
    answer =
        Ask("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/png\r\n"
            "Content-Length: 1500000",
            body);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_THAT(answer, HasSubstr("1500000 bytes"));
  EXPECT_EQ(gone.ReadAll(), "");
}

TEST_F(Server, BoundsTheBytesOfAnswersThatNobodyReads) {
  Start({.piece_s = 1, .answer_bytes = 40 << 20});
  std::vector<std::unique_ptr<Connection>> lazy;
  std::string answer = "HTTP/1.1 200";
  for (int i = 0; i < 20; ++i) {
    lazy.push_back(std::make_unique<Connection>(server_->port()));
    lazy.back()->Send("GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  for (int i = 0; i < 200 && !answer.starts_with("HTTP/1.1 503"); ++i) {
    answer = Ask("GET /large HTTP/1.1\r\nHost: localhost");
  }
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 503"));
  for (int i = 0; i < 500 && !answer.starts_with("HTTP/1.1 200"); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    answer = Ask("GET /large HTTP/1.1\r\nHost: localhost");
  }
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200")) << "they were ended";
}

TEST_F(Server, AStopDoesNotWaitBehindOthers) {
  Start();
  std::vector<std::unique_ptr<Socket>> slow;
  for (int i = 0; i < 8; ++i) {
    slow.push_back(Socket::Open(server_->port()));
    slow.back()->Write("wait");
  }
  const auto hand = Socket::Open(server_->port());
  hand->Write("stop");
  EXPECT_EQ(hand->Read(), "heard stop");
  EXPECT_FALSE(go_on_.exchange(true)) << "the others wait still";
}

TEST_F(Server, AnswersAWebSocketWhileItWorksOnAnEarlierMessage) {
  Start();
  const auto page = Socket::Open(server_->port());
  page->Write("wait");
  page->Write("status");
  EXPECT_EQ(page->Read(), "heard status");
  go_on_ = true;
  EXPECT_EQ(page->Read(), "heard wait");
}

TEST_F(Server, ABugInAnAnswerEndsNeitherServerNorConnection) {
  Start();
  EXPECT_THAT(Ask("GET /bug HTTP/1.1\r\nHost: localhost"), StartsWith("HTTP/1.1 500"));
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: localhost"), StartsWith("HTTP/1.1 200"));
}

TEST_F(Server, TalksToWebSocketsAndTellsThemAll) {
  Start({.message_bytes = 1000});
  EXPECT_EQ(Socket::Open(server_->port(), "http://evil.example"), nullptr);
  const auto one = Socket::Open(server_->port(), "http://localhost");
  const auto two = Socket::Open(server_->port());
  ASSERT_TRUE(one && two);
  one->Write("hello");
  EXPECT_EQ(one->Read(), "heard hello");
  two->Write("you");
  EXPECT_EQ(two->Read(), "heard you");
  server_->Broadcast("all");
  EXPECT_EQ(one->Read(), "all");
  EXPECT_EQ(two->Read(), "all");
  one->Write(std::string(5000, 'x'));
  EXPECT_EQ(one->Read(), "") << "a message too long";
  server_->Broadcast("still here");
  EXPECT_EQ(two->Read(), "still here");
}

TEST_F(Server, NamesAPortThatIsTaken) {
  Start();
  const auto second = HttpServer::Listen({.port = server_->port()}, {});
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("another port"));
  EXPECT_FALSE(HttpServer::Listen({.address = "printer"}, {}));
}

}  // namespace
}  // namespace trammel::panel
