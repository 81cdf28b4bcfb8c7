#include "panel/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "machine/net/json_field.h"
#include "measurement/change.h"

namespace trammel::panel {
namespace {

using nlohmann::json;

// Samples of all metrics: a metric's samples must stand together.
class Samples {
 public:
  void Add(const std::string& metric, const std::string& labels, double value) {
    samples_[metric] += fmt::format("{}{{{}}} {}\n", metric, labels, value);
  }
  [[nodiscard]] std::string Text() const {
    std::string text;
    for (const auto& [metric, what] : kMetrics) {
      const auto found = samples_.find(std::string(metric));
      if (found == samples_.end()) continue;
      text += fmt::format("# HELP {0} {1}\n# TYPE {0} gauge\n{2}", metric, what, found->second);
    }
    return text;
  }

 private:
  static constexpr std::pair<std::string_view, std::string_view> kMetrics[] = {
      {"trammel_printer_ready", "1 if the printer is connected and ready."},
      {"trammel_run_active", "1 while a run is at work on the printer."},
      {"trammel_due", "Number of measurements that are due again."},
      {"trammel_pressure_advance_seconds", "Newest good pressure advance."},
      {"trammel_pressure_advance_low_seconds", "Lower end of its 95 % interval."},
      {"trammel_pressure_advance_high_seconds", "Upper end of its 95 % interval."},
      {"trammel_pressure_advance_measured_timestamp_seconds", "When it was measured."}};
  std::map<std::string, std::string> samples_;
};

std::string Label(std::string_view name, std::string_view value) {
  std::string escaped;
  for (const char c : value) {
    if (c == '\\' || c == '"') escaped += '\\';
    escaped += c == '\n' ? ' ' : c;
  }
  return fmt::format("{}=\"{}\"", name, escaped);
}

void AddPressureAdvances(const json& results, const std::string& printer, Samples& samples) {
  std::set<std::string> seen;
  for (const json& result : results) {
    const json& subject = machine::ObjectOr(result, "subject");
    std::string labels = Label("printer", printer);
    for (const char* key : {"filament", "nozzle", "toolhead"}) {
      labels += "," + Label(key, machine::TextOr(subject, key, ""));
    }
    const bool good = machine::TextOr(result, "verdict", "") == "good" &&
                      machine::TextOr(subject, "printer", "") == printer;
    if (!good || !seen.insert(labels).second) continue;
    const json& answers = result.at("answers");
    const auto found = std::ranges::find_if(
        answers, [](const json& each) { return each.at("name") == "pressure_advance"; });
    if (found == answers.end()) continue;
    const json& answer = *found;
    constexpr const char* kMetric = "trammel_pressure_advance_";
    const auto add = [&](const char* what, double value) {
      samples.Add(fmt::format("{}{}", kMetric, what), labels, value);
    };
    add("seconds", answer.at("value").get<double>());
    add("low_seconds", answer.at("interval95").at(0).get<double>());
    add("high_seconds", answer.at("interval95").at(1).get<double>());
    if (const auto utc = measurement::ParseUtc(machine::TextOr(result, "utc", ""))) {
      add("measured_timestamp_seconds", static_cast<double>(*utc));
    }
  }
}

}  // namespace

std::string MetricsOf(std::span<service::JobServer* const> printers) {
  constexpr int kMostResults = 1000;
  Samples samples;
  for (service::JobServer* const printer : printers) {
    const std::string name = printer->subject();
    const std::string labels = Label("printer", name);
    const json status = printer->Answer("status", json::object()).result;
    samples.Add("trammel_printer_ready", labels,
                status.at("printer").at("readiness") == "ready" ? 1 : 0);
    samples.Add("trammel_run_active", labels, status.at("busy").get<bool>() ? 1 : 0);
    const auto due = printer->Answer("due", json::object());
    const auto history =
        printer->Answer("history", {{"last", kMostResults}, {"instrument", "pressure_advance"}});
    using Kind = machine::RpcAnswer::Kind;
    if (due.kind != Kind::kResult || history.kind != Kind::kResult) continue;
    samples.Add("trammel_due", labels, static_cast<double>(due.result.at("due").size()));
    AddPressureAdvances(history.result.at("results"), name, samples);
  }
  return samples.Text();
}

}  // namespace trammel::panel
