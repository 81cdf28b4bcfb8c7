// File methods of MoonrakerPrinter: uploads and downloads, only possible over HTTP, and prints.
#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>

#include "base/bounded_json.h"
#include "base/check.h"
#include "base/result.h"
#include "machine/moonraker/client/moonraker_printer.h"
#include "machine/moonraker/link/address.h"
#include "machine/net/host_clock.h"
#include "machine/net/http_client.h"
#include "machine/net/json_field.h"
#include "machine/net/wait.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

/// Answer of the server to a request.
struct FileAnswer {
  int status = 0;      ///< HTTP; 201: stored, 200: here it is
  std::string server;  ///< Server header
  std::string body;
};

std::string Sha256(std::string_view data) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned length = 0;
  const int done =
      EVP_Digest(data.data(), data.size(), digest.data(), &length, EVP_sha256(), nullptr);
  TRAMMEL_CHECK(done == 1, "SHA-256 of {} bytes failed", data.size());
  std::string text;
  for (unsigned i = 0; i < length; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

/// Returns the body; the boundary, which the file must not contain, is its own checksum.
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
  if (!folder.empty()) field("path", folder);
  field("checksum", checksum);
  body += fmt::format(
      "--{}\r\nContent-Disposition: form-data; name=\"file\"; filename=\"{}\"\r\n"
      "Content-Type: application/octet-stream\r\n\r\n",
      boundary, file);
  body += data;
  body += fmt::format("\r\n--{}--\r\n", boundary);
  return body;
}

/// Sends a request to /server/files of an address that is no Unix socket's.
/// Errors: kMachine: no answer; kInput: too large; kInterrupted.
/// @param more  header lines
Result<FileAnswer> Send(const char* verb, const std::string& path, const std::string& more,
                        std::string_view body, const MoonrakerAddress& address,
                        const MoonrakerOptions& options, std::size_t max_bytes,
                        const WaitLimit& limit) {
  const double deadline_s = HostNow() + limit.time_limit_s;
  std::string request = fmt::format(
      "{} {}/server/files/{} HTTP/1.1\r\nHost: {}\r\nUser-Agent: {}\r\n"
      "Connection: close\r\n{}",
      verb, address.path_prefix, path, address.Authority(), options.client_name, more);
  if (!options.api_key.empty()) request += fmt::format("X-Api-Key: {}\r\n", options.api_key);
  request += "\r\n";
  request += body;
  const auto about = [&](const Error& error) -> tl::unexpected<Error> {
    if (error.kind == ErrorKind::kInterrupted) {
      return Fail(fmt::format("stopped during the transfer to or from {}", address.HttpUrl()),
                  error.kind);
    }
    return Fail(fmt::format("{}: {}", address.HttpUrl(), error.message), error.kind);
  };
  Endpoint endpoint = EndpointOf(address, options);
  endpoint.time_limit_s = limit.time_limit_s;
  auto answer = SendHttp(endpoint, request, deadline_s, limit.stop);
  if (!answer) return about(answer.error());
  const auto server = answer->head.fields.find("server");
  FileAnswer told{answer->head.status, server == answer->head.fields.end() ? "" : server->second,
                  ""};
  auto read = ReadHttpBody(*std::move(answer), max_bytes, deadline_s, limit.stop);
  if (!read) return about(read.error());
  told.body = *std::move(read);
  return told;
}

/// Returns a path with all bytes escaped but letters, digits and -._~/.
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

/// Checks that a name remains within the printable files and needs no escaping in a form.
Result<void> CheckFileName(const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return c >= 0x20 && c != 0x7F && c != '"' && c != '\\';
  });
  if (name.empty() || name.size() > 200 || !plain || name.front() == '/' || name.back() == '/' ||
      name.find("..") != std::string::npos) {
    return Fail(
        fmt::format("'{}' cannot be the name of a file of the printer's: it must be relative, "
                    "without .. and quotes, and of 1 … 200 bytes",
                    name.substr(0, 200)));
  }
  return {};
}

}  // namespace

Result<void> MoonrakerPrinter::Upload(const std::string& name, std::string_view gcode,
                                      const WaitLimit& limit) {
  return Store("gcodes", name, gcode, limit);
}

Result<void> MoonrakerPrinter::UploadConfig(const std::string& name, std::string_view data,
                                            const WaitLimit& limit) {
  return Store("config", name, data, limit);
}

Result<MoonrakerPrinter::WebServer> MoonrakerPrinter::WebPlace(const WaitLimit& limit) {
  WebServer web{moonraker_.address(), options_};
  if (web.address.transport != Transport::kUnix) return web;
  MoonrakerAddress http = TRY(ParseMoonrakerAddress(options_.http_address));
  if (http.transport == Transport::kUnix) {
    return Fail("http_address is a Unix socket, which moves no files; give http://localhost:7125");
  }
  web.address = http;
  if (web.options.api_key.empty()) {
    // The socket is trusted and may return the key; without one the server must trust localhost.
    const Result<json> key = moonraker_.Call("access.get_api_key", nullptr, limit);
    if (key && key->is_string()) web.options.api_key = key->get<std::string>();
  }
  return web;
}

Result<std::string> MoonrakerPrinter::DownloadConfig(const std::string& name, std::size_t max_bytes,
                                                     const WaitLimit& limit) {
  TRY(CheckFileName(name));
  const auto web = TRY(WebPlace(limit));
  Result<FileAnswer> answer =
      Send("GET", "config/" + Escaped(name), "", "", web.address, web.options, max_bytes, limit);
  if (!answer && answer.error().kind == ErrorKind::kInput) {
    return Fail(
        fmt::format("{} has more than the {:.0f} MiB that are read of a file ({}): store a "
                    "smaller one",
                    name, std::ldexp(static_cast<double>(max_bytes), -20), answer.error().message));
  }
  if (!answer) {
    return Fail(fmt::format("cannot download {}: {}", name, answer.error().message),
                answer.error().kind);
  }
  if (answer->status == 200) return std::move(answer->body);
  const std::string tried = fmt::format("cannot download {}: ", name);
  if (answer->status == 404) {
    return Fail(tried +
                "there is no such file beside the printer's configuration: look at its name");
  }
  constexpr int kForbidden = 403;  // whom Moonraker does not let in gets a 401
  if (answer->status == kForbidden) {
    return Fail(tried +
                "the server hands it to nobody (HTTP 403): it is a folder, or a file that "
                "Moonraker may not read");
  }
  return Fail(tried + HttpRefusal(answer->status, answer->server, web.address,
                                  !web.options.api_key.empty()),
              ErrorKind::kMachine);
}

Result<void> MoonrakerPrinter::Store(std::string_view root, const std::string& name,
                                     std::string_view data, const WaitLimit& limit) {
  TRY(CheckFileName(name));
  const auto web = TRY(WebPlace(limit));
  const auto& [address, options] = web;
  const std::string checksum = Sha256(data);
  const std::string boundary = "trammel-" + checksum.substr(0, 32);
  const std::string form = MultipartBody(boundary, root, name, data, checksum);
  const std::string head =
      fmt::format("Content-Type: multipart/form-data; boundary={}\r\nContent-Length: {}\r\n",
                  boundary, form.size());
  constexpr std::size_t kMaxAnswer = std::size_t{1} << 20U;
  const auto answer = TRY(Send("POST", "upload", head, form, address, options, kMaxAnswer, limit));
  if (answer.status == 201 || answer.status == 200) return {};
  const json body = ParseBoundedJson(answer.body, "the answer").value_or(json());
  const std::string words = TextOr(ObjectOr(body, "error"), "message", "");
  const std::string tried = fmt::format("cannot upload {} ({} bytes): ", name, data.size());
  if (answer.status == 422) {
    return Fail(tried + "it arrived damaged (HTTP 422, checksum): " + words + "; try again",
                ErrorKind::kMachine);
  }
  if (answer.status == 413) {
    return Fail(tried +
                    "it is too large (HTTP 413) for the server: raise max_upload_size in "
                    "moonraker.conf (or client_max_body_size of the proxy)",
                ErrorKind::kMachine);
  }
  if (words.empty() || answer.status == 401) {
    return Fail(
        tried + HttpRefusal(answer.status, answer.server, address, !options.api_key.empty()),
        ErrorKind::kMachine);
  }
  return Fail(fmt::format("{}the server says '{}' (HTTP {}); is the disk full, or is that file "
                          "being printed?",
                          tried, words, answer.status),
              ErrorKind::kMachine);
}

Result<void> MoonrakerPrinter::DeleteFile(const std::string& name, const WaitLimit& limit) {
  TRY(CheckFileName(name));
  TRY(moonraker_.Call("server.files.delete_file", {{"path", "gcodes/" + name}}, limit));
  return {};
}

Result<void> MoonrakerPrinter::StartPrint(const std::string& name, const WaitLimit& limit) {
  TRY(moonraker_.Call("printer.print.start", {{"filename", name}}, limit));
  return {};
}

Result<void> MoonrakerPrinter::CancelPrint(const WaitLimit& limit) {
  TRY(moonraker_.Call("printer.print.cancel", nullptr, limit));
  return {};
}

}  // namespace trammel::machine
