// Digest authentication against the examples of RFC 7616 and RFC 2617.
#include "machine/camera/digest_auth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::machine {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
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
              AllOf(HasSubstr("response=\"8ca523f5e9506fed4657c9700eebdbec\""),
                    HasSubstr("username=\"Mufasa\""), HasSubstr("uri=\"/dir/index.html\""),
                    HasSubstr("qop=auth, nc=00000001"), HasSubstr("algorithm=MD5")));
  EXPECT_THAT(
      AnswerTo(std::string("Digest ") + kRealm + ", algorithm=SHA-256"),
      HasSubstr("response=\"753927fa0e85d155564e2e272a28d1802ca10daf4496794697cf8db5856cb6c1"
                "\""));
  // RFC 2617, 3.5, whose server names no algorithm.
  const auto old = ParseDigest(
      "Digest realm=\"testrealm@host.com\", qop=\"auth,auth-int\", "
      "nonce=\"dcd98b7102dd2f0e8b11d0f600bfb0c093\", opaque=\"5ccc069c403ebaf9f0171e9517f40e41\"");
  ASSERT_TRUE(old);
  EXPECT_THAT(DigestAnswer(*old, "Mufasa", "Circle Of Life", "/dir/index.html", "0a4f113b"),
              AllOf(HasSubstr("response=\"6629fae49393a05397450978507c4ef1\""),
                    Not(HasSubstr("algorithm"))));
}

TEST(DigestAuth, TakesTheStrongestOfSeveralChallenges) {
  const std::string both = std::string("Basic realm=\"x, Digest\", Digest algorithm=MD5, ") +
                           kRealm + ", Digest algorithm=SHA-256, " + kRealm;
  EXPECT_TRUE(ParseDigest(both)->sha256);
  EXPECT_TRUE(AsksFor("Basic", both));
  EXPECT_TRUE(AsksFor("digest", both));
  EXPECT_FALSE(AsksFor("Bearer", both));
}

TEST(DigestAuth, WhatCannotBeAnsweredIsNone) {
  for (const char* field :
       {"", "Basic realm=\"a\"", "Digest", "Digest realm=\"a\"", "Digest nonce=\"\"",
        "Digest nonce=\"n\", algorithm=SHA-512-256", "Digest nonce=\"n\", qop=\"auth-int\"",
        "nonce=\"n\"", "=,=,\"", "Digest nonce=\"", "Bearer nonce=\"n\""}) {
    EXPECT_EQ(AnswerTo(field), "none") << field;
  }
  // Without qop as of RFC 2069, and what a server writes into its words ends no line of ours.
  EXPECT_THAT(AnswerTo("digest nonce = \"n\\\"\r\nX: 1\""),
              AllOf(HasSubstr("nonce=\"n\\\"X: 1\""), Not(HasSubstr("cnonce"))));
}

TEST(DigestAuth, ASessionsSecretHoldsBothNonces) {
  const std::string plain = AnswerTo(std::string("Digest algorithm=SHA-256, ") + kRealm);
  const std::string session = AnswerTo(std::string("Digest algorithm=SHA-256-sess, ") + kRealm);
  EXPECT_THAT(session, HasSubstr("algorithm=SHA-256-sess"));
  const auto response = [](const std::string& answer) {
    return answer.substr(answer.find("response="), 74);
  };
  EXPECT_NE(response(plain), response(session));
}

}  // namespace
}  // namespace trammel::machine
