#include "machine/moonraker/rpc_calls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace trammel::machine {
namespace {

using nlohmann::json;
using Kind = RpcAnswer::Kind;

/// Ends of calls, in their order.
struct Ends {
  std::vector<RpcAnswer> answers;
  std::function<void(const RpcAnswer&)> Note() {
    return [this](const RpcAnswer& answer) { answers.push_back(answer); };
  }
};

TEST(RpcCalls, EachCallGetsItsOwnAnswerOnce) {
  RpcCalls calls;
  Ends first, second;
  const auto one = calls.Begin("server.info", nullptr, first.Note());
  const auto two = calls.Begin("printer.info", {{"a", "\xff"}}, second.Note());
  EXPECT_EQ(json::parse(one.text),
            json({{"jsonrpc", "2.0"}, {"method", "server.info"}, {"id", one.id}}));
  EXPECT_EQ(json::parse(two.text)["params"]["a"], "\xef\xbf\xbd");
  for (int i = 0; i < 2; ++i) calls.TakeAnswer({{"id", two.id}, {"result", {{"b", i}}}}, 5);
  EXPECT_TRUE(first.answers.empty());
  ASSERT_EQ(second.answers.size(), 1u);
  EXPECT_EQ(second.answers[0].kind, Kind::kResult);
  EXPECT_EQ(second.answers[0].result["b"], 0);
  EXPECT_EQ(second.answers[0].received_s, 5);
  calls.TakeAnswer({{"id", one.id}, {"error", {{"code", 1e300}, {"message", "no"}}}}, 6);
  ASSERT_EQ(first.answers.size(), 1u);
  EXPECT_EQ(first.answers[0].kind, Kind::kError);
  EXPECT_EQ(first.answers[0].code, 1'000'000);
  EXPECT_EQ(first.answers[0].message, "no");
}

TEST(RpcCalls, AnAnswerIsHandedOnWithoutACopyHoweverLargeItIs) {
  RpcCalls calls;
  RpcAnswer got;
  const auto call =
      calls.Begin("server.info", nullptr, [&got](RpcAnswer answer) { got = std::move(answer); });
  json message = {{"id", call.id}, {"result", {1, 2, 3}}};
  const json* const first = &message["result"][0];
  calls.TakeAnswer(std::move(message), 0);
  ASSERT_EQ(got.result.size(), 3u);
  EXPECT_EQ(&got.result[0], first);
}

TEST(RpcCalls, AnAnswerToNobodyIsLeftOut) {
  RpcCalls calls;
  Ends ends;
  const auto call = calls.Begin("server.info", nullptr, ends.Note());
  for (const json& id : {json(call.id + 1), json(), json("1"), json(0.5), json::object()}) {
    calls.TakeAnswer({{"id", id}, {"result", "ok"}}, 0);
  }
  calls.TakeAnswer({{"result", "ok"}}, 0);
  EXPECT_TRUE(ends.answers.empty());
  calls.TakeAnswer({{"id", call.id}, {"error", 7}}, 0);
  ASSERT_EQ(ends.answers.size(), 1u);
  EXPECT_EQ(ends.answers[0].kind, Kind::kError);
}

TEST(RpcCalls, EveryCallEndsWithItsLinkAndNoneTwice) {
  RpcCalls calls;
  Ends ends;
  const auto unsent = calls.Begin("a", nullptr, ends.Note());
  calls.NotSent(unsent.id, "there is no link");
  calls.NotSent(unsent.id, "there is no link");
  // What one call's end begins anew waits for the next link.
  (void)calls.Begin("b", nullptr, [&](const RpcAnswer& answer) {
    ends.answers.push_back(answer);
    (void)calls.Begin("c", nullptr, ends.Note());
  });
  calls.Lose("the cable was pulled");
  ASSERT_EQ(ends.answers.size(), 2u);
  EXPECT_EQ(ends.answers[0].kind, Kind::kNotSent);
  EXPECT_EQ(ends.answers[1].kind, Kind::kLost);
  EXPECT_EQ(ends.answers[1].message, "the cable was pulled");
  calls.Lose("once more");
  EXPECT_EQ(ends.answers.size(), 3u);
}

}  // namespace
}  // namespace trammel::machine
