#include "panel/panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/bounded_json.h"
#include "base/json_text.h"
#include "base/url_secrets.h"
#include "document/interval_text.h"
#include "files/whole_file.h"
#include "panel/page_files.h"

namespace trammel::panel {
namespace {

namespace fs = std::filesystem;
using machine::RpcAnswer;
using nlohmann::json;

constexpr int kParseError = -32700;  // JSON-RPC 2.0, section 5.1
constexpr int kInvalidRequest = -32600;

struct RunFile {
  std::string_view name;
  const char* content_type;
  bool figure = true;
};
constexpr RunFile kRunFiles[] = {{"answer.png", "image/png"},
                                 {"photo.png", "image/png"},
                                 {"response.png", "image/png"},
                                 {"profiles.png", "image/png"},
                                 {"result.json", "application/json", false},
                                 {"report.html", "text/html; charset=utf-8", false}};
// A report is one file with its style and figures inside; nothing of it runs or loads.
constexpr const char* kReportPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'; "
    "sandbox allow-popups";

HttpAnswer NotFound() { return HttpError(404, "there is nothing of that name"); }

HttpAnswer Refused(const Error& error) {
  return HttpError(error.kind == ErrorKind::kInput ? 400 : 409, error.message);
}

HttpAnswer PageOf(const PageFile& file) {
  return {.content_type = file.content_type,
          .body = std::string(reinterpret_cast<const char*>(file.bytes), file.size),
          .fields = {{"Content-Encoding", "gzip"},
                     {"Cache-Control", "no-cache"},
                     {"ETag", fmt::format("\"{}\"", file.hash)}}};
}

std::string Queried(const HttpRequest& request, const std::string& name) {
  const auto found = request.query.find(name);
  return found == request.query.end() ? std::string() : found->second;
}

Result<std::string> TextOf(const json& params, const char* key) {
  constexpr std::size_t kMaxText = 100;
  const auto found = params.find(key);
  if (found == params.end() || found->is_null()) return std::string();
  const bool fits = found->is_string() && found->get_ref<const std::string&>().size() <= kMaxText &&
                    std::ranges::none_of(found->get_ref<const std::string&>(),
                                         [](unsigned char c) { return c < ' ' || c == 0x7f; });
  if (fits) return found->get<std::string>();
  return Fail(fmt::format("'{}' must be one line of at most {} bytes", key, kMaxText));
}

RpcAnswer Invalid(const std::string& message) {
  return RpcAnswer::Refused(service::kInvalidParameters, message);
}

// Adds the text of each answer of a history, as on every screen and page.
void AddWords(json& history) {
  for (json& result : history.at("results")) {
    for (json& answer : result.at("answers")) {
      answer["words"] = answer.at("reason");
      if (answer.at("verdict") != ToString(Verdict::kGood)) continue;
      const report::IntervalStyle style{.unit = answer.at("unit").get<std::string>(),
                                        .signs = result.at("instrument") == "tool_offset"};
      const json& interval = answer.at("interval95");
      answer["words"] =
          report::WithInterval(answer.at("value").get<double>(),
                               {interval[0].get<double>(), interval[1].get<double>()}, style);
    }
  }
}

json ErrorObject(int code, const std::string& message) {
  return {{"code", code}, {"message", message}};
}

}  // namespace

Result<std::unique_ptr<Panel>> Panel::Open(PanelOptions options) {
  std::unique_ptr<Panel> panel(new Panel(std::move(options.photos)));
  Panel* const self = panel.get();
  panel->server_ = TRY(HttpServer::Listen(
      std::move(options.http),
      {[self](const HttpRequest& request) { return self->Answer(request); },
       [self](std::string_view message) { return self->AnswerMessage(message); },
       [](std::string_view message) { return message.find("stop\"") != std::string_view::npos; }}));
  return panel;
}

void Panel::Run(std::span<service::JobServer* const> printers, const std::stop_token& stop) {
  printers_.assign(printers.begin(), printers.end());
  stop_ = stop;
  for (std::size_t i = 0; i < printers_.size(); ++i) {
    printers_[i]->OnEvent([this, i](const std::string& event, json data) {
      Send(static_cast<int>(i), event, std::move(data));
    });
  }
  server_->Run(stop);
  for (service::JobServer* const printer : printers_) printer->OnEvent({});
}

void Panel::Send(int printer, const std::string& event, json data) {
  json params = {{"seq", ++events_}, {"printer", printer}};
  if (event == "run") params["run"] = std::move(data);
  server_->Broadcast(
      JsonText(json{{"jsonrpc", "2.0"}, {"method", event}, {"params", std::move(params)}}));
}

HttpAnswer Panel::Answer(const HttpRequest& request) {
  if (request.method == "POST") return AnswerPost(request);
  const std::string path = request.path == "/" ? "/index.html" : request.path;
  const auto files = PageFiles();
  const auto page =
      std::ranges::find_if(files, [&path](const PageFile& file) { return path == file.path; });
  if (page != files.end()) return PageOf(*page);
  constexpr std::string_view kRuns = "/runs/";
  if (!path.starts_with(kRuns)) return NotFound();
  const std::size_t slash = path.find('/', kRuns.size());
  if (slash == std::string::npos) return NotFound();
  const auto file =
      std::ranges::find(kRunFiles, std::string_view(path).substr(slash + 1), &RunFile::name);
  const auto folder = photos_.FolderOf(path.substr(kRuns.size(), slash - kRuns.size()));
  if (file == std::end(kRunFiles) || !folder) return NotFound();
  constexpr std::size_t kMaxBytes = 32 << 20;
  const fs::path place = file->figure ? *folder / kFigures : *folder;
  auto bytes = files::ReadNamedFile(place / file->name, kMaxBytes);
  if (!bytes) return NotFound();
  HttpAnswer answer{.content_type = file->content_type, .body = std::move(*bytes)};
  if (file->name == "report.html") answer.fields["Content-Security-Policy"] = kReportPolicy;
  return answer;
}

HttpAnswer Panel::AnswerPost(const HttpRequest& request) {
  if (request.path == "/photos") {
    const auto run = photos_.Add(request.content_type, request.body);
    return run ? HttpAnswer{.body = JsonText(json{{"run", *run}})} : Refused(run.error());
  }
  if (request.path == "/gcodes") {
    const auto added = photos_.AddGcode(Queried(request, "run"), request.body);
    return added ? HttpAnswer{.body = "{}"} : Refused(added.error());
  }
  return NotFound();
}

std::string Panel::AnswerMessage(std::string_view text) {
  constexpr JsonBounds kBounds{.max_bytes = 64 << 10, .max_levels = 8, .max_memory_bytes = 1 << 20};
  const auto message = ParseBoundedJson(text, "the message", kBounds);
  json answer = {{"jsonrpc", "2.0"}, {"id", nullptr}};
  if (!message) {
    answer["error"] = ErrorObject(kParseError, message.error().message);
    return JsonText(answer);
  }
  const bool has_id = message->is_object() && message->contains("id") &&
                      ((*message)["id"].is_number_integer() || (*message)["id"].is_string());
  if (has_id) answer["id"] = (*message)["id"];
  if (!has_id || !message->contains("method") || !(*message)["method"].is_string()) {
    answer["error"] = ErrorObject(kInvalidRequest, "a request has an id and a method");
    return JsonText(answer);
  }
  RpcAnswer result =
      Call((*message)["method"].get<std::string>(), message->value("params", json::object()));
  if (result.kind == RpcAnswer::Kind::kResult) {
    answer["result"] = std::move(result.result);
  } else {
    answer["error"] = ErrorObject(result.code, result.message);
  }
  return JsonText(answer);
}

RpcAnswer Panel::Call(const std::string& method, json params) {
  if (!params.is_object()) return Invalid("the arguments must be an object");
  if (method == "printers") {
    json list = json::array();
    for (std::size_t i = 0; i < printers_.size(); ++i) {
      list.push_back({{"printer", i}, {"name", WithoutSecrets(printers_[i]->options().address)}});
    }
    return {.result = {{"printers", std::move(list)}}};
  }
  std::size_t index = 0;
  if (const auto found = params.find("printer"); found != params.end()) {
    const bool known =
        found->is_number_unsigned() && found->get<std::uint64_t>() < printers_.size();
    if (!known) return Invalid(fmt::format("'printer' must be below {}", printers_.size()));
    index = found->get<std::size_t>();
    params.erase(found);
  }
  service::JobServer& printer = *printers_[index];
  if (method == "emergency_stop") return printer.EmergencyStop();
  if (method == "setup" || method == "set_up" || method == "undo_set_up") {
    return printer.SetUp(method, stop_);
  }
  if (method == "measure" || method == "use") return CallOfPhoto(method, params, printer);
  RpcAnswer answer = printer.Answer(method, params);
  if (method == "history" && answer.kind == RpcAnswer::Kind::kResult) AddWords(answer.result);
  return answer;
}

RpcAnswer Panel::CallOfPhoto(const std::string& method, const json& params,
                             service::JobServer& printer) {
  std::array<std::string, 3> texts;
  constexpr std::array kKeys{"run", "pattern", "filament"};
  for (std::size_t i = 0; i < kKeys.size(); ++i) {
    auto text = TextOf(params, kKeys[i]);
    if (!text) return Invalid(text.error().message);
    texts[i] = std::move(*text);
  }
  const auto& [run, pattern, filament] = texts;
  const auto folder = photos_.UploadOf(run);
  if (!folder) return RpcAnswer::Refused(service::kNothing, folder.error().message);
  if (method == "use") {
    photos_.Keep(run, true);
    service::Proposal proposal{run, "photo", folder->string(), {}};
    if (!filament.empty()) proposal.arguments["filament"] = filament;
    RpcAnswer used = printer.Use(std::move(proposal));
    if (used.kind != RpcAnswer::Kind::kResult) photos_.Keep(run, false);
    return used;
  }
  auto measured = photos_.Measure(run, pattern, stop_);
  if (!measured) return RpcAnswer::Refused(service::kRefused, measured.error().message);
  return {.result = std::move(*measured)};
}

}  // namespace trammel::panel
