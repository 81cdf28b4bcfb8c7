#include "machine/moonraker/rpc_calls.h"

#include <algorithm>
#include <utility>

#include "base/utf8.h"
#include "machine/net/host_clock.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

RpcAnswer RpcAnswer::Failed(Kind kind, std::string why) {
  RpcAnswer answer;
  answer.kind = kind;
  answer.message = std::move(why);
  answer.received_s = HostNow();
  return answer;
}

RpcAnswer RpcAnswer::Refused(int code, std::string message) {
  RpcAnswer answer = Failed(Kind::kError, std::move(message));
  answer.code = code;
  return answer;
}

RpcAnswer RpcAnswer::UnknownMethod(const std::string& method) {
  constexpr std::size_t kMostQuoted = 80;  // of a name that came from outside
  return Refused(kUnknownMethod,
                 "trammel has no method '" + Utf8OrReplaced(method, kMostQuoted) + "'");
}

RpcCalls::Message RpcCalls::Begin(const std::string& method, json params, Done done) {
  json message = {{"jsonrpc", "2.0"}, {"method", method}};
  if (!params.is_null()) {
    message["params"] = std::move(params);
  }
  std::int64_t id = 0;
  {
    const std::lock_guard lock(mutex_);
    id = next_id_++;
    waiting_.emplace(id, std::move(done));
  }
  message["id"] = id;
  // Scripts come from files too: a byte that is not UTF-8 becomes a replacement character.
  return {id, message.dump(-1, ' ', false, json::error_handler_t::replace)};
}

RpcCalls::Done RpcCalls::Take(std::int64_t id) {
  const std::lock_guard lock(mutex_);
  auto taken = waiting_.extract(id);
  return taken ? std::move(taken.mapped()) : Done();
}

void RpcCalls::TakeAnswer(json message, double received_s) {
  const auto id = message.find("id");
  if (id == message.end() || !id->is_number_integer()) {
    return;
  }
  const Done done = Take(id->get<std::int64_t>());
  if (!done) {
    return;
  }
  RpcAnswer answer;
  answer.received_s = received_s;
  if (const auto result = message.find("result"); result != message.end()) {
    answer.result = std::move(*result);
  } else {
    const json& words = ObjectOr(message, "error");
    answer.kind = RpcAnswer::Kind::kError;
    answer.code = static_cast<int>(std::clamp(NumberOr(words, "code", 0), -1e6, 1e6));
    answer.message = TextOr(words, "message", "an answer with neither a result nor an error");
    // An agent's own error, of server.extensions.request.
    const std::string own = TextOr(ObjectOr(words, "data"), "message", "");
    if (!own.empty()) answer.message += ": " + own;
  }
  done(std::move(answer));
}

void RpcCalls::NotSent(std::int64_t id, const std::string& why) {
  if (const Done done = Take(id)) {
    done(RpcAnswer::Failed(RpcAnswer::Kind::kNotSent, why));
  }
}

void RpcCalls::Lose(const std::string& why) {
  std::map<std::int64_t, Done> lost;
  {
    const std::lock_guard lock(mutex_);
    lost.swap(waiting_);
  }
  for (const auto& [id, done] : lost) {
    done(RpcAnswer::Failed(RpcAnswer::Kind::kLost, why));
  }
}

}  // namespace trammel::machine
