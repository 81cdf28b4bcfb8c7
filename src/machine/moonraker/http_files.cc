#include "machine/moonraker/http_files.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <chrono>
#include <memory>
#include <optional>

#include "base/check.h"
#include "machine/moonraker/net_failure.h"
#include "machine/moonraker/net_stream.h"
#include "machine/moonraker/tls_stream.h"

namespace trammel::machine {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMaxAnswer = std::size_t{1} << 20;  // to an upload

std::string Sha256(std::string_view data) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned length = 0;
  const int done =
      EVP_Digest(data.data(), data.size(), digest.data(), &length, EVP_sha256(), nullptr);
  TRAMMEL_CHECK(done == 1, "SHA-256 of {} bytes failed", data.size());
  std::string text;
  for (unsigned i = 0; i < length; ++i) {
    text += fmt::format("{:02x}", digest[i]);
  }
  return text;
}

/// A boundary that the file does not contain: its own checksum.
std::string MultipartBody(const std::string& boundary, std::string_view root,
                          const std::string& name, std::string_view data,
                          const std::string& checksum) {
  const std::size_t slash = name.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : name.substr(0, slash);
  const std::string file = slash == std::string::npos ? name : name.substr(slash + 1);
  std::string body;
  const auto field = [&](std::string_view key, std::string_view value) {
    body += fmt::format("--{}\r\nContent-Disposition: form-data; name=\"{}\"\r\n\r\n{}\r\n",
                        boundary, key, value);
  };
  field("root", root);
  if (!folder.empty()) {
    field("path", folder);
  }
  field("checksum", checksum);
  body += fmt::format(
      "--{}\r\nContent-Disposition: form-data; name=\"file\"; filename=\"{}\"\r\n"
      "Content-Type: application/octet-stream\r\n\r\n",
      boundary, file);
  body += data;
  body += fmt::format("\r\n--{}--\r\n", boundary);
  return body;
}

/// One request and its answer over a stream; `Finish` ends the io_context's run.
class Exchange : public std::enable_shared_from_this<Exchange> {
 public:
  /// @param most_bytes  of the answer   @param tls  null: plain
  Exchange(asio::io_context& io, const MoonrakerAddress& address, const MoonrakerOptions& options,
           http::request<http::string_body> request, std::size_t most_bytes, double time_limit_s,
           asio::ssl::context* tls)
      : address_(address),
        options_(options),
        request_(std::move(request)),
        time_limit_s_(time_limit_s),
        resolver_(io),
        stream_(io, tls) {
    parser_.body_limit(most_bytes);
  }

  void Start() {
    beast::get_lowest_layer(stream_).expires_after(
        std::chrono::duration_cast<std::chrono::steady_clock::duration>(
            std::chrono::duration<double>(time_limit_s_)));
    resolver_.async_resolve(
        address_.host, address_.port,
        [self = shared_from_this()](error_code error, const tcp::resolver::results_type& found) {
          if (self->Failed(NetStep::kLookUp, error)) {
            return;
          }
          beast::get_lowest_layer(self->stream_)
              .async_connect(found, [self](error_code connect_error, const tcp::endpoint&) {
                if (!self->Failed(NetStep::kConnect, connect_error)) {
                  self->Secure();
                }
              });
        });
  }

  Result<HttpAnswer> Take() {
    if (failure_) {
      return tl::unexpected(*failure_);
    }
    if (!parser_.is_done()) {
      return Fail(fmt::format("no answer to the {} from {} within {} s; the network or the "
                              "printer's disk is slow",
                              request_.method() == http::verb::get ? "download" : "upload",
                              address_.Authority(), time_limit_s_),
                  ErrorKind::kMachine);
    }
    const auto server = parser_.get()[http::field::server];
    return HttpAnswer{static_cast<int>(parser_.get().result_int()),
                      {server.data(), server.size()},
                      parser_.get().body()};
  }

 private:
  bool Failed(NetStep step, error_code error) {
    if (error == http::error::body_limit) {
      failure_ = Error{ErrorKind::kInput, fmt::format("{} sends more than is read of an answer",
                                                      address_.Authority())};
      beast::get_lowest_layer(stream_).close();
    } else if (error) {
      failure_ = Error{ErrorKind::kMachine, NetFailure(step, error, address_, time_limit_s_)};
      beast::get_lowest_layer(stream_).close();
    }
    return static_cast<bool>(error);
  }

  void Secure() {
    SSL* const ssl = stream_.tls();
    if (ssl == nullptr) return Send();
    if (const Result<void> expected = ExpectHost(ssl, address_, options_); !expected) {
      failure_ = expected.error();
      return;
    }
    stream_.AsyncHandshake([self = shared_from_this(), ssl](error_code error) {
      if (error) {
        self->failure_ =
            Error{ErrorKind::kMachine, TlsFailure(ssl, self->address_, error.message())};
        return;
      }
      self->Send();
    });
  }

  void Send() {
    // A server that refuses a request answers without reading all of it: the answer counts even
    // where the rest could not be written.
    http::async_write(stream_, request_,
                      [self = shared_from_this()](error_code write_error, std::size_t) {
                        http::async_read(self->stream_, self->buffer_, self->parser_,
                                         [self, write_error](error_code error, std::size_t) {
                                           self->Failed(NetStep::kTalk,
                                                        error && write_error ? write_error : error);
                                         });
                      });
  }

  const MoonrakerAddress& address_;
  const MoonrakerOptions& options_;
  http::request<http::string_body> request_;
  const double time_limit_s_;
  tcp::resolver resolver_;
  NetStream stream_;
  beast::flat_buffer buffer_;
  http::response_parser<http::string_body> parser_;
  std::optional<Error> failure_;
};

Result<HttpAnswer> Perform(const MoonrakerAddress& address, const MoonrakerOptions& options,
                           http::request<http::string_body> request, std::size_t most_bytes,
                           const WaitLimit& limit, asio::ssl::context* tls) {
  asio::io_context io;
  const bool gets = request.method() == http::verb::get;
  const auto exchange = std::make_shared<Exchange>(io, address, options, std::move(request),
                                                   most_bytes, limit.time_limit_s, tls);
  const std::stop_callback on_stop(limit.stop, [&io] { io.stop(); });
  exchange->Start();
  io.run_for(std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(limit.time_limit_s)));
  if (limit.stop.stop_requested()) {
    return Fail(fmt::format("stopped while {} {}", gets ? "downloading from" : "uploading to",
                            address.HttpUrl()),
                ErrorKind::kInterrupted);
  }
  return exchange->Take();
}

http::request<http::string_body> RequestTo(const MoonrakerAddress& address,
                                           const MoonrakerOptions& options, http::verb verb,
                                           const std::string& path) {
  http::request<http::string_body> request(verb, address.path_prefix + path, 11);
  request.set(http::field::host, address.Authority());
  request.set(http::field::user_agent, options.client_name);
  request.set(http::field::connection, "close");
  if (!options.api_key.empty()) request.set("X-Api-Key", options.api_key);
  return request;
}

Result<HttpAnswer> Send(const MoonrakerAddress& address, const MoonrakerOptions& options,
                        http::request<http::string_body> request, std::size_t most_bytes,
                        const WaitLimit& limit) {
  if (address.transport != Transport::kTls) {
    return Perform(address, options, std::move(request), most_bytes, limit, nullptr);
  }
  asio::ssl::context context = TRY(MakeTlsContext(options));
  return Perform(address, options, std::move(request), most_bytes, limit, &context);
}

/// A path in which every byte but letters, digits and -._~/ is escaped.
std::string Escaped(std::string_view path) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  std::string text;
  for (const char c : path) {
    if (kPlain.find(c) != std::string_view::npos) {
      text += c;
    } else {
      text += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return text;
}

}  // namespace

Result<HttpAnswer> PostFile(const MoonrakerAddress& address, const MoonrakerOptions& options,
                            std::string_view root, const std::string& name, std::string_view data,
                            const WaitLimit& limit) {
  TRAMMEL_CHECK(address.transport != Transport::kUnix, "upload to {}", address.unix_path);
  const std::string checksum = Sha256(data);
  const std::string boundary = "trammel-" + checksum.substr(0, 32);
  auto request = RequestTo(address, options, http::verb::post, "/server/files/upload");
  request.set(http::field::content_type, "multipart/form-data; boundary=" + boundary);
  request.body() = MultipartBody(boundary, root, name, data, checksum);
  request.prepare_payload();
  return Send(address, options, std::move(request), kMaxAnswer, limit);
}

Result<HttpAnswer> GetFile(const MoonrakerAddress& address, const MoonrakerOptions& options,
                           std::string_view root, const std::string& name, std::size_t most_bytes,
                           const WaitLimit& limit) {
  TRAMMEL_CHECK(address.transport != Transport::kUnix, "download from {}", address.unix_path);
  const std::string path = fmt::format("/server/files/{}/{}", root, Escaped(name));
  return Send(address, options, RequestTo(address, options, http::verb::get, path), most_bytes,
              limit);
}

}  // namespace trammel::machine
