#include "panel/guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::panel {
namespace {

using ::testing::HasSubstr;

unsigned StatusOf(const RequestHead& head, const GuardOptions& options = {}) {
  const auto denial = CheckRequest(head, options);
  return denial ? denial->status : 200;
}

TEST(Guard, AnswersUnderNumbersAndItsOwnNamesOnly) {
  for (const char* host : {"127.0.0.1:7130", "localhost:7130", "192.168.1.20", "[::1]:7130",
                           "[fd00::7]", "LOCALHOST", "localhost."}) {
    EXPECT_EQ(StatusOf({.method = "GET", .host = host}), 200U) << host;
  }
  for (const char* host :
       {"evil.example", "evil.example:7130", "", "127.0.0.1.evil.example", "localhost.evil.example",
        "printer.test", "a b", "[::1", "[fe80::1%1 x; script-src *]", "1.2.3.4@x"}) {
    EXPECT_EQ(StatusOf({.method = "GET", .host = host}), 421U) << host;
  }
  EXPECT_EQ(StatusOf({.method = "GET", .host = "Printer.test:80"}, {{"printer.TEST"}}), 200U);
  const auto denial = CheckRequest({.method = "GET", .host = "voron.lan"}, {});
  EXPECT_THAT(denial->message, HasSubstr("--panel-name voron.lan"));
}

TEST(Guard, ChangesAndWebSocketsComeFromItsOwnPageOrFromNoBrowser) {
  RequestHead post{.method = "POST", .host = "localhost:7130", .content_type = "application/json"};
  EXPECT_EQ(StatusOf(post), 200U);
  post.origin = "http://localhost:7130";
  EXPECT_EQ(StatusOf(post), 200U);
  post.origin = "https://LOCALHOST:7130";  // a proxy with TLS
  EXPECT_EQ(StatusOf(post), 200U);
  for (const char* origin : {"http://evil.example", "http://localhost", "http://localhost:71300",
                             "null", "localhost:7130", "http://evil.example/localhost:7130"}) {
    post.origin = origin;
    EXPECT_EQ(StatusOf(post), 403U) << origin;
  }
  post.origin = {};
  for (const char* site : {"cross-site", "same-site", "anything"}) {
    post.fetch_site = site;
    EXPECT_EQ(StatusOf(post), 403U) << site;
  }
  RequestHead socket{.method = "GET", .host = "localhost", .upgrades = true};
  EXPECT_EQ(StatusOf(socket), 200U);
  socket.origin = "http://evil.example";
  EXPECT_EQ(StatusOf(socket), 403U);
  EXPECT_EQ(StatusOf({.method = "GET", .host = "localhost", .origin = "http://evil.example"}), 200U)
      << "a link to the panel";
}

TEST(Guard, RefusesContentThatAFormCanSend) {
  for (const char* type :
       {"", "text/plain", "application/x-www-form-urlencoded", "multipart/form-data"}) {
    EXPECT_EQ(StatusOf({.method = "POST", .host = "localhost", .content_type = type}), 415U)
        << type;
  }
  for (const char* type : {"image/jpeg", "image/heic", "application/octet-stream"}) {
    EXPECT_EQ(StatusOf({.method = "POST", .host = "localhost", .content_type = type}), 200U)
        << type;
  }
}

TEST(Guard, KnowsNearbyAddresses) {
  for (const char* address : {"127.0.0.1", "10.1.2.3", "172.16.0.1", "172.31.255.1", "192.168.0.9",
                              "169.254.3.4", "::1", "fe80::1", "fd12::1", "::ffff:192.168.1.2"}) {
    EXPECT_TRUE(IsNearby(address)) << address;
  }
  for (const char* address : {"8.8.8.8", "172.32.0.1", "192.169.0.1", "2001:db8::1",
                              "::ffff:8.8.8.8", "", "printer", "127.0.0.1.evil"}) {
    EXPECT_FALSE(IsNearby(address)) << address;
  }
}

TEST(Guard, FramesAreOfTheSameHost) {
  EXPECT_THAT(ContentSecurityPolicy("printer.local"),
              HasSubstr("frame-ancestors 'self' http://printer.local:* https://printer.local:*"));
  EXPECT_THAT(ContentSecurityPolicy("fd00::7"), HasSubstr("http://[fd00::7]:*"));
}

}  // namespace
}  // namespace trammel::panel
