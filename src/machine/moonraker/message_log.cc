#include "machine/moonraker/message_log.h"

#include <algorithm>

namespace trammel::machine {
namespace {

constexpr std::size_t kMaxCharacters = 300;

/// Replaces the text values of members called `name` by dots.
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

/// One line of printable text that ends at a whole UTF-8 character.
std::string Readable(std::string_view message) {
  std::string text(message.substr(0, kMaxCharacters));
  if (text.size() < message.size()) {
    while (!text.empty() && (static_cast<unsigned char>(text.back()) & 0xC0) == 0x80) {
      text.pop_back();
    }
    if (!text.empty() && static_cast<unsigned char>(text.back()) >= 0xC0) {
      text.pop_back();
    }
    text += " …";
  }
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return text;
}

}  // namespace

void MessageLog::Add(MessageDirection direction, std::string_view message) {
  // Secrets stand early in short messages of ours; long ones are cut before they are searched.
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
  if (messages_.size() > capacity_) {
    messages_.pop_front();
  }
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
  for (auto it = chosen.rbegin(); it != chosen.rend(); ++it) {
    text += "\n    " + **it;
  }
  return text;
}

}  // namespace trammel::machine
