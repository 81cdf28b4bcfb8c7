#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "machine/net/http.h"

namespace trammel::machine {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::span<const std::uint8_t> Bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

/// The bodies of all parts when the stream comes in pieces of `piece` bytes; an error as its text.
std::vector<std::string> Bodies(const std::string& stream, std::size_t piece,
                                const std::string& boundary = "b",
                                const MultipartLimits& limits = {}) {
  MultipartReader reader(boundary, limits);
  std::vector<std::string> bodies;
  for (std::size_t at = 0; at < stream.size(); at += piece) {
    reader.Feed(Bytes(stream).subspan(at, std::min(piece, stream.size() - at)),
                static_cast<double>(at));
    for (;;) {
      auto part = reader.Take();
      if (!part) {
        bodies.push_back("error: " + part.error().message);
        return bodies;
      }
      if (!*part) break;
      bodies.emplace_back((*part)->body.begin(), (*part)->body.end());
    }
  }
  if (auto rest = reader.TakeRest()) {
    bodies.push_back("rest: " + std::string(rest->body.begin(), rest->body.end()));
  }
  return bodies;
}

TEST(Multipart, TakesPartsWhateverTheServersHabits) {
  const std::vector<std::pair<std::string, std::string>> streams = {
      {"length",
       "--b\r\nContent-Length: 3\r\n\r\none\r\n--b\r\nContent-Length: 3\r\n\r\ntwo\r\n--b--"},
      {"no length", "--b\r\nX: 1\r\n\r\none\r\n--b\r\nX: 2\r\n\r\ntwo\r\n--b--\r\n"},
      {"preamble", "hello\r\nworld\r\n\r\n--b\r\n\r\none\r\n--b\r\n\r\ntwo\r\n--b--"},
      {"bare line feeds", "--b\nContent-Length: 3\n\none\n--b\n\ntwo\n--b--\n"},
      {"more dashes", "----b\r\nContent-Length: 3\r\n\r\none\r\n----b\r\n\r\ntwo\r\n----b--"},
      {"nothing between",
       "--b\r\nContent-Length: 3\r\n\r\none--b\r\nContent-Length: 3\r\n\r\ntwo--b--"},
      {"text between", "--b\r\nContent-Length: 3\r\n\r\none\r\njunk\r\n--b\r\n\r\ntwo\r\n--b--"},
      {"length too short", "--b\r\nContent-Length: 3\r\n\r\nonemore\r\n--b\r\n\r\ntwo\r\n--b--"},
      {"length too long",
       "--b\r\nContent-Length: 30\r\n\r\none\r\n--b\r\nContent-Length: 3\r\n\r\ntwo\r\n--b--\r\n"},
      {"length no number",
       "--b\r\nContent-Length: three\r\n\r\none\r\n--b\r\nContent-Length: -3\r\n\r\ntwo\r\n--b--"},
      {"dashes in the body", "--b\r\n\r\none\r\n--b\r\nContent-Length: 3\r\n\r\ntwo\r\n--b--"},
  };
  for (const auto& [name, stream] : streams) {
    for (std::size_t piece = 1; piece <= stream.size(); ++piece) {
      ASSERT_THAT(Bodies(stream, piece), ElementsAre("one", "two")) << name << ", " << piece;
    }
  }
}

TEST(Multipart, LearnsABoundaryThatWasNotAnnounced) {
  const std::string stream =
      "\r\n--own\r\n\r\none\r\n--own\r\nContent-Length: 3\r\n\r\ntwo\r\n--own--";
  for (std::size_t piece = 1; piece <= stream.size(); ++piece) {
    ASSERT_THAT(Bodies(stream, piece, ""), ElementsAre("one", "two")) << piece;
  }
}

TEST(Multipart, GivesTheRestOfAStreamThatBreaksOff) {
  EXPECT_THAT(Bodies("--b\r\nContent-Length: 9\r\n\r\nhalf", 5), ElementsAre("rest: half"));
  EXPECT_THAT(Bodies("--b\r\n\r\nhalf", 5), ElementsAre("rest: half"));
  EXPECT_THAT(Bodies("--b\r\nContent-Le", 5), ElementsAre());
}

TEST(Multipart, StampsAPartWithTheReadThatBroughtItsEnd) {
  MultipartReader reader("b", {});
  reader.Feed(Bytes("--b\r\n\r\non"), 1);
  reader.Feed(Bytes("e"), 2);
  EXPECT_FALSE(*reader.Take());
  reader.Feed(Bytes("\r\n--b\r\n\r\n"), 3);
  const auto part = reader.Take();
  ASSERT_TRUE(part && *part);
  EXPECT_EQ((*part)->arrival_s, 2);
}

TEST(Multipart, RefusesWhatWouldNotEnd) {
  MultipartLimits limits{100, 100, 1000};
  EXPECT_THAT(Bodies(std::string(200, 'x'), 10, "b", limits).back(), HasSubstr("within 100"));
  EXPECT_THAT(Bodies(std::string(200, 'x'), 10, "", limits).back(), HasSubstr("within 100"));
  EXPECT_THAT(Bodies("--b\r\nX: " + std::string(200, 'x'), 10, "b", limits).back(),
              HasSubstr("head of a part"));
  EXPECT_THAT(Bodies("--b" + std::string(200, 'x'), 10, "b", limits).back(), HasSubstr("line"));
  EXPECT_THAT(Bodies("--b\r\n\r\n" + std::string(2000, 'x'), 10, "b", limits).back(),
              HasSubstr("without an end within 1000"));
  for (const char* length : {"1001", "99999999999999999999999"}) {
    EXPECT_THAT(
        Bodies(std::string("--b\r\nContent-Length: ") + length + "\r\n\r\nx", 10, "b", limits)
            .back(),
        HasSubstr("1000"));
  }
}

TEST(HttpHead, RefusesWhatIsNotHttp) {
  EXPECT_EQ(ParseHttpHead("HTTP/1.1 404 Not Found\r\nA: b")->status, 404);
  EXPECT_EQ(ParseHttpHead("HTTP/1.1 404 Not Found\r\nA: b")->fields.at("a"), "b");
  for (const char* head :
       {"", "HTTP/1.1", "HTTP/1.1 x", "SSH-2.0-OpenSSH", "HTTP/1.1 20", "\x16\x03"}) {
    EXPECT_FALSE(ParseHttpHead(head)) << head;
  }
}

TEST(ChunkDecoder, JoinsChunksInPiecesOfAnySize) {
  const std::string text = "3\r\nabc\r\n10;x=y\r\n0123456789abcdef\r\n0\r\n\r\n";
  for (std::size_t piece = 1; piece <= text.size(); ++piece) {
    ChunkDecoder decoder;
    std::vector<std::uint8_t> out;
    for (std::size_t at = 0; at < text.size(); at += piece) {
      ASSERT_TRUE(decoder.Decode(Bytes(text).subspan(at, std::min(piece, text.size() - at)), out));
    }
    EXPECT_EQ(std::string(out.begin(), out.end()), "abc0123456789abcdef");
    EXPECT_TRUE(decoder.ended());
  }
  for (const char* broken : {"xyz\r\n", "\r\n\r\n", "ffffffffffff\r\n"}) {
    ChunkDecoder decoder;
    std::vector<std::uint8_t> out;
    EXPECT_FALSE(decoder.Decode(Bytes(broken), out)) << broken;
  }
}

}  // namespace
}  // namespace trammel::machine
