// The calls of MoonrakerPrinter on its files: uploads and downloads, with the words for one that
// was refused, and prints.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/bounded_json.h"
#include "machine/moonraker/http_files.h"
#include "machine/moonraker/moonraker_printer_impl.h"
#include "machine/moonraker/net_failure.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

/// A name that stays within the printable files and needs no escaping in a form.
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
    // The socket is trusted and may know the key; without one the server has to trust localhost.
    const Result<json> key = moonraker_.Call("access.get_api_key", nullptr, limit);
    if (key && key->is_string()) web.options.api_key = key->get<std::string>();
  }
  return web;
}

Result<std::string> MoonrakerPrinter::DownloadConfig(const std::string& name,
                                                     std::size_t most_bytes,
                                                     const WaitLimit& limit) {
  TRY(CheckFileName(name));
  const auto web = TRY(WebPlace(limit));
  Result<HttpAnswer> answer = GetFile(web.address, web.options, "config", name, most_bytes, limit);
  if (!answer && answer.error().kind == ErrorKind::kInput) {
    return Fail(fmt::format(
        "{} has more than the {:.0f} MiB that are read of a file ({}): store a "
        "smaller one",
        name, std::ldexp(static_cast<double>(most_bytes), -20), answer.error().message));
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
  const Result<HttpAnswer> answer = PostFile(address, options, root, name, data, limit);
  if (!answer) {
    return tl::unexpected(answer.error());
  }
  if (answer->status == 201 || answer->status == 200) {
    return {};
  }
  const json body = ParseBoundedJson(answer->body, "the answer").value_or(json());
  const std::string words = TextOr(ObjectOr(body, "error"), "message", "");
  const std::string tried = fmt::format("cannot upload {} ({} bytes): ", name, data.size());
  if (answer->status == 422) {
    return Fail(tried + "it arrived damaged (HTTP 422, checksum): " + words + "; try again",
                ErrorKind::kMachine);
  }
  if (answer->status == 413) {
    return Fail(tried +
                    "it is too large (HTTP 413) for the server: raise max_upload_size in "
                    "moonraker.conf (or client_max_body_size of the proxy)",
                ErrorKind::kMachine);
  }
  if (words.empty() || answer->status == 401) {
    return Fail(
        tried + HttpRefusal(answer->status, answer->server, address, !options.api_key.empty()),
        ErrorKind::kMachine);
  }
  return Fail(fmt::format("{}the server says '{}' (HTTP {}); is the disk full, or is that file "
                          "being printed?",
                          tried, words, answer->status),
              ErrorKind::kMachine);
}

Result<void> MoonrakerPrinter::DeleteFile(const std::string& name, const WaitLimit& limit) {
  TRY(CheckFileName(name));
  const Result<json> answer =
      moonraker_.Call("server.files.delete_file", {{"path", "gcodes/" + name}}, limit);
  return answer ? Result<void>() : tl::unexpected(answer.error());
}

Result<void> MoonrakerPrinter::StartPrint(const std::string& name, const WaitLimit& limit) {
  const Result<json> answer = moonraker_.Call("printer.print.start", {{"filename", name}}, limit);
  return answer ? Result<void>() : tl::unexpected(answer.error());
}

Result<void> MoonrakerPrinter::CancelPrint(const WaitLimit& limit) {
  const Result<json> answer = moonraker_.Call("printer.print.cancel", nullptr, limit);
  return answer ? Result<void>() : tl::unexpected(answer.error());
}

}  // namespace trammel::machine
