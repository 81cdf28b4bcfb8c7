// Cameras over HTTP, against a server on a real socket that says what each test wrote down, and
// recordings in their place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <string>
#include <thread>
#include <vector>

#include "base/utf8.h"
#include "machine/camera/camera_sources.h"
#include "machine/camera/camera_url.h"
#include "machine/camera/digest_auth.h"
#include "machine/net/host_clock.h"
#include "support/matchers.h"
#include "support/scripted_http.h"
#include "support/temporary_folder.h"
#include "support/test_pictures.h"

namespace trammel::machine {
namespace {

using test::HttpPeer;
using test::MjpegHead;
using test::MjpegPart;
using test::ScriptedHttp;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kPatience_s = 5;  // for immediate events; never reached in a passing test
constexpr double kImpatience_s = 0.05;

std::string Picture(int phase = 0, int width = 64, int height = 48) {
  return test::JpegOf(test::TestPicture(width, height, phase));
}

ScriptedHttp::Script Answers(const std::string& bytes, bool stays_open = true) {
  return [=](const std::string&, HttpPeer& peer) {
    peer.Send(bytes);
    if (stays_open) peer.WaitForClose();
  };
}

/// Opens the address and reads frames until an error; its message comes last.
struct Outcome {
  std::vector<CapturedFrame> frames;
  Error error;
};

Outcome ReadUntilError(const std::string& address, double time_limit_s = kImpatience_s,
                       const CameraOptions& options = {}) {
  Outcome outcome;
  auto camera = OpenCamera(address, options);
  if (!camera) {
    outcome.error = camera.error();
    return outcome;
  }
  while (outcome.frames.size() < 100) {
    auto frame = (*camera)->Next(outcome.frames.empty() ? kPatience_s : time_limit_s, {});
    if (!frame) {
      outcome.error = frame.error();
      break;
    }
    outcome.frames.push_back(std::move(**frame));
  }
  EXPECT_EQ(outcome.error.kind, ErrorKind::kMachine) << outcome.error.message;
  EXPECT_THAT(outcome.error.message, HasSubstr("camera http://127.0.0.1"));
  return outcome;
}

TEST(MjpegStream, DeliversPicturesUntouchedInOrder) {
  std::string bytes = MjpegHead();
  for (int i = 0; i < 5; ++i) bytes += MjpegPart(Picture(i));
  const ScriptedHttp server(Answers(bytes));
  const double before_s = HostNow();
  const Outcome outcome = ReadUntilError(server.Url("/stream"));
  ASSERT_EQ(outcome.frames.size(), 5);
  for (int i = 0; i < 5; ++i) {
    const CapturedFrame& frame = outcome.frames[i];
    EXPECT_EQ(std::string(frame.image.begin(), frame.image.end()), Picture(i));
    EXPECT_EQ(frame.width_px, 64);
    EXPECT_EQ(frame.height_px, 48);
    EXPECT_EQ(frame.fault, FrameFault::kNone);
    EXPECT_GE(frame.arrival_s, before_s);
    EXPECT_LE(frame.arrival_s, HostNow());
    EXPECT_FALSE(frame.captured);
  }
  const auto decoded = Must(DecodeFrame(outcome.frames[0]));
  EXPECT_EQ(decoded.width, 64);
}

TEST(MjpegStream, ReadsTheTimesOfEveryServerItKnows) {
  struct Case {
    std::string fields;
    std::optional<CameraTime> captured;
    std::optional<CameraTime> sent;
  };
  using enum CameraClock;
  const std::vector<Case> cases = {
      {"X-UStreamer-Grab-Time: 12.25\r\nX-UStreamer-Send-Time: 12.5\r\nX-Timestamp: "
       "1790000000.5\r\n",
       CameraTime{12.25, kCameraMonotonic}, CameraTime{12.5, kCameraMonotonic}},
      {"x-ustreamer-grab-begin-time: 12.25\r\n", CameraTime{12.25, kCameraMonotonic}, {}},
      {"X-Timestamp: 1790000000.500000\r\n", {}, CameraTime{1790000000.5, kCameraWall}},
      {"X-Timestamp: 5012.040000\r\n", CameraTime{5012.04, kCameraMonotonic}, {}},
      {"X-UStreamer-Grab-Time: nan\r\nX-Timestamp: 1e400\r\n", {}, {}},
      {"X-UStreamer-Grab-Time: -3\r\nX-Timestamp: 12.5x\r\n", {}, {}},
      {"", {}, {}},
  };
  for (const Case& c : cases) {
    const ScriptedHttp server(Answers(MjpegHead() + MjpegPart(Picture(), c.fields)));
    const Outcome outcome = ReadUntilError(server.Url("/"));
    ASSERT_EQ(outcome.frames.size(), 1) << c.fields;
    const auto same = [](const std::optional<CameraTime>& a, const std::optional<CameraTime>& b) {
      return a.has_value() == b.has_value() &&
             (!a || (a->time_s == b->time_s && a->clock == b->clock));
    };
    EXPECT_TRUE(same(outcome.frames[0].captured, c.captured)) << c.fields;
    EXPECT_TRUE(same(outcome.frames[0].sent, c.sent)) << c.fields;
  }
}

TEST(MjpegStream, AsksForCaptureTimesAndGivesWayToAServerThatRefuses) {
  const std::string good = MjpegHead() + MjpegPart(Picture());
  const ScriptedHttp server([&](const std::string& request, HttpPeer& peer) {
    const bool refuses = request.find("extra_headers") != std::string::npos;
    peer.Send(refuses ? "HTTP/1.1 400 Bad Request\r\n\r\n" : good);
    if (!refuses) peer.WaitForClose();
  });
  EXPECT_EQ(ReadUntilError(server.Url("/?action=stream")).frames.size(), 1);
  ASSERT_EQ(server.requests().size(), 2);
  EXPECT_THAT(server.requests()[0], HasSubstr("GET /?action=stream&extra_headers=1 HTTP"));
  EXPECT_THAT(server.requests()[1], HasSubstr("GET /?action=stream HTTP"));
}

TEST(MjpegStream, SendsUserAndPasswordAndNeverShowsThem) {
  const ScriptedHttp server(Answers("HTTP/1.1 401 Unauthorized\r\n\r\n", false));
  const std::string address =
      "http://user:p%40ss@127.0.0.1:" + std::to_string(server.port()) + "/stream";
  const Outcome outcome = ReadUntilError(address);
  EXPECT_THAT(outcome.error.message, Containing("401", "password into"));
  EXPECT_EQ(outcome.error.message.find("p%40ss"), std::string::npos);
  // base64("user:p@ss")
  EXPECT_THAT(server.requests().at(0), HasSubstr("Authorization: Basic dXNlcjpwQHNz\r\n"));
}

// A camera that wants Digest: Basic sends the password to whoever listens, and is refused.
TEST(MjpegStream, AnswersAChallengeByDigest) {
  for (const std::string algorithm : {"MD5", "SHA-256"}) {
    const std::string refusal =
        "HTTP/1.1 401 Unauthorized\r\nWWW-Authenticate: Basic realm=\"cam\"\r\n"
        "WWW-Authenticate: Digest realm=\"cam\", nonce=\"abc\", qop=\"auth\", algorithm=" +
        algorithm + "\r\n\r\n";
    const ScriptedHttp server([&](const std::string& request, HttpPeer& peer) {
      const bool signed_in = request.find(
                                 "Authorization: Digest username=\"user\", realm=\"cam\", "
                                 "nonce=\"abc\"") != std::string::npos &&
                             request.find("algorithm=" + algorithm) != std::string::npos;
      peer.Send(signed_in ? MjpegHead() + MjpegPart(Picture()) : refusal);
      if (signed_in) peer.WaitForClose();
    });
    const std::string address =
        "http://user:p%40ss@127.0.0.1:" + std::to_string(server.port()) + "/stream";
    EXPECT_EQ(ReadUntilError(address).frames.size(), 1) << algorithm;
    ASSERT_EQ(server.requests().size(), 2U);
    EXPECT_THAT(server.requests()[1], HasSubstr("uri=\"/stream?extra_headers=1\""));
  }
}

TEST(MjpegStream, ShowsNeitherTokensNorBytesThatATerminalCannotRead) {
  const ScriptedHttp server(Answers("HTTP/1.1 404 \xFF\x1b[2J\r\n\r\n", false));
  const std::string address =
      "http://127.0.0.1:" + std::to_string(server.port()) + "/\xFF?token=s3cret&x=1";
  const std::string said = ReadUntilError(address).error.message;
  EXPECT_EQ(said.find("s3cret"), std::string::npos) << said;
  EXPECT_EQ(said, Utf8OrReplaced(said));
  EXPECT_THAT(said, HasSubstr("token=…&x=1"));
  EXPECT_THAT(server.requests().at(0), HasSubstr("GET /\xFF?token=s3cret&x=1"));
  for (const char* bad :
       {"http://me:s3cret@[::1", "http://me:s3/cret@camera", "ftp://me:s3cret@a"}) {
    const auto url = ParseCameraUrl(bad);
    ASSERT_FALSE(url) << bad;
    EXPECT_EQ(url.error().message.find("s3"), std::string::npos) << url.error().message;
  }
}

TEST(MjpegStream, ReadsChunkedAnswers) {
  const std::string body = MjpegPart(Picture(1)) + MjpegPart(Picture(2));
  std::string head = MjpegHead();
  head.insert(head.size() - 2, "Transfer-Encoding: chunked\r\n");
  char size[32];
  std::snprintf(size, sizeof size, "%zx\r\n", body.size());
  const ScriptedHttp server(Answers(head + size + body + "\r\n0\r\n\r\n"));
  EXPECT_EQ(ReadUntilError(server.Url("/")).frames.size(), 2);
}

TEST(MjpegStream, NamesWhatIsNotAStream) {
  const auto message = [](const std::string& answer) {
    const ScriptedHttp server(Answers(answer, false));
    return ReadUntilError(server.Url("/x")).error.message;
  };
  EXPECT_THAT(message("HTTP/1.1 404 Not Found\r\n\r\n"), Containing("404", "check the path"));
  EXPECT_THAT(message("HTTP/1.1 302 Found\r\nLocation: /y\r\n\r\n"), HasSubstr("/y"));
  EXPECT_THAT(message("HTTP/1.1 503 Busy\r\n\r\n"), HasSubstr("plugged in"));
  EXPECT_THAT(message("HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n<html>"),
              HasSubstr("text/html"));
  EXPECT_THAT(message("HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\n\r\n"),
              HasSubstr("single picture"));
  EXPECT_THAT(message("SSH-2.0-OpenSSH_9.2\r\n"), HasSubstr("not HTTP"));
  EXPECT_THAT(message(""), HasSubstr("after 0 bytes"));
  EXPECT_THAT(message("HTTP/1.1 200 OK\r\nX: " + std::string(70'000, 'x')), HasSubstr("65536"));
}

TEST(MjpegStream, NamesAStallAndGoesOnAfterIt) {
  std::promise<void> stalled;
  const ScriptedHttp server([&](const std::string&, HttpPeer& peer) {
    const std::string part = MjpegPart(Picture());
    peer.Send(MjpegHead() + part + part.substr(0, 200));
    stalled.get_future().wait();
    peer.Send(part.substr(200));
    peer.WaitForClose();
  });
  auto camera = Must(OpenCamera(server.Url("/")));
  ASSERT_TRUE(camera->Next(kPatience_s, {}));
  EXPECT_THAT(camera->Next(kImpatience_s, {}),
              FailsWith(ErrorKind::kMachine, "no frame within 0.05 s", "after 1 frames"));
  stalled.set_value();
  const auto after = Must(camera->Next(kPatience_s, {}));
  EXPECT_EQ(after->fault, FrameFault::kNone);
}

TEST(MjpegStream, IsStoppedAtOnce) {
  const ScriptedHttp server(Answers(MjpegHead()));
  auto camera = Must(OpenCamera(server.Url("/")));
  std::stop_source stop;
  std::jthread stopper([&] { stop.request_stop(); });
  const double before_s = HostNow();
  EXPECT_THAT(camera->Next(60, stop.get_token()), FailsWith(ErrorKind::kInterrupted));
  EXPECT_LT(HostNow() - before_s, 30);
}

TEST(MjpegStream, MarksDamagedFramesAndKeepsTheRest) {
  const std::string whole = Picture();
  std::string half = MjpegPart(whole);
  // The announced length stays, the second half of the picture is missing.
  half.erase(half.size() - whole.size() / 2, whole.size() / 2 - 2);
  const std::string bytes =
      MjpegHead() + MjpegPart(whole) + half + MjpegPart(whole) + MjpegPart("no picture") +
      MjpegPart(Picture(0, 32, 24)) + MjpegPart(whole, "X-UStreamer-Online: false\r\n") +
      MjpegPart(whole, "X-UStreamer-Grab-Time: 10.0\r\n") +
      MjpegPart(whole, "X-UStreamer-Grab-Time: 9.0\r\n") +
      MjpegPart(whole, "X-UStreamer-Grab-Time: 9.1\r\n") + MjpegPart(whole).substr(0, 300);
  const ScriptedHttp server(Answers(bytes, false));
  const Outcome outcome = ReadUntilError(server.Url("/"), kPatience_s);
  std::vector<FrameFault> faults;
  for (const auto& frame : outcome.frames) faults.push_back(frame.fault);
  using enum FrameFault;
  EXPECT_THAT(faults, testing::ElementsAre(kNone, kCutOff, kNone, kNotAnImage, kOtherSize,
                                           kNoSignal, kNone, kTimeJumped, kNone, kCutOff));
  EXPECT_THAT(outcome.frames[4].fault_text, Containing("32x24", "64x48"));
  EXPECT_THAT(outcome.error.message, HasSubstr("stream ended after 10 frames"));
}

TEST(CameraUrl, IsTakenApart) {
  const auto url = Must(ParseCameraUrl("HTTPS://u:p%3A@[fe80::1]:8443/a?b=c#d"));
  EXPECT_TRUE(url.tls);
  EXPECT_EQ(url.host, "fe80::1");
  EXPECT_EQ(url.port, 8443);
  EXPECT_EQ(url.target, "/a?b=c");
  EXPECT_EQ(url.user, "u");
  EXPECT_EQ(url.password, "p:");
  EXPECT_EQ(url.ToString(), "https://[fe80::1]:8443/a?b=c");
  EXPECT_EQ(ParseCameraUrl("http://host?x")->target, "/?x");
  for (const char* bad : {"ftp://x", "http://", "http:///x", "http://h:0/", "http://h:65536/",
                          "http://h:/", "http://h:8x/", "http://[::1/", "http://h/a b",
                          "http://h/\r\nX: y", "http://[::1]x/", "http://[[[]/", "http://a]b/"}) {
    EXPECT_FALSE(ParseCameraUrl(bad)) << bad;
  }
}

using ::testing::Not;

// RFC 7616, 3.9.1: a server that offers both.
constexpr const char* kRealm =
    "realm=\"http-auth@example.org\", qop=\"auth, auth-int\", "
    "nonce=\"7ypf/xlj9XXwfDPEoM4URrv/xwf94BcCAzFZH4GiTo0v\", "
    "opaque=\"FQhe/qaU925kfnzjCev0ciny7QMkPqMAFRtzCUYo5tdS\"";
constexpr const char* kNonce = "f2/wE4q74E6zIJEtWaHKaf5wv/H5QzzpXusqGemxURZJ";

std::string AnswerTo(const std::string& field) {
  const auto challenge = ParseDigest(field);
  return challenge ? DigestAnswer(*challenge, "Mufasa", "Circle of Life", "/dir/index.html", kNonce)
                   : "none";
}

TEST(DigestAuth, AnswersAsTheStandardsExamplesDo) {
  EXPECT_THAT(AnswerTo(std::string("Digest algorithm=MD5, ") + kRealm),
              Containing("response=\"8ca523f5e9506fed4657c9700eebdbec\"", "username=\"Mufasa\"",
                         "uri=\"/dir/index.html\"", "qop=auth, nc=00000001", "algorithm=MD5"));
  EXPECT_THAT(
      AnswerTo(std::string("Digest ") + kRealm + ", algorithm=SHA-256"),
      HasSubstr("response=\"753927fa0e85d155564e2e272a28d1802ca10daf4496794697cf8db5856cb6c1"
                "\""));
  // RFC 2617, 3.5, whose server names no algorithm.
  const auto old = Must(ParseDigest(
      "Digest realm=\"testrealm@host.com\", qop=\"auth,auth-int\", "
      "nonce=\"dcd98b7102dd2f0e8b11d0f600bfb0c093\", opaque=\"5ccc069c403ebaf9f0171e9517f40e41\""));
  EXPECT_THAT(DigestAnswer(old, "Mufasa", "Circle Of Life", "/dir/index.html", "0a4f113b"),
              AllOf(HasSubstr("response=\"6629fae49393a05397450978507c4ef1\""),
                    Not(HasSubstr("algorithm"))));
}

TEST(DigestAuth, WhatCannotBeAnsweredIsNone) {
  for (const char* field :
       {"", "Basic realm=\"a\"", "Digest", "Digest realm=\"a\"", "Digest nonce=\"\"",
        "Digest nonce=\"n\", algorithm=SHA-512-256", "Digest nonce=\"n\", qop=\"auth-int\"",
        "nonce=\"n\"", "=,=,\"", "Digest nonce=\"", "Bearer nonce=\"n\""}) {
    EXPECT_EQ(AnswerTo(field), "none") << field;
  }
  // Answers without qop follow RFC 2069, and a server's text cannot end a line of the request.
  EXPECT_THAT(AnswerTo("digest nonce = \"n\\\"\r\nX: 1\""),
              AllOf(HasSubstr("nonce=\"n\\\"X: 1\""), Not(HasSubstr("cnonce"))));
}

class FrameFilesTest : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& bytes) const {
    test::WriteWhole(folder_.path() / name, bytes);
  }
  [[nodiscard]] std::string Message(const std::string& name) const {
    auto camera = OpenCamera((folder_.path() / name).string());
    return camera ? (*camera)->Describe() : camera.error().message;
  }
  test::TemporaryFolder folder_;
};

TEST_F(FrameFilesTest, AFolderComesInTheOrderOfItsNumbers) {
  for (const int i : {10, 9, 1, 2}) {
    Write("frame" + std::to_string(i) + ".jpg", test::JpegOf(test::TestPicture(32, 24, i)));
  }
  Write("frame11.JPG", test::JpegOf(test::TestPicture(48, 24, 0)));
  Write("frame12.png", "not a picture");
  Write("notes.txt", "x");
  auto camera = Must(OpenCamera(folder_.path().string()));
  EXPECT_FALSE(camera->live());
  for (const int i : {1, 2, 9, 10}) {
    const auto frame = camera->Next(1, {});
    ASSERT_TRUE(frame && *frame);
    const std::string expected = test::JpegOf(test::TestPicture(32, 24, i));
    EXPECT_EQ(std::string((*frame)->image.begin(), (*frame)->image.end()), expected) << i;
    EXPECT_FALSE((*frame)->captured);
  }
  EXPECT_EQ((**camera->Next(1, {})).fault, FrameFault::kOtherSize);
  EXPECT_EQ((**camera->Next(1, {})).fault, FrameFault::kNotAnImage);
  EXPECT_FALSE(*camera->Next(1, {}));
}

TEST_F(FrameFilesTest, NamesWhatIsNotThereOrNotAVideo) {
  EXPECT_THAT(Message("none.avi"), HasSubstr("nothing of that name"));
  Write("text.avi", std::string(1000, 'x'));
  EXPECT_THAT(Message("text.avi"), HasSubstr("text.avi"));
  EXPECT_THAT(Message(""), HasSubstr("holds no .jpg"));
  EXPECT_THAT(OpenCamera("rtsp://host/stream"), FailsWith("MJPEG over HTTP"));
  EXPECT_THAT(OpenCamera("/dev/video-none"), FailsWith(ErrorKind::kMachine, "plugged in"));
  EXPECT_THAT(OpenCamera("/dev/null"), FailsWith("not a video device"));
}

}  // namespace
}  // namespace trammel::machine
