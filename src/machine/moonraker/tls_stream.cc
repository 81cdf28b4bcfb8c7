#include "machine/moonraker/tls_stream.h"

#include <fmt/format.h>
#include <openssl/x509_vfy.h>

#include <boost/asio/ip/address.hpp>

namespace trammel::machine {

namespace ssl = boost::asio::ssl;

Result<ssl::context> MakeTlsContext(const MoonrakerOptions& options) {
  ssl::context context(ssl::context::tls_client);
  boost::system::error_code error;
  context.set_options(ssl::context::default_workarounds | ssl::context::no_tlsv1 |
                      ssl::context::no_tlsv1_1);
  if (options.accept_any_certificate) {
    context.set_verify_mode(ssl::verify_none, error);
    return context;
  }
  context.set_verify_mode(ssl::verify_peer, error);
  if (options.ca_file.empty()) {
    context.set_default_verify_paths(error);
  } else {
    context.load_verify_file(options.ca_file, error);
  }
  if (error) {
    return Fail(fmt::format(
        "cannot read the certificates in '{}': {}; it must be a PEM file with the "
        "authority's or the printer's own certificate",
        options.ca_file.empty() ? "the system's store" : options.ca_file, error.message()));
  }
  return context;
}

Result<void> ExpectHost(SSL* ssl, const MoonrakerAddress& address,
                        const MoonrakerOptions& options) {
  boost::system::error_code not_an_ip;
  boost::asio::ip::make_address(address.host, not_an_ip);
  bool done = true;
  if (not_an_ip) {
    done = SSL_set_tlsext_host_name(ssl, address.host.c_str()) == 1;
  }
  if (done && !options.accept_any_certificate) {
    done = not_an_ip
               ? SSL_set1_host(ssl, address.host.c_str()) == 1
               : X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), address.host.c_str()) == 1;
  }
  if (!done) {
    return Fail(fmt::format("'{}' cannot be the name in a certificate", address.host));
  }
  return {};
}

std::string TlsFailure(SSL* ssl, const MoonrakerAddress& address, const std::string& what) {
  if (const long verdict = SSL_get_verify_result(ssl); verdict != X509_V_OK) {
    return fmt::format(
        "{} does not prove who it is: {}; give its certificate or its authority's as the CA file, "
        "use the name that is in the certificate, or (only in a network that you trust) accept any "
        "certificate",
        address.Authority(), X509_verify_cert_error_string(verdict));
  }
  return fmt::format(
      "cannot set up TLS with {}: {}; if the server speaks plain HTTP there, use http:// or ws:// "
      "(Moonraker itself listens without TLS on port 7125)",
      address.Authority(), what);
}

}  // namespace trammel::machine
