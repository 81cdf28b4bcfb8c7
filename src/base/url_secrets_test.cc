#include "base/url_secrets.h"

#include <gtest/gtest.h>

#include <string>

namespace trammel {
namespace {

TEST(UrlSecrets, LeavesOutUserAndPassword) {
  EXPECT_EQ(WithoutSecrets("http://me:hunter2@camera.local:8080/stream"),
            "http://…@camera.local:8080/stream");
  EXPECT_EQ(WithoutSecrets("https://me@camera/"), "https://…@camera/");
  EXPECT_EQ(WithoutSecrets("http://me:hun/ter@2@camera/"), "http://…@camera/");
  EXPECT_EQ(WithoutSecrets("rtsp://me:hunter2@camera"), "rtsp://…@camera");
}

TEST(UrlSecrets, LeavesOutAPasswordThatEndsTheHostByMistake) {
  EXPECT_EQ(WithoutSecrets("http://me:hun?ter@camera/"), "http://…@camera/");
  EXPECT_EQ(WithoutSecrets("http://me:12?34@camera/"), "http://…@camera/");
  EXPECT_EQ(WithoutSecrets("http://me:hun#ter@camera/"), "http://…@camera/");
  EXPECT_EQ(WithoutSecrets("http://me:hu/n?ter@camera/"), "http://…@camera/");
  EXPECT_EQ(WithoutSecrets("http://me:hun@t?er@camera/"), "http://…@camera/");
}

TEST(UrlSecrets, LeavesOutAPasswordWithoutAScheme) {
  EXPECT_EQ(WithoutSecrets("me:hunter2@camera:8080/stream?token=a"),
            "…@camera:8080/stream?token=…");
  EXPECT_EQ(WithoutSecrets("me:hun?ter@camera"), "…@camera");
}

TEST(UrlSecrets, LeavesOutValuesThatOpenDoors) {
  EXPECT_EQ(WithoutSecrets("http://camera/?action=stream&Token=abc&x=1"),
            "http://camera/?action=stream&Token=…&x=1");
  EXPECT_EQ(WithoutSecrets("/webcam/?api_key=abc#here"), "/webcam/?api_key=…#here");
  EXPECT_EQ(WithoutSecrets("http://c/?password=a=b;auth=c"), "http://c/?password=…;auth=…");
}

TEST(UrlSecrets, LeavesAllOtherTextAsItIs) {
  for (const std::string text :
       {"", "http://camera/?action=stream", "/dev/video0", "aravis:ID", "a@b", "?", "http://",
        "\xFF\n", "http://camera:8080/?to=a@b", "http://[fe80::1]:80/?to=a@b", "camera:8080/stream",
        "/webcam/?to=a@b", "it says: mail to a@b"}) {
    EXPECT_EQ(WithoutSecrets(text), text);
  }
}

}  // namespace
}  // namespace trammel
