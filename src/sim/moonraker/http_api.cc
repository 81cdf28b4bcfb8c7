#include "sim/moonraker/http_api.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>

#include "base/bounded_json.h"
#include "base/text.h"

namespace trammel::sim {
namespace {

constexpr std::size_t kMaxParts = 100;

// Returns the value of key="value" or key=value in a header.
std::string Attribute(std::string_view header, std::string_view key) {
  std::size_t at = 0;
  while ((at = header.find(key, at)) != std::string_view::npos) {
    const bool begins = at == 0 || header[at - 1] == ' ' || header[at - 1] == ';';
    const std::size_t after = at + key.size();
    at = after;
    if (!begins || after >= header.size() || header[after] != '=') continue;
    std::string_view value = header.substr(after + 1);
    if (!value.empty() && value.front() == '"') {
      value.remove_prefix(1);
      return std::string(value.substr(0, value.find('"')));
    }
    return std::string(value.substr(0, value.find_first_of("; \r\n")));
  }
  return {};
}

}  // namespace

Result<std::vector<FormPart>> ParseMultipart(std::string_view content_type, std::string_view body) {
  const std::string boundary = Attribute(content_type, "boundary");
  if (content_type.substr(0, 19) != "multipart/form-data" || boundary.empty()) {
    return Fail("the upload is no multipart/form-data with a boundary");
  }
  const std::string mark = "--" + boundary;
  std::vector<FormPart> parts;
  std::size_t at = body.find(mark);
  while (at != std::string_view::npos) {
    at += mark.size();
    if (body.substr(at, 2) == "--") return parts;
    const std::size_t head_end = body.find("\r\n\r\n", at);
    const std::size_t next = body.find("\r\n" + mark, at);
    if (head_end == std::string_view::npos || next == std::string_view::npos || head_end > next) {
      break;
    }
    if (parts.size() >= kMaxParts) return Fail("the upload has more than 100 parts");
    const std::string_view head = body.substr(at, head_end - at);
    const std::size_t from = std::min(next, head_end + 4);
    parts.push_back({Attribute(head, "name"), Attribute(head, "filename"),
                     std::string(body.substr(from, next - from))});
    at = next + 2;
  }
  return Fail("the upload's form is not closed by its boundary");
}

std::string Sha256(std::string_view data) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  EVP_Digest(data.data(), data.size(), digest.data(), &size, EVP_sha256(), nullptr);
  std::string hex;
  for (unsigned int i = 0; i < size; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

namespace {

constexpr std::size_t kLongestTarget = 8192;
constexpr std::size_t kMaxFiles = 1000;
const std::string kFilePath = "/server/files/gcodes/";
const std::string kConfigPath = "/server/files/config/";

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char lower = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

std::string Decoded(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && HexDigit(text[i + 1]) >= 0 &&
        HexDigit(text[i + 2]) >= 0) {
      plain += static_cast<char>(HexDigit(text[i + 1]) * 16 + HexDigit(text[i + 2]));
      i += 2;
    } else {
      plain += text[i] == '+' ? ' ' : text[i];
    }
  }
  return plain;
}

HttpResponse Failure(int status, std::string message, const std::string& detail = {}) {
  // A reason line cannot contain a newline; Moonraker then uses its default.
  if (message.find('\n') != std::string::npos) message = "Unknown";
  const Json body = {{"error",
                      {{"code", status},
                       {"message", message},
                       {"traceback", detail.empty() ? Json(nullptr) : Json(detail)}}}};
  return {status, "application/json; charset=UTF-8",
          body.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

HttpResponse Success(int status, const Json& body) {
  return {status, "application/json; charset=UTF-8",
          body.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

// Returns the methods that HTTP offers: /printer/gcode/script is printer.gcode.script.
std::string MethodOf(const std::string& path) {
  static const std::set<std::string> offered = {
      "server.info",
      "printer.info",
      "printer.objects.list",
      "printer.objects.query",
      "printer.gcode.script",
      "printer.emergency_stop",
      "printer.restart",
      "printer.print.start",
      "printer.print.pause",
      "printer.print.resume",
      "printer.print.cancel",
      "printer.firmware_restart",
      "server.webcams.list",
      "server.files.list",
      "server.files.roots",
      "access.oneshot_token",
      "printer.gcode.help",
      "server.extensions.list",
      "server.extensions.request",
  };
  if (path == "/access/api_key") return "access.get_api_key";
  std::string method = path.empty() ? path : path.substr(1);
  std::replace(method.begin(), method.end(), '/', '.');
  return offered.count(method) > 0 ? method : std::string();
}

// Returns the parameters: GET's query or POST's JSON.
Json ParamsOf(const HttpRequest& request, const Target& target, const std::string& method) {
  Json params = Json::object();
  if (auto body = ParseBoundedJson(request.body, "the body"); body && body->is_object()) {
    params = std::move(*body);
  }
  if (method == "printer.objects.query" && !params.contains("objects") && !target.query.empty()) {
    for (const auto& [name, fields] : target.query) {
      if (name == "token") continue;
      Json& wanted = params["objects"][name];
      wanted = nullptr;
      std::size_t from = 0;
      while (from < fields.size()) {
        const std::size_t end = std::min(fields.size(), fields.find(',', from));
        wanted.push_back(fields.substr(from, end - from));
        from = end + 1;
      }
    }
    return params;
  }
  for (const auto& [name, value] : target.query) {
    if (!params.contains(name)) params[name] = value;
  }
  return params;
}

// True for a path inside the folder of G-code files, without escapes from it.
bool GoodName(const std::string& name) {
  return !name.empty() && name.size() < 256 && name.front() != '/' &&
         name.find("..") == std::string::npos && std::all_of(name.begin(), name.end(), [](char c) {
           return static_cast<unsigned char>(c) >= ' ' && c != '"';
         });
}

void Upload(Hub& hub, const HttpRequest& request, const HttpReply& reply) {
  const auto type = request.headers.find("content-type");
  const Result<std::vector<FormPart>> parts =
      ParseMultipart(type == request.headers.end() ? "" : type->second, request.body);
  // An upload's error appears only in the trace.
  const auto refuse = [&reply](const std::string& why) { reply(Failure(400, "Bad Request", why)); };
  if (!parts) return refuse(parts.error().message);
  std::map<std::string, std::string> fields;
  const FormPart* file = nullptr;
  for (const FormPart& part : *parts) {
    if (part.name == "file") file = &part;
    if (part.name != "file") fields[part.name] = part.body;
  }
  if (file == nullptr || file->filename.empty()) {
    return refuse("No file name specifed in upload form");
  }
  const std::string root = fields.count("root") > 0 ? fields["root"] : "gcodes";
  if (root != "gcodes" && root != "config") return refuse("Invalid root request: " + root);
  std::string name = file->filename;
  if (!fields["path"].empty()) name = fields["path"] + "/" + name;
  if (!GoodName(name)) return refuse("Invalid file name");
  const std::string sum = Sha256(file->body);
  const std::string wanted = LowerCase(fields["checksum"]);
  if (!wanted.empty() && wanted != sum) {
    return reply(
        Failure(422, "Unprocessable Entity",
                fmt::format("File checksum mismatch: expected {}, calculated {}", wanted, sum)));
  }
  const bool start = fields["print"] == "true";
  bool full = false;
  hub.machine().With([&](VirtualKlipper& klipper) {
    std::size_t bytes = file->body.size();
    for (const auto& [other, text] : klipper.files()) bytes += other == name ? 0 : text.size();
    for (const auto& [other, kept] : klipper.config_files()) bytes += kept.data.size();
    const bool known =
        root == "config" ? klipper.config_files().contains(name) : klipper.files().contains(name);
    const std::size_t count = klipper.files().size() + klipper.config_files().size();
    full = bytes > hub.options().max_file_bytes || (!known && count >= kMaxFiles);
    if (full) return;
    if (root == "config") {
      const std::chrono::duration<double> now = std::chrono::system_clock::now().time_since_epoch();
      klipper.StoreConfigFile(name, file->body, now.count());
    } else {
      klipper.files()[name] = file->body;
    }
  });
  if (full) return reply(Failure(500, "No space left on device"));
  const auto done = [reply, name, root, size = file->body.size()](bool started) {
    const Json item = {
        {"path", name}, {"root", root}, {"modified", 0.0}, {"size", size}, {"permissions", "rw"}};
    reply(Success(201, {{"item", item},
                        {"print_started", started},
                        {"print_queued", false},
                        {"action", "create_file"}}));
  };
  if (!start) return done(false);
  hub.Request("printer.print.start", {{"filename", name}},
              [done](const Answer& answer) { done(!answer.error); });
}

void ServeFile(Hub& hub, const std::string& name, const HttpReply& reply) {
  std::optional<std::string> text;
  hub.machine().With([&](VirtualKlipper& klipper) {
    const auto found = klipper.files().find(name);
    if (found == klipper.files().end()) return;
    text = found->second;
  });
  if (!text) return reply(Failure(404, "Not Found"));
  reply({200, "text/plain", *text});
}

void ServeConfigFile(Hub& hub, const std::string& name, const HttpReply& reply) {
  std::optional<std::string> data;
  bool folder = false;
  hub.machine().With([&](VirtualKlipper& klipper) {
    const auto found = klipper.config_files().find(name);
    if (found != klipper.config_files().end()) data = found->second.data;
    const auto inside = klipper.config_files().lower_bound(name + "/");
    folder = inside != klipper.config_files().end() && inside->first.starts_with(name + "/");
  });
  if (folder) return reply(Failure(403, "Forbidden"));
  if (!data) return reply(Failure(404, "Not Found"));
  reply({200, "application/octet-stream", *data});
}

}  // namespace

Target ParseTarget(const std::string& text) {
  Target target;
  const std::size_t mark = std::min(text.size(), text.find('?'));
  target.path = Decoded(text.substr(0, mark));
  std::size_t from = mark + 1;
  while (from < text.size()) {
    const std::size_t end = std::min(text.size(), text.find('&', from));
    const std::string word = text.substr(from, end - from);
    const std::size_t equals = std::min(word.size(), word.find('='));
    if (equals > 0) {
      target.query[Decoded(word.substr(0, equals))] =
          equals < word.size() ? Decoded(word.substr(equals + 1)) : std::string();
    }
    from = end + 1;
  }
  return target;
}

bool IsAuthorised(Hub& hub, const HttpRequest& request) {
  if (hub.KeyIsRight("")) return true;
  const auto key = request.headers.find("x-api-key");
  if (key != request.headers.end() && hub.KeyIsRight(key->second)) return true;
  const Target target = ParseTarget(request.target);
  const auto token = target.query.find("token");
  return token != target.query.end() && hub.TakeToken(token->second);
}

void AnswerHttp(Hub& hub, const HttpRequest& request, const HttpReply& reply) {
  if (request.target.size() > kLongestTarget) return reply(Failure(414, "URI Too Long"));
  if (!IsAuthorised(hub, request)) return reply(Failure(401, "Unauthorized"));
  const Target target = ParseTarget(request.target);
  if (target.path == "/server/files/upload") {
    if (request.method != "POST") return reply(Failure(405, "Method Not Allowed"));
    return Upload(hub, request, reply);
  }
  const bool config = target.path.starts_with(kConfigPath);
  if (config || target.path.starts_with(kFilePath)) {
    if (request.method != "GET") return reply(Failure(405, "Method Not Allowed"));
    return config ? ServeConfigFile(hub, target.path.substr(kConfigPath.size()), reply)
                  : ServeFile(hub, target.path.substr(kFilePath.size()), reply);
  }
  const std::string method = MethodOf(target.path);
  if (method.empty()) return reply(Failure(404, "Not Found"));
  hub.Request(method, ParamsOf(request, target, method), [reply](const Answer& answer) {
    if (answer.error) return reply(Failure(answer.error->code, answer.error->message));
    reply(Success(200, {{"result", answer.result}}));
  });
}

}  // namespace trammel::sim
