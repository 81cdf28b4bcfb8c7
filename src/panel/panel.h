// The panel: pages and methods of `trammel serve` in a browser.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "panel/http_server.h"
#include "panel/photo_runs.h"
#include "panel/survey_runs.h"
#include "service/job_server.h"

namespace trammel::panel {

struct PanelOptions {
  HttpServerOptions http;
  PhotoRunsOptions photos;
  bool surveys = false;  ///< the program has `align survey`
};

/// Answers browsers: the page, its WebSocket with the service's methods and those of photos, and
/// the pictures and reports of runs.
class Panel {
 public:
  /// Opens the port. Errors: HttpServer::Listen's.
  [[nodiscard]] static Result<std::unique_ptr<Panel>> Open(PanelOptions options);
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;
  ~Panel() = default;

  [[nodiscard]] std::uint16_t port() const { return server_->port(); }

  /// Serves the printers' pages until stopped.
  void Run(std::span<service::JobServer* const> printers, const std::stop_token& stop);

 private:
  explicit Panel(const PanelOptions& options);

  [[nodiscard]] HttpAnswer Answer(const HttpRequest& request);
  [[nodiscard]] HttpAnswer AnswerPost(const HttpRequest& request);
  /// Returns the printer that a request names; null: there is none of that number.
  [[nodiscard]] service::JobServer* PrinterOf(const HttpRequest& request) const;
  [[nodiscard]] std::string AnswerMessage(std::string_view text);
  [[nodiscard]] machine::RpcAnswer Call(const std::string& method, nlohmann::json params);
  [[nodiscard]] machine::RpcAnswer ListPrinters() const;
  [[nodiscard]] machine::RpcAnswer Measure(const nlohmann::json& params);
  [[nodiscard]] machine::RpcAnswer MeasureSurvey(const nlohmann::json& params);
  [[nodiscard]] machine::RpcAnswer Use(const nlohmann::json& params, service::JobServer& printer);
  [[nodiscard]] service::FoldersInUse::Hold InUse(const std::string& run) const;
  void AddFilesTo(nlohmann::json& history) const;
  void Send(int printer, const std::string& event, nlohmann::json data);

  const std::filesystem::path recordings_;
  const bool has_surveys_;
  PhotoRuns photos_;
  SurveyRuns surveys_;
  std::vector<service::JobServer*> printers_;  // written before Run serves
  std::stop_token stop_;                       // likewise
  std::atomic<std::uint64_t> events_ = 0;
  std::unique_ptr<HttpServer> server_;  // last: its threads use everything above
};

}  // namespace trammel::panel
