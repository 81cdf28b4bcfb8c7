// Certificates that tests make for themselves, and TLS in front of a server that speaks none.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <cstdint>
#include <string>

namespace trammel::test {

struct Certificate {
  std::string certificate_pem;
  std::string key_pem;
};

/// A self-signed certificate, valid for a day.
/// @param names  subject alternative names in OpenSSL's form: "IP:127.0.0.1" or "DNS:voron.local"
[[nodiscard]] Certificate MakeCertificate(const std::string& names);

/// Accepts TLS on a free port of the loopback and hands each connection's bytes on, both ways.
/// A client that fails the handshake is dropped; where one side ends, so does the other.
class TlsRelay {
 public:
  /// @param io       runs what the relay does; outlives it
  /// @param to_port  of the loopback
  TlsRelay(boost::asio::io_context& io, const std::string& certificate_pem,
           const std::string& key_pem, std::uint16_t to_port);

  [[nodiscard]] std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

 private:
  void Accept();

  boost::asio::io_context& io_;
  boost::asio::ssl::context context_;
  boost::asio::ip::tcp::acceptor acceptor_;
  std::uint16_t to_port_;
};

}  // namespace trammel::test
