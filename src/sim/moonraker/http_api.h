// Virtual Moonraker's HTTP: the same methods under paths, uploads and files.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "sim/moonraker/hub.h"

namespace trammel::sim {

struct HttpRequest {
  std::string method;                          ///< "GET"
  std::string target;                          ///< path and query, as sent
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;
};

struct HttpResponse {
  int status = 200;
  std::string content_type = "application/json";
  std::string body;
};

using HttpReply = std::function<void(const HttpResponse&)>;

/// Answers at once or later. A target is at most 8 kB; the caller limits the body.
void AnswerHttp(Hub& hub, const HttpRequest& request, const HttpReply& reply);

/// True if a request has the key (X-Api-Key) or a one-shot token (?token=), or needs none.
[[nodiscard]] bool IsAuthorised(Hub& hub, const HttpRequest& request);

/// Path of a target and its decoded query.
struct Target {
  std::string path;
  std::map<std::string, std::string> query;
};
[[nodiscard]] Target ParseTarget(const std::string& target);

struct FormPart {
  std::string name;
  std::string filename;  ///< empty where the part is no file
  std::string body;
};

/// Parses a multipart/form-data body. Errors (kInput): another content type, no boundary, an
/// unclosed body, more than 100 parts.
[[nodiscard]] Result<std::vector<FormPart>> ParseMultipart(std::string_view content_type,
                                                           std::string_view body);

/// Returns the hash in lower-case hexadecimal.
[[nodiscard]] std::string Sha256(std::string_view data);

}  // namespace trammel::sim
