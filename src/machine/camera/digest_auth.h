// HTTP's Digest authentication (RFC 7616), by which cameras ask for a password unsent.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace trammel::machine {

/// A challenge of a server that can be answered.
struct DigestChallenge {
  std::string realm;
  std::string nonce;
  std::string opaque;
  std::string algorithm;  ///< as the server wrote it: MD5, SHA-256, each also with -sess; may be ""
  bool sha256 = false;
  bool session = false;  ///< -sess
  bool qop_auth = false;
};

/// Whether a field WWW-Authenticate holds a challenge of this scheme.
[[nodiscard]] bool AsksFor(std::string_view scheme, std::string_view www_authenticate);

/// The strongest Digest challenge in a field WWW-Authenticate that is answered here: SHA-256 or
/// MD5, without integrity protection. Absent: there is none.
[[nodiscard]] std::optional<DigestChallenge> ParseDigest(std::string_view www_authenticate);

/// The value of the field Authorization for a GET.
/// @param target  of the request   @param client_nonce  never used before
[[nodiscard]] std::string DigestAnswer(const DigestChallenge& challenge, const std::string& user,
                                       const std::string& password, const std::string& target,
                                       const std::string& client_nonce);

}  // namespace trammel::machine
