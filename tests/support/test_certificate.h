// Certificates that tests make for themselves.
#pragma once

#include <string>

namespace trammel::test {

struct Certificate {
  std::string certificate_pem;
  std::string key_pem;
};

/// A self-signed certificate, valid for a day.
/// @param names  subject alternative names in OpenSSL's form: "IP:127.0.0.1" or "DNS:voron.local"
[[nodiscard]] Certificate MakeCertificate(const std::string& names);

}  // namespace trammel::test
