// Getting to a Moonraker, and every way not to, over real sockets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "machine/moonraker/moonraker_test_support.h"
#include "support/matchers.h"
#include "support/temporary_folder.h"
#include "support/test_tls.h"

namespace trammel::machine {
namespace {

using nlohmann::json;
using test::AnswerLikeMoonraker;
using test::ScriptedMoonraker;
using test::ServerOptions;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

/// The error of a connection that must not come about.
Error Refused(const MoonrakerOptions& options, const WaitLimit& limit = kPatience) {
  const auto printer = ConnectToMoonraker(options, limit);
  EXPECT_FALSE(printer.has_value());
  return printer ? Error{} : printer.error();
}

TEST(MoonrakerConnect, RefusedPortSaysThatNothingListens) {
  int port = 0;
  {
    const ScriptedMoonraker gone;
    port = gone.port();
  }
  const Error error = Refused({.address = "127.0.0.1:" + std::to_string(port)});
  EXPECT_EQ(error.kind, ErrorKind::kMachine);
  EXPECT_THAT(error.message, Containing("refuses connections", "7125"));
}

TEST(MoonrakerConnect, AddressesAndKeysThatMakeNoSenseAreInputErrors) {
  for (const char* address : {"", "ftp://printer", "printer:0", "printer:70000", "unix:relative",
                              "a printer", "ws://h/websocket?token=x"}) {
    const Error error = Refused({.address = address});
    EXPECT_EQ(error.kind, ErrorKind::kInput) << address;
    EXPECT_THAT(error.message, HasSubstr("write it like")) << address;
  }
  EXPECT_THAT(Refused({.address = "printer", .api_key = "two\r\nlines"}).message,
              HasSubstr("API key"));
}

TEST(MoonrakerConnect, AnHttpAnswerInPlaceOfAWebSocketIsExplained) {
  const std::pair<int, std::vector<std::string>> cases[] = {
      {404, {"not a Moonraker", "HTTP 404", "has a route_prefix, write it behind the port:"}},
      {502, {"HTTP 502", "check that Moonraker runs"}},
      {401, {"it wants an API key"}}};
  for (const auto& [status, words] : cases) {
    const ScriptedMoonraker server({.upgrade_status = status});
    const std::string message = Refused(OptionsFor(server)).message;
    for (const std::string& word : words) EXPECT_THAT(message, HasSubstr(word)) << status;
  }
  const ScriptedMoonraker server({.upgrade_status = 401});
  MoonrakerOptions options = OptionsFor(server);
  options.api_key = "wrong";
  EXPECT_THAT(Refused(options).message, HasSubstr("key or token is wrong"));
}

TEST(MoonrakerConnect, UnauthorizedIdentifyAsksForAKey) {
  ScriptedMoonraker server;
  AnswerLikeMoonraker(server);
  server.AnswerError("server.connection.identify", -32602, "Unauthorized");
  EXPECT_THAT(Refused(OptionsFor(server)).message, HasSubstr("it wants an API key"));
  server.AnswerError("server.connection.identify", -32602, "Invalid API Key");
  MoonrakerOptions options = OptionsFor(server);
  options.api_key = "secret-but-wrong";
  const Error error = Refused(options);
  EXPECT_THAT(error.message,
              AllOf(HasSubstr("the API key is wrong"), Not(HasSubstr("secret-but-wrong"))));
}

TEST(MoonrakerConnect, ASilentPortRunsIntoTheTimeLimit) {
  const ScriptedMoonraker server({.silent = true});
  MoonrakerOptions options = OptionsFor(server);
  options.connect_time_limit_s = 0.2;
  EXPECT_THAT(Refused(options).message, HasSubstr("said nothing within 0.2 s"));
}

TEST(MoonrakerConnect, StopEndsTheWaitAtOnce) {
  ScriptedMoonraker server;
  server.Handle("server.connection.identify", [](const json&) { return std::vector<json>(); });
  std::stop_source source;
  std::thread stopper([&] {
    EXPECT_FALSE(server.WaitForRequest("server.connection.identify").is_null());
    source.request_stop();
  });
  const Error error = Refused(OptionsFor(server), {.time_limit_s = 60, .stop = source.get_token()});
  stopper.join();
  EXPECT_EQ(error.kind, ErrorKind::kInterrupted);
}

TEST(MoonrakerConnect, ConnectsToAPrinterThatIsNotReadyAndSaysWhy) {
  for (const char* state : {"startup", "error", "shutdown", "disconnected"}) {
    ScriptedMoonraker server;
    AnswerLikeMoonraker(server, state);
    const auto printer = Must(ConnectToMoonraker(OptionsFor(server), kPatience));
    EXPECT_EQ(ToString(printer->LastState().readiness), state);
    if (std::string(state) == "error" || std::string(state) == "shutdown") {
      EXPECT_EQ(printer->LastState().message, std::string("Printer is ") + state);
    }
    EXPECT_THAT(printer->WaitUntilReady({.time_limit_s = 0.05}),
                FailsWith(std::string("it is '") + state));
  }
}

TEST(MoonrakerConnect, SendsTheKeyInHeaderAndIdentifyButShowsItNowhere) {
  ScriptedMoonraker server;
  AnswerLikeMoonraker(server);
  MoonrakerOptions options = OptionsFor(server);
  options.api_key = "0123456789abcdef";
  const auto printer = Must(ConnectToMoonraker(options, kPatience));
  EXPECT_EQ(server.HttpRequestNumber(1).api_key, options.api_key);
  EXPECT_EQ(server.WaitForRequest("server.connection.identify")["params"]["api_key"],
            options.api_key);
}

TEST(MoonrakerConnect, AnAgentThatIsCalledByItsNameTakesNoOther) {
  ScriptedMoonraker server;
  AnswerLikeMoonraker(server);
  int taken = 1;
  server.Handle("server.connection.identify", [&taken](const json& request) {
    if (taken-- > 0) {
      return std::vector{
          test::ErrorFor(request, 400, "Agent 'trammel' already registered and connected'")};
    }
    return std::vector{test::ResultFor(request, {{"connection_id", 2}})};
  });
  MoonrakerOptions options = OptionsFor(server);
  options.other_names = false;
  EXPECT_THAT(Refused(options).message, HasSubstr("already registered"));
  const auto printer = Must(ConnectToMoonraker(options, kPatience));
  // A lost link that the server still holds has the name for a while, too.
  server.Handle("server.connection.identify", [&taken](const json& request) {
    if (++taken == 1) {
      return std::vector{
          test::ErrorFor(request, 400, "Agent 'trammel' already registered and connected'")};
    }
    return std::vector{test::ResultFor(request, {{"connection_id", 3}})};
  });
  taken = 0;
  server.BreakConnections();
  const json again = server.WaitForRequest("server.connection.identify", 4);
  ASSERT_FALSE(again.is_null());
  EXPECT_EQ(again["params"]["client_name"], "trammel");
  EXPECT_TRUE(printer->WaitUntilReady(kPatience));
}

TEST(MoonrakerConnect, SpeaksOverAUnixSocket) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() / "moonraker.sock";
  EXPECT_THAT(Refused({.address = "unix:" + path}).message,
              Containing(path, "check that Moonraker runs"));
  ScriptedMoonraker server({.unix_path = path});
  AnswerLikeMoonraker(server);
  const auto printer = Must(ConnectToMoonraker({.address = "unix:" + path}, kPatience));
  const Result<void> ran = printer->Run("M400", kPatience);
  EXPECT_TRUE(ran) << ran.error().message;
}

class MoonrakerTls : public ::testing::Test {
 protected:
  MoonrakerTls() : own_(test::MakeCertificate("IP:127.0.0.1")) {}

  /// A TLS server with this certificate, and how to reach it.
  void Serve(const test::Certificate& certificate) {
    server_ = std::make_unique<ScriptedMoonraker>(ServerOptions{
        .certificate_pem = certificate.certificate_pem, .key_pem = certificate.key_pem});
    AnswerLikeMoonraker(*server_);
    options_.address = "wss://127.0.0.1:" + std::to_string(server_->port()) + "/websocket";
    options_.ca_file = folder_.path() / "ca.pem";
    std::ofstream(options_.ca_file) << certificate.certificate_pem;
  }

  const test::TemporaryFolder folder_;
  const test::Certificate own_;
  std::unique_ptr<ScriptedMoonraker> server_;
  MoonrakerOptions options_;
};

TEST_F(MoonrakerTls, ConnectsWithTheCertificateAsAuthority) {
  Serve(own_);
  const auto printer = Must(ConnectToMoonraker(options_, kPatience));
  EXPECT_TRUE(printer->Run("M400", kPatience));
}

TEST_F(MoonrakerTls, RefusesASelfSignedCertificateUnlessToldOtherwise) {
  Serve(own_);
  options_.ca_file.clear();
  EXPECT_THAT(Refused(options_).message, Containing("does not prove who it is", "accept any"));
  options_.accept_any_certificate = true;
  EXPECT_TRUE(ConnectToMoonraker(options_, kPatience));
}

TEST_F(MoonrakerTls, PlainAndEncryptedPortsAreNotMixedUp) {
  Serve(own_);
  MoonrakerOptions plain = options_;
  plain.address = "127.0.0.1:" + std::to_string(server_->port());
  plain.connect_time_limit_s = 1;
  EXPECT_THAT(Refused(plain).message, HasSubstr("not a Moonraker"));
  const ScriptedMoonraker unencrypted;
  options_.address = "wss://127.0.0.1:" + std::to_string(unencrypted.port());
  options_.connect_time_limit_s = 1;
  EXPECT_THAT(Refused(options_).message, HasSubstr("cannot set up TLS"));
}

}  // namespace

}  // namespace trammel::machine
