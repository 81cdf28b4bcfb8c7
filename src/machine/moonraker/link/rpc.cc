#include "machine/moonraker/link/rpc.h"

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
  constexpr std::size_t kMaxQuoted = 80;  // characters of an external name
  return Refused(kUnknownMethod,
                 "trammel has no method '" + Utf8OrReplaced(method, kMaxQuoted) + "'");
}

RpcCalls::Message RpcCalls::Begin(const std::string& method, json params, Done done) {
  json message = {{"jsonrpc", "2.0"}, {"method", method}};
  if (!params.is_null()) message["params"] = std::move(params);
  std::int64_t id = 0;
  {
    const std::lock_guard lock(mutex_);
    id = next_id_++;
    waiting_.emplace(id, std::move(done));
  }
  message["id"] = id;
  // Scripts also come from files: a byte that is not UTF-8 becomes a replacement character.
  return {id, message.dump(-1, ' ', false, json::error_handler_t::replace)};
}

RpcCalls::Done RpcCalls::Take(std::int64_t id) {
  const std::lock_guard lock(mutex_);
  auto taken = waiting_.extract(id);
  return taken ? std::move(taken.mapped()) : Done();
}

void RpcCalls::TakeAnswer(json message, double received_s) {
  const auto id = message.find("id");
  if (id == message.end() || !id->is_number_integer()) return;
  const Done done = Take(id->get<std::int64_t>());
  if (!done) return;
  RpcAnswer answer;
  answer.received_s = received_s;
  if (const auto result = message.find("result"); result != message.end()) {
    answer.result = std::move(*result);
  } else {
    const json& words = ObjectOr(message, "error");
    answer.kind = RpcAnswer::Kind::kError;
    answer.code = static_cast<int>(std::clamp(NumberOr(words, "code", 0), -1e6, 1e6));
    answer.message = TextOr(words, "message", "an answer with neither a result nor an error");
    // Agent's own error, of server.extensions.request.
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

namespace {

constexpr std::size_t kMaxCharacters = 300;

/// Replaces the text values of members with this name by dots.
void BlotOut(std::string& message, std::string_view name) {
  const std::string key = '"' + std::string(name) + '"';
  for (std::size_t at = message.find(key); at != std::string::npos; at = message.find(key, at)) {
    at += key.size();
    std::size_t begin = message.find_first_not_of(" \t:", at);
    if (begin == std::string::npos || message[begin] != '"') continue;
    std::size_t end = ++begin;
    while (end < message.size() && message[end] != '"') end += message[end] == '\\' ? 2 : 1;
    message.replace(begin, std::min(end, message.size()) - begin, "…");
  }
}

/// Returns one line of printable text that ends at a whole UTF-8 character.
std::string Readable(std::string_view message) {
  std::string text(message.substr(0, kMaxCharacters));
  if (text.size() < message.size()) {
    while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xC0) == 0x80) {
      text.pop_back();
    }
    if (!text.empty() && static_cast<unsigned char>(text.back()) >= 0xC0) text.pop_back();
    text += " …";
  }
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return text;
}

}  // namespace

void MessageLog::Add(MessageDirection direction, std::string_view message) {
  // Secrets are near the beginning of our short messages; long ones are cut before the search.
  std::string text(message.substr(0, 4 * kMaxCharacters));
  // A text as a result is a key or a token: access.get_api_key, access.oneshot_token.
  const bool plain_answer = text.find("\"result\":\"ok\"") != std::string::npos;
  if (!plain_answer) BlotOut(text, "result");
  for (const char* secret : {"api_key", "access_token", "refresh_token", "token", "password",
                             "stream_url", "snapshot_url"}) {
    BlotOut(text, secret);
  }
  text = (direction == MessageDirection::kOut ? "> " : "< ") + Readable(text);
  const std::lock_guard lock(mutex_);
  messages_.push_back(std::move(text));
  if (messages_.size() > capacity_) messages_.pop_front();
}

std::vector<std::string> MessageLog::All() const {
  const std::lock_guard lock(mutex_);
  return {messages_.begin(), messages_.end()};
}

std::string MessageLog::Excerpt(std::size_t count) const {
  const std::lock_guard lock(mutex_);
  std::vector<const std::string*> chosen;
  for (auto it = messages_.rbegin(); it != messages_.rend() && chosen.size() < count; ++it) {
    if (it->find("notify_status_update") == std::string::npos &&
        it->find("notify_proc_stat_update") == std::string::npos) {
      chosen.push_back(&*it);
    }
  }
  std::string text;
  for (auto it = chosen.rbegin(); it != chosen.rend(); ++it) text += "\n    " + **it;
  return text;
}

}  // namespace trammel::machine
