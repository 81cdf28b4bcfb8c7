#include "panel/panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

#include "base/bounded_json.h"
#include "base/bug_note.h"
#include "base/json_text.h"
#include "base/url_secrets.h"
#include "machine/net/json_field.h"
#include "measurement/outcome_file.h"
#include "panel/metrics.h"
#include "panel/page_files.h"
#include "panel/run_files.h"
#include "service/request_params.h"

namespace trammel::panel {
namespace {

using machine::RpcAnswer;
using nlohmann::json;

constexpr int kParseError = -32700;  // JSON-RPC 2.0, section 5.1
constexpr int kInvalidRequest = -32600;
constexpr int kInternalError = -32603;
constexpr JsonBounds kMessageBounds{
    .max_bytes = 64 << 10, .max_levels = 8, .max_memory_bytes = 1 << 20};

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

using ScanType = std::pair<std::string_view, std::string_view>;
constexpr ScanType kScanTypes[] = {{"application/pdf", ".pdf"},
                                   {"image/png", ".png"},
                                   {"image/jpeg", ".jpg"},
                                   {"image/tiff", ".tif"}};

HttpAnswer HistoryTable(const service::JobServer* printer) {
  if (printer == nullptr) return NotFound();
  auto table = printer->Table();
  if (!table) return Refused(table.error());
  return {.content_type = "text/csv; charset=utf-8",
          .body = std::move(*table),
          .fields = {{"Content-Disposition", "attachment; filename=\"trammel-history.csv\""}}};
}

// True for the messages that must not wait behind others.
bool IsStop(std::string_view text) {
  if (text.find("stop\"") == std::string_view::npos) return false;
  const auto message = ParseBoundedJson(text, "the message", kMessageBounds);
  const std::string method = message ? machine::TextOr(*message, "method", "") : "";
  return method == "stop" || method == "emergency_stop";
}

json ErrorObject(int code, const std::string& message) {
  return {{"code", code}, {"message", message}};
}

}  // namespace

Panel::Panel(const PanelOptions& options)
    : recordings_(options.photos.recordings),
      has_surveys_(options.surveys),
      photos_(options.photos),
      surveys_({options.photos.program, options.photos.recordings, options.photos.utc_now,
                options.photos.log}) {}

Result<std::unique_ptr<Panel>> Panel::Open(PanelOptions options) {
  std::unique_ptr<Panel> panel(new Panel(options));
  Panel* const self = panel.get();
  panel->server_ = TRY(HttpServer::Listen(
      std::move(options.http),
      {[self](const HttpRequest& request) { return self->Answer(request); },
       [self](std::string_view message) { return self->AnswerMessage(message); }, IsStop}));
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
  if (path == "/history.csv") return HistoryTable(PrinterOf(request));
  if (path == "/metrics") return {.content_type = kMetricsType, .body = MetricsOf(printers_)};
  constexpr std::string_view kRuns = "/runs/";
  if (!path.starts_with(kRuns)) return NotFound();
  const std::size_t slash = path.find('/', kRuns.size());
  if (slash == std::string::npos) return NotFound();
  const std::string name = path.substr(slash + 1);
  auto file = ReadRunFile(recordings_, path.substr(kRuns.size(), slash - kRuns.size()), name);
  if (!file) return NotFound();
  HttpAnswer answer{.content_type = file->content_type, .body = std::move(file->bytes)};
  if (name == kReport) answer.fields["Content-Security-Policy"] = kReportPolicy;
  if (name == kNewestFrame) answer.fields["Cache-Control"] = "no-store";
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
  if (request.path == "/surveys" && has_surveys_) {
    const auto run = surveys_.Add(Queried(request, "run"), request.content_type, request.body);
    return run ? HttpAnswer{.body = JsonText(json{{"run", *run}})} : Refused(run.error());
  }
  if (request.path == "/sheets") {
    const auto type = std::ranges::find(kScanTypes, request.content_type, &ScanType::first);
    if (type == std::end(kScanTypes)) {
      return HttpError(415, "a scan of the sheet is PDF, PNG, JPEG or TIFF");
    }
    service::JobServer* const printer = PrinterOf(request);
    if (printer == nullptr) return NotFound();
    const auto file = printer->StoreScan(std::string(type->second), request.body, stop_);
    return file ? HttpAnswer{.body = JsonText(json{{"file", *file}})} : Refused(file.error());
  }
  return NotFound();
}

service::JobServer* Panel::PrinterOf(const HttpRequest& request) const {
  const std::string text = Queried(request, "printer");
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
  const bool whole = text.empty() ? printers_.size() == 1
                                  : error == std::errc() && end == text.data() + text.size();
  return whole && index < printers_.size() ? printers_[index] : nullptr;
}

std::string Panel::AnswerMessage(std::string_view text) {
  const auto message = ParseBoundedJson(text, "the message", kMessageBounds);
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
  RpcAnswer result;
  const auto bug = NoteBug([&] {
    result =
        Call((*message)["method"].get<std::string>(), message->value("params", json::object()));
  });
  if (bug) result = RpcAnswer::Refused(kInternalError, "this is a bug in trammel: " + *bug);
  if (result.kind == RpcAnswer::Kind::kResult) {
    answer["result"] = std::move(result.result);
  } else {
    answer["error"] = ErrorObject(result.code, result.message);
  }
  return JsonText(answer);
}

RpcAnswer Panel::Call(const std::string& method, json params) {
  if (!params.is_object()) return service::Invalid("the arguments must be an object");
  if (method == "printers") return ListPrinters();
  std::size_t index = 0;
  if (const auto found = params.find("printer"); found != params.end()) {
    const bool known =
        found->is_number_unsigned() && found->get<std::uint64_t>() < printers_.size();
    if (!known)
      return service::Invalid(fmt::format("'printer' must be below {}", printers_.size()));
    index = found->get<std::size_t>();
    params.erase(found);
  } else if (printers_.size() > 1) {
    return service::Invalid("there are several printers: name one as 'printer'");
  }
  service::JobServer& printer = *printers_[index];
  if (method == "emergency_stop") return printer.EmergencyStop();
  if (method == "offer") return printer.OfferAsked(params);
  if (method == "setup" || method == "set_up" || method == "undo_set_up") {
    return printer.SetUp(method, stop_);
  }
  if (method == "measure") return Measure(params);
  if (method == "survey" && has_surveys_) return MeasureSurvey(params);
  if (method == "use") return Use(params, printer);
  RpcAnswer answer = printer.Answer(method, params);
  if (method == "history" && answer.kind == RpcAnswer::Kind::kResult) AddFilesTo(answer.result);
  return answer;
}

RpcAnswer Panel::ListPrinters() const {
  constexpr double kPatience_s = 1;  // a page waits for all printers' names
  json list = json::array();
  for (std::size_t i = 0; i < printers_.size(); ++i) {
    const std::string& address = printers_[i]->options().address;
    const std::string nozzle = printers_[i]->Nozzle({kPatience_s, stop_});
    list.push_back({{"printer", i},
                    {"name", WithoutSecrets(address)},
                    {"subject", printers_[i]->subject()},
                    {"nozzle", nozzle.empty() ? json() : json(nozzle)}});
  }
  return {.result = {{"printers", std::move(list)}, {"surveys", has_surveys_}}};
}

void Panel::AddFilesTo(json& history) const {
  for (json& result : history.at("results")) {
    result["pictures"] = json::array();
    result["report"] = nullptr;
    if (result.at("run").is_string()) {
      AddFiles(recordings_ / result.at("run").get<std::string>(), result);
    }
  }
}

RpcAnswer Panel::Measure(const json& params) {
  const auto run = service::RunOf(params);
  const auto pattern = service::TextOf(params, "pattern");
  const auto filament = service::TextOf(params, "filament");
  for (const auto& text : {run, pattern, filament}) {
    if (!text) return service::Invalid(text.error().message);
  }
  const auto hold = InUse(*run);
  if (hold == nullptr) return RpcAnswer::Refused(service::kBusy, "it is being deleted");
  auto measured = photos_.Measure(*run, *pattern, *filament, stop_);
  if (!measured) return RpcAnswer::Refused(service::kRefused, measured.error().message);
  return {.result = std::move(*measured)};
}

service::FoldersInUse::Hold Panel::InUse(const std::string& run) const {
  return printers_.front()->options().in_use->Use(recordings_ / run);
}

RpcAnswer Panel::MeasureSurvey(const json& params) {
  const auto wrong = service::CheckKeys(params, {"run", "bars", "without"});
  if (wrong) return *wrong;
  const auto run = service::RunOf(params);
  const auto without = service::TextOf(params, "without");
  for (const auto& text : {run, without}) {
    if (!text) return service::Invalid(text.error().message);
  }
  const auto hold = InUse(*run);
  if (hold == nullptr) return RpcAnswer::Refused(service::kBusy, "it is being deleted");
  auto answer = surveys_.Measure(*run, params.value("bars", json()), *without, stop_);
  if (!answer) return RpcAnswer::Refused(service::kRefused, answer.error().message);
  return {.result = std::move(*answer)};
}

// The result of an upload is not replaced any more while it is being set, or once it is.
RpcAnswer Panel::Use(const json& params, service::JobServer& printer) {
  const auto run = service::RunOf(params);
  if (!run) return service::Invalid(run.error().message);
  constexpr double kPatience_s = 10;
  const auto outcome = files::ReadOutcome(recordings_ / *run / files::kResultFile);
  const std::string nozzle = outcome ? outcome->subject.nozzle : "";
  const std::string here = nozzle.empty() ? "" : printer.Nozzle({kPatience_s, stop_});
  if (nozzle != here && !here.empty()) {
    return RpcAnswer::Refused(
        service::kRefused, fmt::format("it was measured with a nozzle of {} mm, and {} has one of "
                                       "{} mm: measure there",
                                       nozzle, printer.subject(), here));
  }
  if (!PhotoRuns::IsUpload(*run)) return printer.Answer("use", params);
  const bool first = photos_.Freeze(*run);
  RpcAnswer used = printer.Answer("use", params);
  if (first && used.kind != RpcAnswer::Kind::kResult) photos_.Release(*run);
  return used;
}

}  // namespace trammel::panel
