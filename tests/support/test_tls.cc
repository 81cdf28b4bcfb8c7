#include "support/test_tls.h"

#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>
#include <functional>
#include <memory>
#include <utility>

namespace trammel::test {
namespace {

template <class Write>
std::string ToPem(Write write) {
  const std::unique_ptr<BIO, decltype(&BIO_free_all)> memory(BIO_new(BIO_s_mem()), BIO_free_all);
  write(memory.get());
  char* data = nullptr;
  const long length = BIO_get_mem_data(memory.get(), &data);
  return {data, static_cast<std::size_t>(length)};
}

}  // namespace

Certificate MakeCertificate(const std::string& names) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), X509_free);
  X509_set_version(certificate.get(), 2);
  ASN1_INTEGER_set(X509_get_serialNumber(certificate.get()), 1);
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), -3600);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), 86400);
  X509_set_pubkey(certificate.get(), key.get());
  X509_NAME* const name = X509_get_subject_name(certificate.get());
  const auto* common = reinterpret_cast<const unsigned char*>("trammel test");
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, common, -1, -1, 0);
  X509_set_issuer_name(certificate.get(), name);
  const std::unique_ptr<X509_EXTENSION, decltype(&X509_EXTENSION_free)> extension(
      X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, names.c_str()),
      X509_EXTENSION_free);
  X509_add_ext(certificate.get(), extension.get(), -1);
  X509_sign(certificate.get(), key.get(), EVP_sha256());
  return {ToPem([&](BIO* bio) { PEM_write_bio_X509(bio, certificate.get()); }),
          ToPem([&](BIO* bio) {
            PEM_write_bio_PrivateKey(bio, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
          })};
}

namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

tcp::endpoint Loopback(std::uint16_t port) { return {asio::ip::address_v4::loopback(), port}; }

/// A client and its connection to the server.
class Relayed : public std::enable_shared_from_this<Relayed> {
 public:
  Relayed(asio::io_context& io, asio::ssl::context& context, tcp::socket client)
      : client_(std::move(client), context), server_(io) {}

  void Start(std::uint16_t to_port) {
    const auto connected = [self = shared_from_this()](error_code error) {
      if (error) return self->End();
      self->server_.set_option(tcp::no_delay(true));
      self->Pump(self->client_, self->server_, self->to_server_);
      self->Pump(self->server_, self->client_, self->to_client_);
    };
    client_.async_handshake(asio::ssl::stream_base::server,
                            [self = shared_from_this(), to_port, connected](error_code error) {
                              if (error) return self->End();
                              self->server_.async_connect(Loopback(to_port), connected);
                            });
  }

 private:
  using Bytes = std::array<char, 16384>;
  using Then = std::function<void(error_code, std::size_t)>;

  template <class From, class To>
  void Pump(From& from, To& to, Bytes& bytes) {
    from.async_read_some(
        asio::buffer(bytes),
        Then([self = shared_from_this(), &from, &to, &bytes](error_code error, std::size_t count) {
          if (error) return self->End();
          asio::async_write(to, asio::buffer(bytes.data(), count),
                            Then([self, &from, &to, &bytes](error_code failed, std::size_t) {
                              if (failed) return self->End();
                              self->Pump(from, to, bytes);
                            }));
        }));
  }

  void End() {
    error_code ignored;
    client_.next_layer().close(ignored);
    server_.close(ignored);
  }

  asio::ssl::stream<tcp::socket> client_;
  tcp::socket server_;
  Bytes to_server_;
  Bytes to_client_;
};

}  // namespace

TlsRelay::TlsRelay(asio::io_context& io, const std::string& certificate_pem,
                   const std::string& key_pem, std::uint16_t to_port)
    : io_(io),
      context_(asio::ssl::context::tls_server),
      acceptor_(io, Loopback(0)),
      to_port_(to_port) {
  context_.use_certificate(asio::buffer(certificate_pem), asio::ssl::context::pem);
  context_.use_private_key(asio::buffer(key_pem), asio::ssl::context::pem);
  Accept();
}

void TlsRelay::Accept() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (error) return;
    socket.set_option(tcp::no_delay(true));
    std::make_shared<Relayed>(io_, context_, std::move(socket))->Start(to_port_);
    Accept();
  });
}

}  // namespace trammel::test
