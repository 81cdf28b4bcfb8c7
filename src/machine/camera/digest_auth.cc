#include "machine/camera/digest_auth.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/text.h"

namespace trammel::machine {
namespace {

constexpr std::string_view kBetween = ", \t=";  // words of a field

/// "Digest" and what belongs to it: names in small letters, values without their quotation marks.
struct Challenge {
  std::string scheme;  ///< lower case
  std::vector<std::pair<std::string, std::string>> parameters;

  [[nodiscard]] std::string Value(std::string_view name) const {
    for (const auto& [key, value] : parameters) {
      if (key == name) return value;
    }
    return {};
  }
};

bool IsBlank(char c) { return c == ' ' || c == '\t'; }

class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  [[nodiscard]] bool done() const { return at_ == text_.size(); }
  void Skip(std::string_view of) {
    while (!done() && of.find(text_[at_]) != std::string_view::npos) ++at_;
  }
  std::string Word() {
    const std::size_t begin = at_;
    while (!done() && !IsBlank(text_[at_]) && text_[at_] != ',' && text_[at_] != '=') ++at_;
    return std::string(text_.substr(begin, at_ - begin));
  }
  /// Parses "=" with blanks around it.
  bool TakeEquals() {
    std::size_t next = at_;
    while (next < text_.size() && IsBlank(text_[next])) ++next;
    if (next == text_.size() || text_[next] != '=') return false;
    at_ = next + 1;
    Skip(" \t");
    return true;
  }
  std::string Value() {
    if (done() || text_[at_] != '"') return Word();
    std::string value;
    for (++at_; !done() && text_[at_] != '"'; ++at_) {
      if (text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;
      value += text_[at_];
    }
    if (!done()) ++at_;
    return value;
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
};

// Splits challenges: a word without "=" after it begins one, others are parameters of the one
// before.
std::vector<Challenge> Challenges(std::string_view field) {
  std::vector<Challenge> challenges;
  Scanner scanner(field);
  for (scanner.Skip(kBetween); !scanner.done(); scanner.Skip(kBetween)) {
    std::string word = LowerCase(scanner.Word());
    if (!scanner.TakeEquals()) {
      challenges.push_back({std::move(word), {}});
    } else if (std::string value = scanner.Value(); !challenges.empty()) {
      challenges.back().parameters.emplace_back(std::move(word), std::move(value));
    }
  }
  return challenges;
}

std::string Hash(const DigestChallenge& challenge, const std::string& text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned length = 0;
  const int done = EVP_Digest(text.data(), text.size(), digest.data(), &length,
                              challenge.sha256 ? EVP_sha256() : EVP_md5(), nullptr);
  TRAMMEL_CHECK(done == 1, "the checksum of {} bytes failed", text.size());
  std::string hex;
  for (unsigned i = 0; i < length; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

/// Quotes a text; drops characters that would end the line.
std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '\r' || c == '\n') continue;
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

std::optional<DigestChallenge> Answerable(const Challenge& challenge) {
  if (challenge.scheme != "digest") return std::nullopt;
  DigestChallenge digest{challenge.Value("realm"), challenge.Value("nonce"),
                         challenge.Value("opaque"), challenge.Value("algorithm")};
  std::string algorithm = LowerCase(digest.algorithm);
  constexpr std::string_view kSession = "-sess";
  digest.session = algorithm.ends_with(kSession);
  if (digest.session) algorithm.resize(algorithm.size() - kSession.size());
  digest.sha256 = algorithm == "sha-256";
  const bool known = digest.sha256 || algorithm == "md5" || digest.algorithm.empty();
  const std::string qop = challenge.Value("qop");
  Scanner scanner(qop);
  for (scanner.Skip(kBetween); !scanner.done(); scanner.Skip(kBetween)) {
    const std::string protection = LowerCase(scanner.Word());
    digest.qop_auth = digest.qop_auth || protection == "auth";
  }
  if (!known || digest.nonce.empty() || (!qop.empty() && !digest.qop_auth)) return std::nullopt;
  return digest;
}

}  // namespace

bool AsksFor(std::string_view scheme, std::string_view www_authenticate) {
  const auto challenges = Challenges(www_authenticate);
  return std::any_of(challenges.begin(), challenges.end(), [&](const Challenge& challenge) {
    return challenge.scheme == LowerCase(scheme);
  });
}

std::optional<DigestChallenge> ParseDigest(std::string_view www_authenticate) {
  std::optional<DigestChallenge> best;
  for (const Challenge& challenge : Challenges(www_authenticate)) {
    auto digest = Answerable(challenge);
    if (digest && (!best || (digest->sha256 && !best->sha256))) best = std::move(digest);
  }
  return best;
}

std::string DigestAnswer(const DigestChallenge& challenge, const std::string& user,
                         const std::string& password, const std::string& target,
                         const std::string& client_nonce) {
  constexpr const char* kFirst = "00000001";  // each challenge is answered once
  std::string secret = Hash(challenge, user + ":" + challenge.realm + ":" + password);
  if (challenge.session) {
    secret = Hash(challenge, secret + ":" + challenge.nonce + ":" + client_nonce);
  }
  const std::string request = Hash(challenge, "GET:" + target);
  const std::string middle =
      challenge.qop_auth ? fmt::format("{}:{}:{}:auth", challenge.nonce, kFirst, client_nonce)
                         : challenge.nonce;
  std::string answer =
      fmt::format("Digest username={}, realm={}, nonce={}, uri={}, response=\"{}\"", Quoted(user),
                  Quoted(challenge.realm), Quoted(challenge.nonce), Quoted(target),
                  Hash(challenge, secret + ":" + middle + ":" + request));
  if (!challenge.algorithm.empty()) {
    answer += fmt::format(", algorithm={}{}", challenge.sha256 ? "SHA-256" : "MD5",
                          challenge.session ? "-sess" : "");
  }
  if (challenge.qop_auth || challenge.session) {
    answer += fmt::format(", cnonce={}", Quoted(client_nonce));
  }
  if (challenge.qop_auth) answer += fmt::format(", qop=auth, nc={}", kFirst);
  if (!challenge.opaque.empty()) answer += ", opaque=" + Quoted(challenge.opaque);
  return answer;
}

}  // namespace trammel::machine
