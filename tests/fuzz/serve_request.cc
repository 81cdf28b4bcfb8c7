// What front ends and programs ask of a service, while it has no printer.
#include <nlohmann/json.hpp>

#include "base/bounded_json.h"
#include "fuzz.h"
#include "service/desk.h"

namespace {

using namespace trammel;

service::DeskOptions Options() {
  service::JobKind kind;
  kind.name = "measure";
  kind.arguments = {"filament"};
  kind.check = [](const service::PrinterPlace&, const service::Arguments&, machine::Printer*) {
    return Result<service::Offer>(service::Offer{"Is the bed empty?"});
  };
  kind.answer = [](const std::string&) -> Result<service::AnswerInWords> { return Fail("none"); };
  service::DeskOptions options;
  options.address = "localhost";
  options.recordings = "/no/such/folder";
  options.state_folder = "/no/such/folder";
  options.jobs = {kind};
  options.utc_now = [] { return std::string("2026-01-02T03:04:05Z"); };
  options.log = [](const std::string&) {};
  return options;
}

}  // namespace

TRAMMEL_FUZZ_TARGET(serve_request)(const std::uint8_t* data, std::size_t size) {
  static service::Desk desk(Options());
  const auto parsed = ParseBoundedJson(fuzz::Text(data, size), "the request");
  if (!parsed || !parsed->is_object()) return 0;
  const auto method = parsed->find("method");
  if (method == parsed->end() || !method->is_string()) return 0;
  const machine::RpcAnswer answer =
      desk.Answer(method->get<std::string>(), parsed->value("params", nlohmann::json::object()));
  if (answer.kind == machine::RpcAnswer::Kind::kError) {
    fuzz::Require(answer.code != 0 && !answer.message.empty(), "a refusal says why");
  } else {
    fuzz::Require(answer.kind == machine::RpcAnswer::Kind::kResult && !answer.result.is_null(),
                  "an answer is a result or an error");
  }
  return 0;
}
