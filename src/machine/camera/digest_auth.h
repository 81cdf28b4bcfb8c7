// HTTP's Digest authentication (RFC 7616), in which the password is not transmitted.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace trammel::machine {

/// Server's challenge with a supported algorithm.
struct DigestChallenge {
  std::string realm;
  std::string nonce;
  std::string opaque;
  std::string algorithm;  ///< as received: MD5, SHA-256, each also with -sess; may be ""
  bool sha256 = false;
  bool session = false;  ///< -sess
  bool qop_auth = false;
};

/// True if a field WWW-Authenticate contains a challenge of this scheme.
[[nodiscard]] bool AsksFor(std::string_view scheme, std::string_view www_authenticate);

/// Returns the strongest supported Digest challenge in a WWW-Authenticate field: SHA-256 or MD5,
/// without integrity protection. Absent: there is none.
[[nodiscard]] std::optional<DigestChallenge> ParseDigest(std::string_view www_authenticate);

/// Returns the value of the field Authorization for a GET.
/// @param target  of the request   @param client_nonce  never used before
[[nodiscard]] std::string DigestAnswer(const DigestChallenge& challenge, const std::string& user,
                                       const std::string& password, const std::string& target,
                                       const std::string& client_nonce);

}  // namespace trammel::machine
