// /metrics: state and results of the printers for Prometheus.
#pragma once

#include <span>
#include <string>

#include "service/job_server.h"

namespace trammel::panel {

/// Prometheus' text format, version 0.0.4.
inline constexpr const char* kMetricsType = "text/plain; version=0.0.4; charset=utf-8";

/// Returns for each printer whether it is ready, whether a run is at work and how much is due, and
/// the newest good pressure advance of each filament, nozzle and tool (docs/howto/panel.md).
[[nodiscard]] std::string MetricsOf(std::span<service::JobServer* const> printers);

}  // namespace trammel::panel
